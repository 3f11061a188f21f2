"""Two propellers and any number of thrusters: the demand is met if possible; of two, the yaw moment has priority."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from steerway.control import OTTER_PROPELLERS, Thrusters, thruster_matrix
from steerway.control.testing import thrust
from steerway.core import InputError
from steerway_studies.testing import course_autopilot as printed


def given_by(propellers, port, starboard):
    """Force and moment of two propeller speeds, by the forward model."""
    ends = [thrust(n, propellers.gain_ahead, propellers.gain_astern) for n in (port, starboard)]
    return ends[0] + ends[1], propellers.arm * (ends[0] - ends[1])


@given(force=st.floats(-400.0, 400.0), moment=st.floats(-200.0, 200.0))
def test_what_is_reported_is_what_the_propellers_give(force, moment):
    boat = OTTER_PROPELLERS
    out = boat.step(force, moment)
    assert given_by(boat, out.port, out.starboard) == pytest.approx((out.surge_force, out.yaw_moment), abs=1e-9)
    for speed in (out.port, out.starboard):
        assert boat.min_speed - 1e-9 <= speed <= boat.max_speed + 1e-9
    # The yaw moment is reduced only beyond the largest of the pair,
    assert out.yaw_moment == pytest.approx(max(-boat.max_moment, min(boat.max_moment, moment)), abs=1e-9)
    # and the force is the nearest one possible with this moment.
    side = abs(out.yaw_moment) / boat.arm
    highest, lowest = 2 * 24.4 * 9.81 / 2 - side, -2 * 13.6 * 9.81 / 2 + side
    assert out.surge_force == pytest.approx(max(lowest, min(highest, force)), abs=1e-9)


def test_the_gain_astern_is_its_own_and_some_propellers_do_not_reverse():
    ahead, astern = OTTER_PROPELLERS.step(40.0, 0.0), OTTER_PROPELLERS.step(-40.0, 0.0)
    assert ahead.port == ahead.starboard == pytest.approx(math.sqrt(20.0 / (0.02216 / 2)))
    assert astern.port == astern.starboard == pytest.approx(-math.sqrt(20.0 / (0.01289 / 2)))
    turning = OTTER_PROPELLERS.step(0.0, 10.0)
    assert turning.port > 0.0 > turning.starboard  # to starboard
    assert -turning.starboard / turning.port == pytest.approx(math.sqrt(0.02216 / 0.01289))
    boat = replace(OTTER_PROPELLERS, min_speed=0.0)
    out = boat.step(0.0, 10.0)
    assert out.starboard == 0.0 and out.yaw_moment == pytest.approx(10.0)
    assert out.surge_force == pytest.approx(10.0 / boat.arm)


@given(force=st.floats(-200.0, 200.0), moment=st.floats(-40.0, 40.0))
def test_the_printed_allocation_inverts_its_own_model(force, moment):
    """P0 (60) with one gain; a real propeller that runs astern gives less than demanded."""
    port, starboard = printed.propeller_speeds(force, moment)
    squares = [n * abs(n) * printed.GAIN for n in (port, starboard)]
    assert squares[0] + squares[1] == pytest.approx(force, abs=1e-9)
    assert printed.ARM * (squares[0] - squares[1]) == pytest.approx(moment, abs=1e-9)


def test_erratum_one_gain_for_both_directions_loses_moment_and_gains_force():
    port, starboard = printed.propeller_speeds(0.0, 20.0)
    force, moment = given_by(OTTER_PROPELLERS, port, starboard)
    assert moment == pytest.approx(15.79, abs=0.01) and force == pytest.approx(10.57, abs=0.01)


PLACES = [(-1.0, -0.5, 0.0), (-1.0, 0.5, 0.0), (1.2, 0.0, 0.5 * np.pi), (-1.2, 0.0, 0.5 * np.pi)]
MATRIX = thruster_matrix(PLACES)


THRUSTERS = Thrusters(MATRIX, np.full(4, -50.0), np.full(4, 50.0))


@pytest.mark.parametrize("force", [(10.0, 0.0, 0.0), (0.0, 20.0, -3.0), (-30.0, 5.0, 12.0)])
def test_what_the_limits_allow_is_given_with_the_least_thrust(force):
    # Thrust ahead at the port stern turns to starboard; so does thrust to starboard at the bow.
    np.testing.assert_allclose(MATRIX[:, [0, 2]].T, [(1.0, 0.0, 0.5), (0.0, 1.0, 1.2)], atol=1e-12)
    thrusts, given = THRUSTERS.allocate(force)
    np.testing.assert_allclose(given, force, atol=1e-9)
    null = np.linalg.svd(MATRIX)[2][3]
    assert abs(thrusts @ null) < 1e-9  # no thrust in the null space of B
    pilots = THRUSTERS.step(force[0], force[2])
    assert len(pilots) == 6 and pilots[4:] == pytest.approx((force[0], force[2]))


def test_a_thruster_at_its_limit_is_relieved_by_the_others_and_all_stay_within_theirs():
    # A moment of 70 N·m alone needs more than 20 N from the stern pair and from the bow and stern thrusters.
    wanted = (0.0, 0.0, 45.0)
    free = np.linalg.pinv(MATRIX) @ wanted
    limited = Thrusters(MATRIX, [-50.0, -50.0, -50.0, -50.0], [50.0, 50.0, 0.9 * free.max(), 50.0])
    thrusts, given = limited.allocate(wanted)
    assert thrusts[2] == pytest.approx(0.9 * free.max())
    np.testing.assert_allclose(given, wanted, atol=1e-9)
    thrusts, given = THRUSTERS.allocate((1e6, 0.0, 0.0))
    assert (np.abs(thrusts) <= 50.0).all() and given[0] == pytest.approx(100.0) and abs(given[2]) < 1e-9


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: replace(OTTER_PROPELLERS, arm=-0.4), r"propellers\.arm is -0\.4"),
        (lambda: replace(OTTER_PROPELLERS, min_speed=3.0), r"propellers\.min_speed is 3 rad/s, expected at most 0"),
        (lambda: Thrusters(np.eye(2), [-1, -1], [1, 1]), r"thrusters\.matrix has shape \(2, 2\)"),
        (lambda: Thrusters(np.eye(3), [-1, -1], [1, 1, 1]), r"thrusters\.low has shape \(2,\), expected \(3,\)"),
        (lambda: Thrusters(np.eye(3), [-1] * 3, [1, 1]), r"thrusters\.high has shape \(2,\), expected \(3,\)"),
        (lambda: Thrusters(np.eye(3), [0, 0, 0], [1, 1, 0]), "expected low at most 0, high above 0"),
        (lambda: Thrusters(np.ones((3, 4)), [-1] * 4, [1] * 4), "three independent ones"),
    ],
)
def test_what_cannot_be_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
