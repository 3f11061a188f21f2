"""The smoother by hypotheses of the past and of the future: its integral, its limits, and what may not harm it."""

import math
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core import Fixes, wrap
from steerway.estimation import FiveStateFilter, Profile
from steerway.estimation.testing import log_mean_likelihood
from steerway.sensors import Gnss
from steerway_studies.testing import CELLS, TROUBLES, bounded, over_runs, smoothing_bound
from steerway_studies.testing import cells_judged as judged

O05 = CELLS["o05"]


def error_of(motion, voyage):
    """(3, n) errors of SOG, COG and course rate after the first half minute."""
    settled = voyage.time > 30.0
    errors = (
        motion.sog - voyage.sog,
        [wrap(d) for d in motion.cog - voyage.cog],
        motion.course_rate - voyage.course_rate,
    )
    return np.array(errors)[:, settled]


def rms(errors):
    return np.sqrt(np.mean(np.square(errors), axis=1))


@pytest.mark.parametrize("n", [1, 5, 9])
def test_agreement_is_the_integral_it_says(n):
    chance = np.random.default_rng(n)
    root, half = np.tril(chance.standard_normal((n, n))), chance.standard_normal((n, n))
    information, gradient = half @ half.T, chance.standard_normal(n)
    seen, lower, u = np.empty((n, n)), np.zeros((n, n)), np.empty(n)
    found = log_mean_likelihood(root, information, gradient, seen, lower, u)
    posterior = np.linalg.inv(np.linalg.inv(root @ root.T) + information)
    volume = np.linalg.slogdet(np.eye(n) + root @ root.T @ information)[1]
    assert found == pytest.approx(0.5 * (gradient @ posterior @ gradient - volume), rel=1e-7)
    back = root @ np.linalg.inv(np.tril(lower)).T
    np.testing.assert_allclose(back @ u, posterior @ gradient, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(back @ back.T, posterior, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("extra", [{}, {"error_std": 0.05, "error_time": 20.0, "drift_std": 0.1}])
@pytest.mark.parametrize("lasting", [0.0, 0.05])
def test_of_two_models_alike_it_is_the_plain_smoother(extra, lasting):
    """Whatever the histories are worth, all say the same: Rauch, Tung and Striebel must come out, deviations too."""
    voyage, _ = O05.sailed(3)
    fixes = voyage.fixes(Gnss(white=0.02), 3)
    fixes = fixes.rows(np.flatnonzero((voyage.time < 120.0) & ((voyage.time < 40.0) | (voyage.time > 42.0))))
    noise = {"speed_noise": 1e-3, "course_rate_noise": 5e-3, "course_rate_decay": 0.2}
    one = Profile(position_std=0.02, acceleration_std=lasting, **noise, **extra)
    twice = {f"turn_{name}": value for name, value in noise.items()}
    two = one.model_copy(update=twice | {"turn_time": 10.0, "straight_time": 40.0})
    plain, ours = (FiveStateFilter(profile).smooth(fixes) for profile in (one, two))
    known = np.isfinite(plain.cog) & np.isfinite(ours.cog)
    assert known.sum() > 0.9 * len(fixes)
    for name in ("sog", "cog", "course_rate"):
        std = getattr(plain, f"{name}_std")[known]
        apart = getattr(ours, name)[known] - getattr(plain, name)[known]
        assert np.max(np.abs([wrap(d) for d in apart] if name == "cog" else apart) / std) < 0.3, name
        np.testing.assert_allclose(getattr(ours, f"{name}_std")[known], std, rtol=0.1)
    np.testing.assert_allclose(ours.position_std[known], plain.position_std[known], rtol=0.02)


@pytest.mark.parametrize(("name", "straight", "turn"), [("o05", 1.45, 1.25), ("o25", 1.8, 1.3), ("m25", 1.15, 1.1)])
def test_course_is_as_well_known_as_all_histories_together_know_it(name, straight, turn):
    """The ratio of a walk over all histories: 1.31 and 1.58 straight in O, 1.11 and 1.16 in turns."""
    cell = CELLS[name]
    rows = []
    for seed in range(20 if name.startswith("o") else 3):
        voyage, fixes = cell.sailed(seed)
        motion = steerway.estimate(fixes, cell.profile, smooth=True)
        bound = bounded(smoothing_bound(voyage, cell.profile), voyage, cell.scenario)
        rows.append((judged(motion, voyage, cell.scenario), bound))
    rows = np.array(rows)
    assert over_runs(rows[:, 0, 0, 1], rows[:, 1, 0, 1]).value < straight
    assert over_runs(rows[:, 0, 1, 1], rows[:, 1, 1, 1]).value < turn


def test_seen_backwards_it_finds_the_same():
    _, fixes = O05.sailed(5)
    backwards = Fixes(-fixes.time[::-1], fixes.latitude[::-1], fixes.longitude[::-1])
    one, other = (steerway.estimate(each, O05.profile, smooth=True) for each in (fixes, backwards))
    inner = slice(150, -150)
    cog = np.array([wrap(d) for d in other.cog[::-1] - one.cog - math.pi])
    for name, apart in (
        ("sog", other.sog[::-1] - one.sog),
        ("cog", cog),
        ("course_rate", other.course_rate[::-1] + one.course_rate),
    ):
        assert np.median(np.abs(apart[inner] / getattr(one, f"{name}_std")[inner])) < 0.15, name


@pytest.mark.parametrize("trouble", ["burst", "step", "jump", "dropout", "antimeridian", "pole"])
def test_troubles_cost_next_to_nothing(trouble):
    for seed in range(3):
        voyage, fixes = O05.sailed(seed)
        usual = rms(error_of(steerway.estimate(fixes, O05.profile, smooth=True), voyage))
        truth, output = TROUBLES[trouble][0](voyage, fixes, np.random.default_rng(seed))
        troubled = rms(error_of(steerway.estimate(output, O05.profile, smooth=True), truth))
        assert np.all(troubled < 1.3 * usual)


def test_one_outlier_in_ten_costs_next_to_nothing():
    voyage, fixes = O05.sailed(1)
    chance = np.random.default_rng(1)
    astray = (chance.random(len(fixes)) < 0.1) * chance.standard_normal((2, len(fixes))) * math.radians(20.0 / 111e3)
    output = replace(fixes, latitude=fixes.latitude + astray[0], longitude=fixes.longitude + astray[1])
    usual, troubled = (rms(error_of(steerway.estimate(f, O05.profile, smooth=True), voyage)) for f in (fixes, output))
    assert np.all(troubled < 1.2 * usual)


def test_where_fixes_are_far_apart_it_believes_those_at_the_beginning_of_a_turn():
    """The filter rejects some of them; smoothed they count."""
    causal, smoothed = [], []
    for seed in range(8):
        voyage, fixes = O05.sailed(seed)
        seldom = np.arange(0, len(fixes), 15)
        output = fixes.rows(seldom)
        for found, smooth in ((causal, False), (smoothed, True)):
            motion = steerway.estimate(output, O05.profile, smooth=smooth)
            cog = np.array([wrap(d) for d in motion.cog - voyage.cog[seldom]])
            found.append(np.nanmean(np.square(cog[10:])))
    assert np.sqrt(np.mean(smoothed)) < 0.4 * np.sqrt(np.mean(causal))


def test_of_a_vessel_that_comes_to_rest_it_knows_what_she_did_before():
    """The last rows in which she has a course see those behind them, in which she has none; the filter does not."""
    time = np.arange(0.0, 200.0, 0.2)
    speed = 1.2 * np.clip(1.0 - (time - 100.0) / 5.0, 0.0, 1.0)
    profile = O05.profile.model_copy(update={"speed_noise": 0.05, "turn_speed_noise": 0.05})
    causal, smoothed = [], []
    for seed in range(8):
        fixes = Gnss(white=0.5).fixes(time, 0.2 * np.cumsum(speed), np.zeros(len(time)), seed)
        for found, smooth in ((causal, False), (smoothed, True)):
            motion = steerway.estimate(fixes, profile, smooth=smooth)
            last = np.flatnonzero(np.isfinite(motion.cog))[-15:]
            off = motion.sog[last] * np.exp(1j * motion.cog[last]) - speed[last]
            found.append(np.mean(np.abs(off) ** 2))
    assert np.sqrt(np.mean(smoothed)) < 0.4 * np.sqrt(np.mean(causal))
