"""The steps of the course filter against matrices written out: fixes with error states, low speed, changes of phase."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from steerway import Profile
from steerway.estimation.testing import (
    ACCELERATION_STATE,
    COURSE_GAINED,
    COURSE_LOST,
    EXTRAS,
    FIRST,
    KNOWN_VELOCITY_STD,
    LOST_COURSE_VARIANCE,
    LOW_SPEED,
    PHASE,
    POSITION_VARIANCE,
    SPEED_DECAY,
    SPEED_NOISE,
    START_RATE_VARIANCE,
    START_SPEED_VARIANCE,
    STARTING,
    STEERAGEWAY,
    UNDER_WAY,
    correct,
    course_to_velocity,
    fold,
    innovation,
    low_speed,
    normalised_square,
    place_by_fix,
    reset_manoeuvre,
    set_position,
    update_phase,
    velocity_to_course,
)
from steerway.estimation.testing import five_state_set_step as set_step
from steerway.estimation.testing import steerageway_start as start
from tests.five_state_by_matrices import covariance_of_noise

PLAIN = Profile(speed_noise=2e-2, course_rate_noise=3e-3, speed_decay=0.05, course_rate_decay=0.3, position_std=0.2)
PAIRS = (0, 1, 2)


def profile_with(pairs: int) -> Profile:
    changes = ({}, {"error_std": 0.7, "error_time": 20.0}, {"error_std": 0.7, "drift_std": 0.4})[pairs]
    return PLAIN.model_copy(update=changes)


def state(seed: int, n: int):
    """(x, P) with P whole, and every correlation."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=n)
    x[2:5] = rng.uniform(1.0, 4.0), rng.uniform(-3.0, 3.0), rng.uniform(-0.2, 0.2)
    root = rng.normal(size=(n, n)) * rng.uniform(0.2, 1.0, n)[:, None]
    return x, root @ root.T + 0.1 * np.eye(n)


def upper(p):
    """P as the filter keeps it: what lies below the diagonal is no part of it."""
    kept = np.triu(p)
    kept[np.tril_indices(len(p), -1)] = 1e3
    return kept


def assert_covariance(kept, expected):
    assert_allclose(np.triu(kept), np.triu(expected), rtol=1e-9, atol=1e-9)


def measures(n, pairs):
    c = np.zeros((2, n))
    c[0, 0] = c[1, 1] = 1.0
    for k in range(pairs):
        c[0, 5 + 2 * k] = c[1, 6 + 2 * k] = 1.0
    return c


@pytest.mark.parametrize("pairs", PAIRS)
def test_a_fix_with_error_states(pairs):
    n = 5 + 2 * pairs + 1  # and a state that no fix measures
    x, p = state(0, n)
    c, noise, fix = measures(n, pairs), np.diag([0.3, 0.7]), np.array([2.0, -1.0])
    s, nu = c @ p @ c.T + noise, fix - c @ x
    g = 5 if pairs else 0
    kept, x_after = upper(p), x.copy()
    parts = innovation(x, kept, *fix, 0.3, 0.7, g, max(pairs, 1))
    assert_allclose(parts, [*nu, s[0, 0], s[0, 1], s[1, 1]], rtol=1e-10)
    assert normalised_square(*parts) == pytest.approx(nu @ np.linalg.inv(s) @ nu, rel=1e-9)
    correct(x_after, kept, np.empty((4, n)), *parts, g, max(pairs, 1))
    gain = p @ c.T @ np.linalg.inv(s)
    assert_allclose(x_after, x + gain @ nu, rtol=1e-9)
    rest = np.eye(n) - gain @ c
    assert_covariance(kept, rest @ p @ rest.T + gain @ noise @ gain.T)


@pytest.mark.parametrize("pairs", PAIRS)
def test_a_position_set_to_a_fix_is_the_fix_less_the_error_states(pairs):
    n = 5 + 2 * pairs + 1
    _, p = state(3, n)
    move = np.eye(n)
    move[:2, :2] = 0.0
    for k in range(pairs):
        move[0, 5 + 2 * k] = move[1, 6 + 2 * k] = -1.0
    expected = move @ p @ move.T + np.diag([0.3, 0.7, *np.zeros(n - 2)])
    kept = upper(p)
    place_by_fix(kept, 0.3, 0.7, 5 if pairs else 0, max(pairs, 1))
    assert_covariance(kept, expected)


@pytest.mark.parametrize("pairs", PAIRS)
def test_start_and_a_new_position(pairs):
    parameters = profile_with(pairs).parameters()[0]
    n, scale = 5 + 2 * pairs, 4.0
    x, p, flags = np.full(n, 9.0), np.full((n, n), 9.0), np.zeros(5)
    start(x, p, flags, 3.0, -4.0, scale, parameters)
    extras = [parameters[EXTRAS + 3 * k + 2] for k in range(2 * pairs)]
    assert flags[PHASE] == FIRST and x.tolist() == [3.0, -4.0, *np.zeros(n - 2)]
    assert all(extra > 0.0 for extra in extras)
    variance = scale * parameters[POSITION_VARIANCE]
    expected = np.diag([0.0, 0.0, *[parameters[START_SPEED_VARIANCE]] * 2, parameters[START_RATE_VARIANCE], *extras])
    move = np.eye(n)
    for k in range(pairs):
        move[0, 5 + 2 * k] = move[1, 6 + 2 * k] = -1.0
    assert_covariance(p, move @ expected @ move.T + np.diag([variance, variance, *np.zeros(n - 2)]))
    x[5:] = np.arange(1.0, n - 4)
    set_position(x, p, 30.0, 40.0, 1.0, parameters)
    assert_allclose(x[:2], [30.0 - x[5::2].sum(), 40.0 - x[6::2].sum()])


@pytest.mark.parametrize("dt", [0.2, 3.0])
@pytest.mark.parametrize("pairs", PAIRS)
def test_low_speed_is_a_random_walk_of_velocity(dt, pairs):
    parameters = profile_with(pairs).parameters()[0]
    n = 5 + 2 * pairs
    x, p = state(5, n)
    p[:4, 4] = p[4, :4] = 0.0  # at low speed the course rate is independent of the motion
    step = np.zeros((3, n))
    set_step(step, dt, parameters)
    decay = parameters[SPEED_DECAY]
    left, integral = math.exp(-decay * dt), (1.0 - math.exp(-decay * dt)) / decay
    density = parameters[SPEED_NOISE] + parameters[STEERAGEWAY] ** 2 / low_speed.SPEED_UP_TIME
    f, q = np.eye(n), np.zeros((n, n))
    for axis in range(2):
        f[axis, 2 + axis], f[2 + axis, 2 + axis] = integral, left
        gathered = density * covariance_of_noise(decay, dt)
        q[axis, axis], q[2 + axis, 2 + axis] = gathered[1, 1], gathered[0, 0]
        q[axis, 2 + axis] = q[2 + axis, axis] = gathered[0, 1]
    for k in range(5, n):
        std, time = ((0.7, 20.0) if pairs == 1 or k < 7 else (0.4, 600.0)) if pairs < 2 else EXTRA[k]
        f[k, k] = math.exp(-dt / time)
        q[k, k] = std**2 * (1.0 - f[k, k] ** 2)
    kept, x_after = upper(p), x.copy()
    low_speed.predict(x_after, kept, step, parameters)
    assert_allclose(x_after, f @ x, rtol=1e-9)
    assert_covariance(kept, f @ p @ f.T + q)


EXTRA = {5: (0.7, 60.0), 6: (0.7, 60.0), 7: (0.4, 600.0), 8: (0.4, 600.0)}


def jacobian(function, x):
    columns = []
    for k in range(len(x)):
        ahead, behind = x.copy(), x.copy()
        ahead[k], behind[k] = ahead[k] + 1e-6, behind[k] - 1e-6
        columns.append((function(ahead) - function(behind)) / 2e-6)
    return np.array(columns).T


@pytest.mark.parametrize("change", [velocity_to_course, course_to_velocity])
@pytest.mark.parametrize("seed", range(3))
def test_a_change_of_state_carries_the_covariance_by_its_jacobian(change, seed):
    x, p = state(seed, 7)
    if change is velocity_to_course:
        x[2:4] = [(1.5, -2.0), (-0.8, 0.4), (2.0, 0.1)][seed]

    def changed(given):
        out = given.copy()
        change(out, np.zeros((7, 7)))
        return out

    j = jacobian(changed, x)
    kept, after = upper(p), x.copy()
    change(after, kept)
    speed, course = (math.hypot(*x[2:4]), math.atan2(x[3], x[2])) if change is velocity_to_course else x[2:4]
    assert_allclose(after[2:4], (speed, course) if change is velocity_to_course else speed * np.array(
        [math.cos(course), math.sin(course)]), rtol=1e-12)  # fmt: skip
    assert_allclose(np.triu(kept), np.triu(j @ p @ j.T), rtol=1e-6, atol=1e-6)


def test_a_folded_speed_turns_its_correlations():
    for speed in (-2.0, 2.0):
        x, p = state(7, 7)
        x[2], x[3] = speed, 3.0
        sign = np.eye(7)
        sign[2, 2] = math.copysign(1.0, speed)
        kept = upper(p)
        fold(x, kept)
        assert_allclose(x[2:4], [2.0, 3.0 - math.pi if speed < 0.0 else 3.0])
        assert_covariance(kept, sign @ p @ sign)


PARAMETERS = PLAIN.parameters()[0]


def phase_after(phase, velocity, variance, course_variance=0.1, parameters=PARAMETERS):
    """(phase, x, P) after a change of phase of a state with (v_N, v_E) or (U, χ)."""
    x, p, flags = np.array([0.0, 0.0, *velocity, 0.15]), np.diag([1.0, 1.0, variance, variance, 0.02]), np.zeros(5)
    if phase == UNDER_WAY:
        p[3, 3] = course_variance
    p[0, 4], p[2, 4] = 0.05, 0.01
    flags[PHASE] = phase
    update_phase(x, p, flags, parameters)
    return flags[PHASE], x, p


def test_the_start_waits_for_a_third_fix():
    diffuse = PARAMETERS[START_SPEED_VARIANCE]
    assert phase_after(FIRST, (9.0, 0.0), 0.51 * diffuse)[0] == FIRST
    assert phase_after(FIRST, (9.0, 0.0), 0.49 * diffuse)[0] == STARTING


@pytest.mark.parametrize("phase", [STARTING, LOW_SPEED])
def test_course_is_gained_at_four_deviations_and_at_steerageway(phase):
    steerageway = PARAMETERS[STEERAGEWAY]
    for direction in ((1.0, 0.0), (0.0, -1.0), (-0.6, 0.8)):
        for std in (1.3 * steerageway / COURSE_GAINED, 0.5 * steerageway / COURSE_GAINED):
            needed = max(COURSE_GAINED * std, steerageway)
            for share, expected in ((0.98, False), (1.02, True)):
                velocity = share * needed * np.array(direction)
                after, x, p = phase_after(phase, velocity, std**2)
                assert (after == UNDER_WAY) == expected
                if expected:
                    assert_allclose(x[2:], [share * needed, math.atan2(velocity[1], velocity[0]), 0.0], atol=1e-12)
                    assert p[4, 4] == PARAMETERS[START_RATE_VARIANCE] and not p[:4, 4].any()
                else:
                    assert_allclose(x[2:], [*velocity, 0.15])


def test_the_start_ends_at_low_speed_when_the_velocity_is_known():
    for share, expected in ((1.02, STARTING), (0.98, LOW_SPEED)):
        assert phase_after(STARTING, (0.01, 0.0), (share * KNOWN_VELOCITY_STD) ** 2)[0] == expected


def test_course_is_lost_at_two_deviations_or_half_of_steerageway():
    steerageway = PARAMETERS[STEERAGEWAY]
    for std in (2.0 * steerageway, 0.1 * steerageway):
        limit = max(COURSE_LOST * std, 0.5 * steerageway)
        assert phase_after(UNDER_WAY, (1.02 * limit, 0.5), std**2)[0] == UNDER_WAY
        after, x, p = phase_after(UNDER_WAY, (0.98 * limit, 0.5), std**2)
        assert after == LOW_SPEED
        assert_allclose(x[2:], [0.98 * limit * math.cos(0.5), 0.98 * limit * math.sin(0.5), 0.0], atol=1e-12)
        assert p[4, 4] == PARAMETERS[START_RATE_VARIANCE] and not p[:4, 4].any()
        assert max(p[2, 2], p[3, 3]) < PARAMETERS[START_SPEED_VARIANCE]


def test_a_course_beyond_a_radian_is_lost_with_its_velocity():
    assert phase_after(UNDER_WAY, (5.0, 0.5), 0.01, 0.98 * LOST_COURSE_VARIANCE)[0] == UNDER_WAY
    after, x, p = phase_after(UNDER_WAY, (5.0, 0.5), 0.01, 1.02 * LOST_COURSE_VARIANCE)
    assert after == LOW_SPEED and p[2, 2] == p[3, 3] == PARAMETERS[START_SPEED_VARIANCE]
    assert p[2, 3] == 0.0 and not p[:2, 2:4].any() and not p[2:4, 4].any()
    assert_allclose(x[2:4], [5.0 * math.cos(0.5), 5.0 * math.sin(0.5)])


def test_acceleration_begins_anew_with_its_own_variance_when_the_phase_changes():
    parameters = profile_with(1).model_copy(update={"acceleration_std": 0.3, "acceleration_time": 5.0}).parameters()[0]
    k = int(parameters[ACCELERATION_STATE])
    assert k >= 5
    x, p = state(9, 8)
    reset_manoeuvre(x, p, parameters)
    assert x[k] == x[4] == 0.0 and p[k, k] == pytest.approx(0.3**2) and p[4, 4] == parameters[START_RATE_VARIANCE]
    assert not p[:k, k].any() and not p[k, k + 1 :].any()
