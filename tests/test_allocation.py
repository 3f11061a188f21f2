"""Two propellers: the demand is met if possible, else the yaw moment has priority."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from steerway.control import OTTER_PROPELLERS
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


def test_the_gain_astern_is_its_own():
    ahead, astern = OTTER_PROPELLERS.step(40.0, 0.0), OTTER_PROPELLERS.step(-40.0, 0.0)
    assert ahead.port == ahead.starboard == pytest.approx(math.sqrt(20.0 / (0.02216 / 2)))
    assert astern.port == astern.starboard == pytest.approx(-math.sqrt(20.0 / (0.01289 / 2)))
    turning = OTTER_PROPELLERS.step(0.0, 10.0)
    assert turning.port > 0.0 > turning.starboard  # to starboard
    assert -turning.starboard / turning.port == pytest.approx(math.sqrt(0.02216 / 0.01289))


def test_limits_of_the_otter_are_its_bollard_pull():
    assert OTTER_PROPELLERS.max_speed == pytest.approx(103.93, abs=0.01)
    assert OTTER_PROPELLERS.min_speed == pytest.approx(-101.74, abs=0.01)
    assert OTTER_PROPELLERS.step(1e6, 0.0).surge_force == pytest.approx(24.4 * 9.81)
    assert OTTER_PROPELLERS.step(-1e6, 0.0).surge_force == pytest.approx(-13.6 * 9.81)


def test_propellers_that_do_not_reverse():
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


def test_propellers_that_cannot_be_are_refused():
    with pytest.raises(InputError, match=r"propellers\.arm is -0\.4"):
        replace(OTTER_PROPELLERS, arm=-0.4)
    with pytest.raises(InputError, match=r"propellers\.min_speed is 3 rad/s, expected at most 0"):
        replace(OTTER_PROPELLERS, min_speed=3.0)
