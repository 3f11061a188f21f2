"""A vessel in waves: an acceleration along the course, an oscillation about the course held, and what both are for."""

import math

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

import steerway
from steerway.core import REJECTED, displacement
from steerway.estimation import Profile, choose_profile, predict
from steerway.estimation.testing import advance, model_empty_bank, model_of_profile
from tests.scenes import angle_error, sailed, straight, thinned

SWELL = Profile(
    speed_noise=1e-4,
    course_rate_noise=4e-4,
    course_rate_decay=0.05,
    yawing_period=9.0,
    yawing_time=12.0,
    position_std=0.02,
)
HEAVE = Profile(
    speed_noise=1e-4,
    course_rate_noise=1e-4,
    course_rate_decay=0.2,
    acceleration_std=0.3,
    acceleration_time=4.0,
    position_std=0.02,
)
STIFFNESS, FOLLOWS, DECAY = (2.0 * math.pi / 9.0) ** 2, 1.0 / 12.0, 0.05
DYNAMICS = np.array([[0.0, 1.0, 0.0], [0.0, -DECAY, -STIFFNESS], [0.0, 1.0, -FOLLOWS]])
"""Dynamics of course, course rate and deviation from the course held."""


def predicted(x, p, dt, profile):
    """The kernel's prediction of (x, P)."""
    model = model_of_profile(profile)
    bank = model_empty_bank(model)
    bank.x[0], bank.p[0], bank.run["started"] = x, p, 1
    advance(bank, model, dt)
    return bank.x[0], bank.p[0]


def test_an_oscillation_has_the_poles_of_its_equations_and_the_variance_that_their_noise_keeps():
    (process,) = model_of_profile(SWELL).processes
    poles = np.linalg.eigvals(DYNAMICS[1:, 1:])
    assert complex(-process["decay"], process["frequency"]) == pytest.approx(poles[np.argmax(poles.imag)], rel=1e-12)
    stationary = solve_continuous_lyapunov(DYNAMICS[1:, 1:], -np.diag([4e-4, 0.0]))
    assert process["variance"] == pytest.approx(stationary[1, 1], rel=1e-12)


def test_on_a_straight_course_acceleration_is_the_linear_model():
    """North, speed and acceleration by the matrix exponential, noise by Van Loan's method."""
    dt, beta, density = 0.7, 1.0 / 4.0, 2.0 * 0.3**2 / 4.0
    a = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -beta]])
    f = expm(a * dt)
    noise = np.diag([0.0, 1e-4, density])
    block = expm(np.block([[-a, noise], [np.zeros((3, 3)), a.T]]) * dt)
    q = f @ block[:3, 3:]
    root = np.random.default_rng(1).normal(size=(3, 3))
    start = root @ root.T
    chosen = np.array([0, 2, 5])
    x, p = np.zeros(6), np.eye(6) * 1e-12
    x[chosen] = 0.0, 3.0, 0.4
    p[np.ix_(chosen, chosen)] = start
    x, p = predicted(x, p, dt, HEAVE)
    np.testing.assert_allclose(x[chosen], f @ [0.0, 3.0, 0.4], rtol=1e-12)
    np.testing.assert_allclose(p[np.ix_(chosen, chosen)], f @ start @ f.T + q, rtol=2e-5, atol=1e-8)


def swinging(duration=600.0, seed=0, blow=0.0):
    """A ship at 5 m/s that a sea swings about a course by some degrees, once a second; at 250 s a blow to her rate."""
    chance = np.random.default_rng(seed)
    step = 0.05
    kick, rate, course = 0.02 * math.sqrt(step) * chance.normal(size=round(duration / step) + 1), 0.0, 0.0
    kick[round(250.0 / step)] += blow
    courses = []
    for each in kick:
        rate += each - step * (STIFFNESS * course + 0.1 * rate)
        course += step * rate
        courses.append(course)
    return thinned(sailed(5.0, 0.7 + np.array(courses), 1.0 / step), round(1.0 / step))


def test_in_a_sea_the_course_is_known_better():
    without = SWELL.model_copy(update={"yawing_period": 0.0, "course_rate_noise": 2e-3, "course_rate_decay": 0.5})
    errors = {}
    for seed in range(2):
        scene = swinging(seed=seed)
        for name, profile in (("plain", without), ("oscillating", SWELL)):
            for smooth in (False, True):
                motion = steerway.estimate(scene.fixes(0.01, seed), profile, smooth=smooth)
                errors.setdefault((name, smooth), []).extend(angle_error(motion.cog[60:], scene.cog[60:]))
    rms = {key: math.sqrt(np.mean(np.square(each))) for key, each in errors.items()}
    assert rms["oscillating", False] < 0.9 * rms["plain", False]
    assert rms["oscillating", True] < 0.7 * rms["oscillating", False]


def heaving():
    """A ship at 5 m/s whose speed a swell of ten seconds moves by 0.4 m/s, seen once a second to two centimetres."""
    time = np.arange(401.0)
    speed = 5.0 + 0.4 * np.sin(2.0 * math.pi * time / 10.0)
    course = 0.7 + 0.03 * np.sin(2.0 * math.pi * time / 11.0)
    return sailed(speed, course, rate=1.0)


def test_in_a_swell_speed_is_known_better():
    scene = heaving()
    fixes = scene.fixes(0.01, 3)
    plain = HEAVE.model_copy(update={"acceleration_std": 0.0, "speed_noise": 0.03})
    errors = [steerway.estimate(fixes, each, causal=True).sog[60:] - scene.sog[60:] for each in (plain, HEAVE)]
    assert np.std(errors[1]) < 0.6 * np.std(errors[0])
    smoothed = steerway.estimate(fixes, HEAVE, smooth=True)
    assert np.std(smoothed.sog[60:-10] - scene.sog[60:-10]) < 0.6 * np.std(errors[1])


def test_the_swell_is_found_from_the_log():
    found = max(choose_profile(heaving().fixes(0.01, 3)).structures, key=lambda each: each.weight)
    assert "waves" in found.parts and found.values["wave_surge"] > 0.05
    assert found.values["surge_period"] == pytest.approx(10.0, rel=0.01)


def test_an_irregular_wave_is_accepted_and_a_jump_is_not():
    """A wave beyond the gate of a profile that knows no waves; and a fix ten metres off."""
    profile = SWELL.model_copy(update={"position_std": 0.005})
    struck = swinging(seed=5, blow=0.2).fixes(0.005, 5)
    assert np.nanmax(steerway.estimate(struck, profile, causal=True).nis) > 13.8
    assert (steerway.estimate(struck, profile, causal=True).status != REJECTED).all()
    jumped = swinging(seed=5).fixes(0.005, 5, lambda t: (10.0 * (np.abs(t - 250.0) < 0.5), 0.0 * t))
    assert (np.flatnonzero(steerway.estimate(jumped, profile, causal=True).status == REJECTED) == [250]).all()


def test_a_forecast_goes_on_along_the_course_held():
    """Whatever the sea does to the course at the moment of the last fix."""
    scene = swinging(duration=300.0)
    off = []
    for last in range(200, 301, 4):
        there = predict(scene.fixes(0.01, 3).rows(slice(0, last)), 60.0, SWELL)
        north, east = displacement(there.latitude[0], there.longitude[0], *scene.place(last - 1))
        off.append(math.atan2(east, north) - 0.7)
    assert np.sqrt(np.mean(np.square(off))) < 0.5 * np.std(scene.cog[200:])


def test_a_fix_of_uncertain_moment_is_believed_less_along_the_way_only():
    course = 0.8
    scene = straight(8.0, course, 300.0, rate=0.2)
    sure = Profile(speed_noise=1e-3, course_rate_noise=1e-6, position_std=3.0)
    unsure = sure.model_copy(update={"time_std": 2.0})
    late = 8.0 * np.random.default_rng(5).normal(0.0, 2.0, len(scene.time))
    fixes = scene.fixes(3.0, 5, lambda t: (late * math.cos(course), late * math.sin(course)))
    nis = [np.nanmean(steerway.estimate(fixes, each, causal=True).nis[10:]) for each in (sure, unsure)]
    assert nis[0] > 6.0 and 1.1 < nis[1] < 2.8
    sideways = scene.fixes(3.0, 5, lambda t: (-late * math.sin(course), late * math.cos(course)))
    assert np.nanmean(steerway.estimate(sideways, unsure, causal=True).nis[10:]) > 6.0
