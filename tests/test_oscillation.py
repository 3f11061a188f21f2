"""Oscillation about a course held: its prediction against matrices, its smoother, and what it is for."""

import math

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

import steerway
from steerway.core import REJECTED, InputError
from steerway.estimation import Profile, choose_profile
from steerway.estimation.testing import (
    EXTRAS,
    GATE,
    OSCILLATION_STATE,
    OUTLIER_NLL,
    PHASE,
    STATES,
    UNDER_WAY,
    run_rows,
    transition,
)
from steerway.estimation.testing import forecast_forecast as forecast
from steerway.estimation.testing import layout_empty_bank as empty_bank
from steerway.estimation.testing import models_predict as predict
from steerway.estimation.testing import models_set_step as set_step
from tests.scenes import Scene, angle_error, sailed

SWELL = Profile(
    speed_noise=1e-4,
    course_rate_noise=4e-4,
    course_rate_decay=0.05,
    yawing_period=9.0,
    yawing_time=12.0,
    position_std=0.02,
)
STIFFNESS, FOLLOWS, DECAY = (2.0 * math.pi / 9.0) ** 2, 1.0 / 12.0, 0.05
DYNAMICS = np.array([[0.0, 1.0, 0.0], [0.0, -DECAY, -STIFFNESS], [0.0, 1.0, -FOLLOWS]])
"""Of course, course rate and deviation from the course held."""
CHOSEN = np.array([3, 4, 5])


def predicted(x, p, dt, steps=1, profile=SWELL):
    parameters = profile.parameters()[0]
    step = np.empty((5, int(parameters[STATES])))
    set_step(step, dt / steps, parameters)
    x, p = x.copy(), np.triu(p)
    for _ in range(steps):
        predict(x, p, step, parameters)
    return x, np.triu(p) + np.triu(p, 1).T


def spread(seed=1, states=6):
    root = np.random.default_rng(seed).normal(size=(states, states)) * 0.1
    return root @ root.T


def test_course_rate_and_deviation_are_the_linear_model():
    """By the matrix exponential, noise by Van Loan's method; a second in steps short beside the period."""
    start, x0 = spread(states=3), np.array([0.3, 0.1, -0.05])
    f = expm(DYNAMICS)
    block = expm(np.block([[-DYNAMICS, np.diag([0.0, 4e-4, 0.0])], [np.zeros((3, 3)), DYNAMICS.T]]))
    x, p = np.zeros(6), np.zeros((6, 6))
    x[CHOSEN], p[np.ix_(CHOSEN, CHOSEN)] = x0, start
    for steps, tolerance in ((2, 3e-2), (50, 5e-5)):
        at, covariance = predicted(x, p, 1.0, steps)
        np.testing.assert_allclose(at[CHOSEN], f @ x0, rtol=tolerance, atol=0.1 * tolerance)
        expected = f @ start @ f.T + f @ block[:3, 3:]
        np.testing.assert_allclose(covariance[np.ix_(CHOSEN, CHOSEN)], expected, rtol=tolerance, atol=0.1 * tolerance)


def test_it_swings_with_its_period_whatever_the_step():
    undamped = SWELL.model_copy(update={"yawing_time": 1e9, "course_rate_decay": 0.0})
    for dt in (0.05, 0.5, 1.0):
        x = np.array([0.0, 0.0, 5.0, 0.7, 0.0, 0.1])
        x, _ = predicted(x, np.eye(6), 18.0, round(18.0 / dt), undamped)
        np.testing.assert_allclose(x[CHOSEN], [0.7, 0.0, 0.1], atol=1e-6)


def test_noise_keeps_the_variances_from_which_it_begins():
    parameters = SWELL.parameters()[0]
    stationary = solve_continuous_lyapunov(DYNAMICS[1:, 1:], -np.diag([4e-4, 0.0]))
    d = int(parameters[OSCILLATION_STATE])
    assert d == 5 and SWELL.start_rate_std == pytest.approx(math.sqrt(stationary[0, 0]))
    assert parameters[EXTRAS + 2] == pytest.approx(stationary[1, 1])
    p = np.zeros((6, 6))
    p[4:, 4:] = stationary
    _, later = predicted(np.zeros(6), p, 100.0, 1000)
    np.testing.assert_allclose(later[4:, 4:], stationary, rtol=1e-3, atol=1e-6)


def test_the_smoothers_transition_is_the_predictions_jacobian():
    profile = SWELL.model_copy(update={"acceleration_std": 0.3})
    x = np.array([0.0, 0.0, 4.0, 0.7, 0.05, 0.2, 0.1])
    parameters, step, f = profile.parameters()[0], np.empty((5, 7)), np.empty((7, 7))
    set_step(step, 0.5, parameters)
    transition(x, True, step, parameters, f)
    for j in range(7):
        nudge = 1e-6 * np.eye(7)[j]
        ahead, behind = (predicted(x + sign * nudge, np.eye(7), 0.5, 1, profile)[0] for sign in (1.0, -1.0))
        np.testing.assert_allclose(f[:, j], (ahead - behind) / 2e-6, rtol=1e-5, atol=1e-6)


def swinging(period=9.0, duration=600.0, seed=0, heave=0.0, blow=0.0):
    """A ship at 5 m/s that a sea swings about a course by some degrees, once a second; at 250 s a blow to her rate."""
    chance = np.random.default_rng(seed)
    step = 0.05
    kick, rate, course = 0.02 * math.sqrt(step) * chance.normal(size=round(duration / step) + 1), 0.0, 0.0
    kick[round(250.0 / step)] += blow
    courses = []
    for each in kick:
        rate += each - step * ((2.0 * math.pi / period) ** 2 * course + 0.1 * rate)
        course += step * rate
        courses.append(course)
    speed = 5.0 + heave * np.sin(2.0 * math.pi * step * np.arange(len(courses)) / 10.0)
    return once_a_second(speed, 0.7 + np.array(courses), 1.0 / step)


def once_a_second(sog, cog, rate):
    """A finely sailed scene, seen once a second."""
    fine = sailed(sog, cog, rate=rate)
    return Scene(*(getattr(fine, name)[:: round(rate)] for name in ("time", "north", "east", "sog", "cog")))


def test_in_a_sea_the_course_is_known_better():
    without = SWELL.model_copy(update={"yawing_period": 0.0, "course_rate_noise": 2e-3, "course_rate_decay": 0.5})
    errors = {}
    for seed in range(4):
        scene = swinging(seed=seed)
        for name, profile in (("plain", without), ("oscillating", SWELL)):
            for smooth in (False, True):
                motion = steerway.estimate(scene.fixes(0.01, seed), profile, smooth=smooth)
                errors.setdefault((name, smooth), []).extend(angle_error(motion.cog[60:], scene.cog[60:]))
    rms = {key: math.sqrt(np.mean(np.square(each))) for key, each in errors.items()}
    assert rms["oscillating", False] < 0.9 * rms["plain", False]
    assert rms["oscillating", True] < 0.7 * rms["oscillating", False]


def likeliest(fixes):
    return max(choose_profile(fixes).structures, key=lambda each: each.weight)


def test_the_inference_finds_who_swings_and_who_does_not():
    found = likeliest(swinging(period=11.0).fixes(0.01, 3))
    assert "waves" in found.parts and 9.0 < found.values["yaw_period"] < 14.0
    scene = once_a_second(np.full(6000, 5.0), 0.7 + np.cumsum(np.random.default_rng(2).normal(0.0, 1e-4, 6000)), 10.0)
    assert "waves" not in likeliest(scene.fixes(0.3, 3)).parts


def test_a_wandering_receiver_is_not_taken_for_swings():
    chance, wander = np.random.default_rng(4), np.zeros((900, 2))
    for k in range(1, 900):
        wander[k] = 0.9 * wander[k - 1] + 0.2 * chance.normal(size=2)
    scene = once_a_second(np.full(9000, 5.0), np.linspace(0.0, 2.0, 9000), 10.0)
    found = likeliest(scene.fixes(0.05, 3, lambda time: wander[: len(time)].T))
    assert "waves" not in found.parts
    assert found.values["error_std"] > 0.1


def test_an_irregular_wave_is_accepted_and_a_jump_is_not():
    """A wave beyond the gate of 13.8; and a fix ten metres off."""
    profile = SWELL.model_copy(update={"position_std": 0.005})
    struck = swinging(seed=5, blow=0.15).fixes(0.005, 5)
    strict = profile.parameters()
    strict[0, OUTLIER_NLL] = -math.inf
    assert np.nanmax(run_rows(strict, (), struck).nis) > strict[0, GATE]
    assert (steerway.estimate(struck, profile).status != REJECTED).all()
    jumped = swinging(seed=5).fixes(0.005, 5, lambda t: (10.0 * (np.abs(t - 250.0) < 0.5), 0.0 * t))
    assert (np.flatnonzero(steerway.estimate(jumped, profile).status == REJECTED) == [250]).all()
    assert profile.model_copy(update={"yawing_period": 0.0}).parameters()[0, OUTLIER_NLL] == -math.inf


def test_the_rate_of_output_changes_nothing():
    scene = swinging()
    fixes = scene.fixes(0.01, 3)
    for smooth in (False, True):
        own = steerway.estimate(fixes, SWELL, smooth=smooth)
        dense = steerway.estimate(fixes, SWELL, rate=2.0, smooth=smooth)
        again = dense.rows(np.isin(dense.time, own.time))
        np.testing.assert_allclose(again.cog, own.cog, atol=1e-6)


def test_it_is_forgotten_at_rest():
    time = np.arange(0.0, 509.0, 0.1)
    speed = np.interp(time, [200.0, 230.0, 380.0, 410.0], [5.0, 0.0, 0.0, 5.0])
    profile = SWELL.model_copy(update={"acceleration_std": 0.2})
    scene = once_a_second(speed, 0.4 + 0.05 * np.sin(time / 1.4), 10.0)
    for smooth in (False, True):
        motion = steerway.estimate(scene.fixes(0.05, 1), profile, smooth=smooth)
        assert np.isfinite(motion.sog[5:]).all()
        assert np.nanmax(np.abs(angle_error(motion.cog[-80:], scene.cog[-80:]))) < math.radians(6.0)
        assert np.isnan(motion.cog[260:370]).mean() > 0.8


def test_a_forecast_goes_on_along_the_course_held():
    parameters = SWELL.parameters()
    block = empty_bank(parameters)[0]
    n = block.shape[1]
    block[n, 2:6] = 5.0, 0.7, 0.02, 0.1
    block[:n] = np.diag([1e-2, 1e-2, 1e-3, 1e-4, 1e-4, 1e-4])
    block[n + 1, PHASE] = UNDER_WAY
    north, east, nn, _, ee = forecast(block, parameters[0], 60.0)
    assert math.atan2(east, north) == pytest.approx(0.6, abs=1e-3)
    # Monte Carlo of the linear model: how far the course leads her astray across in a minute
    chance = np.random.default_rng(5)
    step, x = 0.1, np.zeros((4000, 3))
    x[:, 0], x[:, 1], x[:, 2] = 0.7 + 0.01 * chance.normal(size=(4000)), 0.02, 0.1
    x[:, 1:] += 0.01 * chance.normal(size=(4000, 2))
    f, way = expm(DYNAMICS * step), np.zeros((4000, 2))
    for _ in range(600):
        x = x @ f.T
        x[:, 1] += math.sqrt(4e-4 * step) * chance.normal(size=4000)
        way += 5.0 * step * np.column_stack([np.cos(x[:, 0]), np.sin(x[:, 0])])
    across = way @ [-math.sin(0.6), math.cos(0.6)]
    predicted_across = nn * math.sin(0.6) ** 2 + ee * math.cos(0.6) ** 2
    assert 0.6 * np.std(across) < math.sqrt(predicted_across) < 1.7 * np.std(across)


@pytest.mark.parametrize(
    ("update", "word"),
    [
        ({"yawing_period": 1.0}, "at least"),
        ({"turn_time": 10.0, "straight_time": 40.0, "turn_speed_noise": 1e-3}, "one"),
    ],
)
def test_what_it_cannot_be_is_refused(tmp_path, update, word):
    profile = SWELL.model_copy(update={"turn_course_rate_noise": 1e-3, **update})
    profile.save(tmp_path / "swell.toml")
    with pytest.raises(InputError, match=word):
        Profile.load(tmp_path / "swell.toml")
