"""CyberShip II against golden rows, her equations in matrices, and the symmetries of a vessel on open water."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.vessels import CALM, CyberShip2, conditions
from steerway.vessels.testing import DAMPING, INERTIA
from steerway.vessels.testing import cybership2_derivatives as derivatives
from tests.cybership_forces import public_forces
from tests.golden import assert_golden, columns, golden

STATE = np.array([3.0, -2.0, 0.7, 0.3, -0.15, 0.2])
FORCE = np.array([0.8, -0.4, 0.1])


def rotation(heading):
    c, s = math.cos(heading), math.sin(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def test_the_linear_vessel_sails_the_golden_way(shared_data):
    table = golden(shared_data, "cs2_passive_observer")
    vessel, state, h = CyberShip2(), np.zeros(6), 0.02
    rows = [state]
    for k in range(5 * (len(table) - 1)):
        state = vessel.step(state, public_forces(h * k), CALM, h)
        if k % 5 == 4:
            rows.append(state)
    assert_golden(np.array(rows), columns(table, "x", "y", "psi", "u", "v", "r"))


def test_linear_derivatives_are_the_printed_matrices_with_the_force_of_the_sea_turned_into_the_body():
    sea = np.array([0.2, -0.3, 0.05])
    turn = rotation(STATE[2])
    acceleration = np.linalg.solve(INERTIA, FORCE + turn.T @ sea - DAMPING @ STATE[3:])
    expected = [*(turn @ STATE[3:]), *acceleration]
    weather = conditions(force=sea[:2], moment=sea[2])
    np.testing.assert_allclose(derivatives(STATE, FORCE, conditions=weather), expected, rtol=1e-13)


def test_erratum_x_g_is_what_the_printed_gains_imply():
    assert INERTIA[1, 2] == pytest.approx(0.0202 / 0.02, abs=0.005)  # K_p = 0.02 M
    assert abs(23.8 * 0.046 - 0.0202 / 0.02) > 0.08


def test_nonlinear_derivatives_are_the_published_matrices():
    u, v, r = STATE[3:]
    inertia = np.array([[25.8, 0.0, 0.0], [0.0, 33.8, 23.8 * 0.046], [0.0, 23.8 * 0.046, 2.76]])
    damping = np.array(
        [
            [0.72253 + 1.32742 * abs(u) + 5.86643 * u * u, 0.0, 0.0],
            [0, 0.88965 + 36.47287 * abs(v) + 0.805 * abs(r), 7.25 + 0.845 * abs(v) + 3.45 * abs(r)],
            [0, -0.0313 - 3.95645 * abs(v) - 0.13 * abs(r), 1.9 - 0.08 * abs(v) + 0.75 * abs(r)],
        ]
    )
    momentum = inertia @ STATE[3:]
    coriolis = np.array([[0.0, 0.0, -momentum[1]], [0.0, 0.0, momentum[0]], [momentum[1], -momentum[0], 0.0]])
    expected = np.linalg.solve(inertia, FORCE - (damping + coriolis) @ STATE[3:])
    np.testing.assert_allclose(derivatives(STATE, FORCE, "nonlinear")[3:], expected, rtol=1e-12)


@pytest.mark.parametrize("identification", ["linear", "nonlinear"])
def test_a_turned_scene_gives_the_turned_way(identification):
    angle, vessel, sea = 1.1, CyberShip2(identification), np.array([0.1, 0.2, 0.0])
    turn = rotation(angle)
    one, other = STATE.copy(), STATE.copy()
    other[:3] = turn @ STATE[:3]
    other[2] = STATE[2] + angle
    for _ in range(50):
        one = vessel.step(one, FORCE, conditions(force=sea[:2]), 0.1)
        other = vessel.step(other, FORCE, conditions(force=(turn @ sea)[:2]), 0.1)
    np.testing.assert_allclose(other[:2], (turn @ one[:3])[:2], atol=1e-12)
    np.testing.assert_allclose(other[3:], one[3:], atol=1e-12)


@pytest.mark.parametrize("identification", ["linear", "nonlinear"])
def test_a_mirrored_scene_gives_the_mirrored_way(identification):
    mirror = np.array([1.0, -1.0, -1.0, 1.0, -1.0, -1.0])
    rates = derivatives(STATE, FORCE, identification)
    np.testing.assert_allclose(derivatives(mirror * STATE, mirror[3:] * FORCE, identification), mirror * rates)


def test_forces_are_held_to_what_she_can_give():
    vessel = CyberShip2()
    least = vessel.step(STATE, (-9.0, 9.0, -9.0), CALM, 0.1)
    np.testing.assert_array_equal(least, vessel.step(STATE, (-2.0, 1.5, -1.5), CALM, 0.1))
    assert [(each.low, each.high) for each in vessel.actuators] == [(-2.0, 2.0), (-1.5, 1.5), (-1.5, 1.5)]


def test_motion_says_what_the_track_does_in_a_current():
    vessel, weather, h = CyberShip2(), conditions(current=(0.1, -0.2)), 1e-4
    state, still = STATE.copy(), (0.0, 0.0, 0.0)
    now, ahead = vessel.motion(state, weather), vessel.motion(vessel.step(state, still, weather, h), weather)
    assert (ahead.north - now.north) / h == pytest.approx(now.north_velocity, rel=1e-3)
    assert (ahead.east - now.east) / h == pytest.approx(now.east_velocity, rel=1e-3)
    assert (ahead.cog - now.cog) / h == pytest.approx(now.course_rate, rel=1e-3)
    assert (now.surge, now.sway) == (0.3, -0.15)


def test_an_unknown_identification_is_named():
    with pytest.raises(InputError, match=r"cybership2\.identification is 'printed'"):
        CyberShip2("printed")
