"""P2's earth-fixed form: where it is right, and each of its errata."""

import numpy as np
import pytest

from steerway.vessels import CYBERSHIP2_DAMPING as DAMPING
from steerway.vessels import CYBERSHIP2_INERTIA as INERTIA
from steerway.vessels import CyberShip2, conditions
from steerway_studies.testing import positioning as printed

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


@pytest.mark.parametrize("compass, speed, rank", [(False, 0.0, 5), (True, 0.0, 6)])
def test_erratum_13_at_rest_positions_alone_do_not_show_the_heading(compass, speed, rank):
    at_rest = np.zeros(6)
    a = printed.linearised(at_rest, np.zeros(3), INERTIA, DAMPING)
    c = printed.observed(compass)
    rows = [c @ np.linalg.matrix_power(a, k) for k in range(6)]
    assert np.linalg.matrix_rank(np.vstack(rows), 1e-6) == rank
