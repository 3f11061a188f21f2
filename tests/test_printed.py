"""The papers' forms as printed: where each is right, and its errata. P1's switching, P2's model, P4's compass."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.core import leg_direction, rms, track_errors
from steerway.guidance import Mission, Route
from steerway.guidance.testing import line_of_sight
from steerway.sensors import TCM2, DynamicCompass
from steerway.vessels import CALM, SPRINGER_PHYSICAL_YAW, CyberShip2, Springer, conditions
from steerway.vessels import CYBERSHIP2_DAMPING as DAMPING
from steerway.vessels import CYBERSHIP2_INERTIA as INERTIA
from steerway_studies.testing import PrintedCompassKalman
from steerway_studies.testing import course_autopilot as steering
from steerway_studies.testing import positioning as printed

P1_WAYPOINTS = ([0.0, 2000.0, 5000.0, 3000.0, 6000.0, 10000.0], [0.0, 0.0, 5000.0, 8000.0, 12000.0, 12000.0])


def switches_along_p1(as_printed):
    """Waypoints that a ship takes which makes good the desired course at once, with one form of (45) and (46)."""
    corners, leg = list(zip(*P1_WAYPOINTS, strict=True)), 0
    north, east = 0.0, 0.0
    for _ in range(3000):
        (n0, e0), (n1, e1) = corners[leg], corners[leg + 1]
        direction = leg_direction(n0, e0, n1, e1)
        _, cross_track = track_errors(north, east, n0, e0, direction)
        course, _ = line_of_sight(direction, cross_track, 0.0, 800.0)
        north, east = north + 7.7 * math.cos(course), east + 7.7 * math.sin(course)
        along = steering.along_track(north, east, n0, e0, direction, as_printed)
        if steering.switches(math.hypot(n1 - n0, e1 - e0), along, 50.0, as_printed):
            leg += 1
            if leg + 1 == len(corners):
                break
    return leg


def test_erratum_p1_46_no_waypoint_switches():
    assert switches_along_p1(as_printed=True) == 0
    assert switches_along_p1(as_printed=False) == 5


def test_erratum_p1_45_a_ship_behind_the_leg_switches():
    assert steering.switches(2000.0, -1960.0, 50.0)
    assert not steering.switches(2000.0, -1960.0, 50.0, printed=False)
    assert steering.switches(2000.0, 1960.0, 50.0, printed=False)
    mission = Mission(Route([0.0, 2000.0], [0.0, 0.0], acceptance=50.0))
    mission.step(-1960.0, 0.0, 1.0)
    assert not mission.log.passages


STEP = 0.01
FORCE = np.array([1.0, -0.4, 0.2])
STATE = np.array([1.0, 2.0, 0.7, 0.1, -0.05, 0.2])


def body(x):
    """(surge, sway, yaw rate) of [η; η̇]: ν = Rᵀη̇, (1); the printed ν = η̇ R⁻¹ is no product of these shapes."""
    c, s = np.cos(x[2]), np.sin(x[2])
    return np.array([c * x[3] + s * x[4], c * x[4] - s * x[3], x[5]])


def test_the_corrected_form_is_the_vessel_s_own_motion():
    ship, x = CyberShip2(), STATE
    state = np.array([*x[:3], *body(x)])
    for _ in range(1000):
        x = printed.advance(x, FORCE, INERTIA, DAMPING, STEP, printed=False)
        state = ship.step(state, FORCE, conditions(), STEP)
    np.testing.assert_allclose(x[:3], state[:3], atol=2e-4)
    np.testing.assert_allclose(body(x), state[3:], atol=2e-4)


def test_erratum_8_the_environment_s_force_is_dropped():
    push = np.array([0.3, -0.1, 0.05])
    without, whole = (printed.earth_fixed_force(0.7, FORCE, push, each) for each in (True, False))
    np.testing.assert_allclose(whole - without, push)
    # It is what a force in the conditions does to the vessel.
    still = np.array([0.0, 0.0, 0.7, 0.0, 0.0, 0.0])
    moved = CyberShip2().step(still, FORCE, conditions((0.0, 0.0), push[:2], push[2]), 1e-4)
    inertia, _, _ = printed.earth_fixed(0.7, 0.0, INERTIA, DAMPING)
    c, s = np.cos(moved[2]), np.sin(moved[2])
    velocity = np.array([c * moved[3] - s * moved[4], s * moved[3] + c * moved[4], moved[5]])
    np.testing.assert_allclose(velocity / 1e-4, np.linalg.solve(inertia, whole), rtol=1e-3)


def test_erratum_12_the_printed_b_pushes_backwards():
    right, wrong = (printed.state_matrices(STATE, INERTIA, DAMPING, each)[1] for each in (False, True))
    np.testing.assert_allclose(right, -wrong)
    ahead = printed.earth_fixed_force(STATE[2], (1.0, 0.0, 0.0))
    bow = np.array([np.cos(STATE[2]), np.sin(STATE[2])])
    assert bow @ (right @ ahead)[3:5] > 0.0 > bow @ (wrong @ ahead)[3:5]


def test_erratum_15_and_17_a_continuous_a_is_no_step_in_time():
    after = printed.advance(STATE, FORCE, INERTIA, DAMPING, STEP)
    np.testing.assert_allclose(after[:3], STATE[3:])  # the place has become the velocity, whatever the step
    right = printed.advance(STATE, FORCE, INERTIA, DAMPING, STEP, printed=False)
    np.testing.assert_allclose(right[:3], STATE[:3] + STEP * STATE[3:], atol=1e-4)


def test_14_is_the_jacobian_of_f():
    found = printed.linearised(STATE, FORCE, INERTIA, DAMPING)
    np.testing.assert_allclose(found[:3], np.eye(6)[3:], atol=1e-8)
    small = 1e-4 * np.array([0.0, 0.0, 1.0, 0.3, -0.2, 0.5])
    a, b = printed.state_matrices(STATE + small, INERTIA, DAMPING, printed=False)
    c, d = printed.state_matrices(STATE, INERTIA, DAMPING, printed=False)
    moved = STATE + small
    change = a @ moved + b @ printed.earth_fixed_force(moved[2], FORCE)
    change -= c @ STATE + d @ printed.earth_fixed_force(STATE[2], FORCE)
    np.testing.assert_allclose(found @ small, change, rtol=1e-3, atol=1e-9)


def test_erratum_13_at_rest_positions_alone_do_not_show_the_heading():
    a = printed.linearised(np.zeros(6), np.zeros(3), INERTIA, DAMPING)
    for compass, rank in ((False, 5), (True, 6)):
        rows = [printed.observed(compass) @ np.linalg.matrix_power(a, k) for k in range(6)]
        assert np.linalg.matrix_rank(np.vstack(rows), 1e-6) == rank


TICKS = 40


def headings(rate, seconds=60):
    """Heading (deg) at the ticks of a steady turn, and the compass's readings of it."""
    true = rate * np.arange(seconds * TICKS) / TICKS
    compass = DynamicCompass(TCM2).start(0.0, np.random.default_rng(1))
    return true, np.degrees([compass.readings(np.radians(each), 1)[0] for each in true])


def estimated(rate, fed):
    """Errors (deg) against the compass's own reading without noise, from 20 s on."""
    true, readings = headings(rate)
    known, own = PrintedCompassKalman(), 0.0
    error = []
    for heading, reading in zip(true, readings, strict=True):
        own = known.step(heading if fed == "truth" else own, reading)
        error.append(own - heading)
    return np.array(error[20 * TICKS :])


def test_told_the_heading_it_smooths_the_readings():
    true, readings = headings(0.0)
    assert rms(estimated(0.0, "truth")) < 0.5 * rms((readings - true)[20 * TICKS :])


def test_told_its_own_estimate_it_lags_further_in_a_turn():
    """The input that the paper takes is the unknown heading: without it the estimate falls behind."""
    told, alone = (abs(estimated(5.0, fed).mean()) for fed in ("truth", "own"))
    assert alone > 1.5 * told


def test_springer_takes_the_yaw_of_another_boat():
    slow = SPRINGER_PHYSICAL_YAW._replace(inputs=tuple(0.5 * each for each in SPRINGER_PHYSICAL_YAW.inputs))
    own, other = Springer(), Springer(yaw=slow)
    states = [each.start() for each in (own, other)]
    for _ in range(40):
        states = [each.step(state, (5.0,), CALM, 0.5) for each, state in zip((own, other), states, strict=True)]
    assert other.heading(states[1]) == pytest.approx(0.5 * own.heading(states[0]), rel=1e-9)
    with pytest.raises(InputError, match=r"springer\.yaw is "):
        Springer(yaw=slow._replace(outputs=(0.0, 1.0)))
