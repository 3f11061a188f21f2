"""Acceleration as a state: its prediction against matrices, its smoother, and what it is for."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

import steerway
from steerway.core import NORMAL_95, Fixes
from steerway.estimation import Profile, choose_profile
from steerway.estimation.testing import (
    LONGEST_ROLL,
    STATES,
    Posterior,
    Rows,
    infer_log,
    motion_of,
    reset_manoeuvre,
    transition,
)
from steerway.estimation.testing import models_predict as predict
from steerway.estimation.testing import models_set_step as set_step
from tests.scenes import angle_error, sailed, straight

SWELL = Profile(
    speed_noise=1e-4,
    course_rate_noise=1e-4,
    course_rate_decay=0.2,
    acceleration_std=0.3,
    acceleration_time=4.0,
    position_std=0.02,
)


def predicted(x, p, dt, profile=SWELL):
    parameters = profile.parameters()[0]
    step = np.empty((5, int(parameters[STATES])))
    set_step(step, dt, parameters)
    x, p = x.copy(), np.triu(p)
    predict(x, p, step, parameters)
    return x, np.triu(p) + np.triu(p, 1).T


def test_on_a_straight_course_it_is_the_linear_model():
    """North, speed and acceleration by the matrix exponential, noise by Van Loan's method."""
    dt, beta, density = 0.7, 1.0 / 4.0, 2.0 * 0.3**2 / 4.0
    a = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -beta]])
    f = expm(a * dt)
    noise = np.diag([0.0, 1e-4, density])
    block = expm(np.block([[-a, noise], [np.zeros((3, 3)), a.T]]) * dt)
    q = f @ block[:3, 3:]
    rng = np.random.default_rng(1)
    root = rng.normal(size=(3, 3))
    start = root @ root.T
    chosen = np.array([0, 2, 5])
    x, p = np.zeros(6), np.eye(6) * 1e-12
    x[chosen] = 0.0, 3.0, 0.4
    p[np.ix_(chosen, chosen)] = start
    x, p = predicted(x, p, dt)
    np.testing.assert_allclose(x[chosen], f @ [0.0, 3.0, 0.4], rtol=1e-12)
    np.testing.assert_allclose(p[np.ix_(chosen, chosen)], f @ start @ f.T + q, rtol=2e-5, atol=1e-8)


def test_two_half_steps_are_one_step():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(6, 6)) * np.array([1.0, 1.0, 0.3, 0.05, 0.01, 0.1])[:, None]
    x, p = np.array([0.0, 0.0, 4.0, 0.7, 0.01, 0.2]), root @ root.T
    whole = predicted(x, p, 0.4)
    halves = predicted(*predicted(x, p, 0.2), 0.2)
    np.testing.assert_allclose(halves[0], whole[0], rtol=1e-3)
    np.testing.assert_allclose(halves[1], whole[1], rtol=2e-2, atol=2e-4)


def test_the_smoothers_transition_is_the_predictions_jacobian():
    x = np.array([0.0, 0.0, 4.0, 0.7, 0.05, 0.2])
    parameters, step, f = SWELL.parameters()[0], np.empty((5, 6)), np.empty((6, 6))
    set_step(step, 0.5, parameters)
    transition(x, True, step, parameters, f)
    for j in range(6):
        nudge = 1e-6 * np.eye(6)[j]
        slope = (predicted(x + nudge, np.eye(6), 0.5)[0] - predicted(x - nudge, np.eye(6), 0.5)[0]) / 2e-6
        reference = predicted(x, np.eye(6), 0.5)[0]
        assert np.isfinite(reference).all()
        np.testing.assert_allclose(f[:, j], slope, rtol=1e-5, atol=1e-6)


def heaving(seed=0, duration=600.0):
    """A ship at 5 m/s whose speed a swell of ten seconds moves by 0.4 m/s, seen once a second to two centimetres."""
    time = np.arange(round(duration) + 1.0)
    speed = 5.0 + 0.4 * np.sin(2.0 * math.pi * time / 10.0)
    course = 0.7 + 0.03 * np.sin(2.0 * math.pi * time / 11.0)
    return sailed(speed, course, rate=1.0)


def test_in_a_swell_speed_is_known_better():
    scene = heaving()
    fixes = scene.fixes(0.01, 3)
    plain = SWELL.model_copy(update={"acceleration_std": 0.0, "speed_noise": 0.03})
    errors = [steerway.estimate(fixes, each).sog[60:] - scene.sog[60:] for each in (plain, SWELL)]
    assert np.std(errors[1]) < 0.6 * np.std(errors[0])
    smoothed = steerway.estimate(fixes, SWELL, smooth=True)
    assert np.std(smoothed.sog[60:-10] - scene.sog[60:-10]) < 0.6 * np.std(errors[1])


def test_the_swell_is_found_from_the_log():
    likeliest = max(choose_profile(heaving().fixes(0.01, 3)).structures, key=lambda each: each.weight)
    assert "waves" in likeliest.parts and likeliest.values["wave_surge"] > 0.05
    assert likeliest.values["surge_period"] == pytest.approx(10.0, rel=0.01)


def test_strokes_of_oars_are_found_and_no_motion_of_the_receiver():
    time = np.arange(0.0, 300.0, 0.2)
    scene = sailed(4.0 + 0.4 * np.sin(2.0 * math.pi * time / 2.2), 0.7 + 0.1 * np.sin(time / 40.0))
    fixes = scene.fixes(0.05, 3)
    found = infer_log(fixes)
    likeliest = max(found.structures, key=lambda each: each.weight)
    assert "strokes" in likeliest.parts
    assert likeliest.values["stroke_period"] == pytest.approx(2.2, rel=0.01)
    motion = motion_of(fixes, found.structures)
    errors = motion.sog[100:] - scene.sog[100:]
    assert np.sqrt(np.mean(errors**2)) < 0.5 * np.std(scene.sog)
    assert np.mean(np.abs(errors) < NORMAL_95 * motion.sog_std[100:]) > 0.9


def test_beside_an_antenna_that_rolls_a_vessel_yaws_more_slowly():
    """A yaw with the period of the roll and the roll itself move the antenna alike: it is no course of the vessel."""
    rows = Rows(*np.zeros((3, 1)), np.empty(0), np.empty((0, 0)), np.empty(0, int))
    found = {}
    for parts in (("base", "waves"), ("base", "waves", "antenna")):
        posterior = Posterior(parts, rows)
        found[parts] = posterior.values(posterior.point({"yaw_period": 2.8}))["yaw_period"]
    assert list(found.values()) == pytest.approx([2.8, LONGEST_ROLL])


def test_acceleration_is_forgotten_with_the_course():
    """Off, at rest, off again: the smoother crosses both changes of way, also where two fixes bear one time."""
    speed = np.r_[
        np.full(100, 3.0), np.linspace(3.0, 0.0, 20), np.zeros(200), np.linspace(0.0, 3.0, 20), np.full(100, 3.0)
    ]
    scene = sailed(speed, np.full(len(speed), 0.4), rate=1.0)
    fixes = scene.fixes(0.05, 1)
    doubled = fixes.rows(np.sort(np.r_[np.arange(len(fixes)), np.arange(50, 60)]))
    for smooth in (False, True):
        motion = steerway.estimate(doubled, SWELL, smooth=smooth)
        assert np.isfinite(motion.sog[5:]).all()
        assert np.nanmax(angle_error(motion.cog[-80:], 0.4)) < math.radians(5.0)
        assert np.isnan(motion.cog[160:300]).mean() > 0.8


@pytest.mark.parametrize("course", [0.0, 0.8, 2.5])
def test_a_fix_of_uncertain_moment_is_believed_less_along_the_way_only(course):
    scene = straight(8.0, course, 300.0, rate=0.2)
    sure = Profile(speed_noise=1e-3, course_rate_noise=1e-6, position_std=3.0)
    unsure = sure.model_copy(update={"time_std": 2.0})
    late = 8.0 * np.random.default_rng(5).normal(0.0, 2.0, len(scene.time))
    fixes = scene.fixes(3.0, 5, lambda t: (late * math.cos(course), late * math.sin(course)))
    nis = [np.nanmean(steerway.estimate(fixes, each).nis[10:]) for each in (sure, unsure)]
    assert nis[0] > 6.0 and 1.1 < nis[1] < 2.8
    sideways = scene.fixes(3.0, 5, lambda t: (-late * math.sin(course), late * math.cos(course)))
    assert np.nanmean(steerway.estimate(sideways, unsure).nis[10:]) > 6.0


def test_a_reset_leaves_no_correlation_of_the_manoeuvre():
    parameters = SWELL.parameters()[0]
    x, p = np.ones(6), np.triu(np.ones((6, 6)))
    reset_manoeuvre(x, p, parameters)
    assert x[4] == x[5] == 0.0
    assert p[5, 5] == pytest.approx(0.3**2) and p[4, 4] == pytest.approx(SWELL.start_rate_std**2)
    assert (p[:4, 4:] == 0.0).all() and p[4, 5] == 0.0 and (p[:4, :4] == np.triu(np.ones((4, 4)))).all()


@pytest.mark.parametrize("name", ["acceleration_std", "time_std"])
def test_nothing_changes_where_a_profile_has_neither(name):
    fixes = straight(3.0, 1.0, 60.0).fixes(0.3, 1)
    assert isinstance(fixes, Fixes)
    plain = SWELL.model_copy(update={"acceleration_std": 0.0})
    tiny = plain.model_copy(update={name: 1e-9})
    np.testing.assert_allclose(steerway.estimate(fixes, tiny).sog, steerway.estimate(fixes, plain).sog, rtol=1e-9)
