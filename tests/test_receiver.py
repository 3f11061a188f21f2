"""What a receiver does to its fixes: outliers, steps of its error, fixes that it extrapolates."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import qmc

import steerway
from steerway.core import REJECTED, wrap_array
from steerway.core.testing import PREDICTED
from steerway.estimation.testing import (
    COURSE,
    MODES,
    SPEED,
    LogEstimator,
    extrapolated,
    medians_of,
    of_other_receiver,
    take_fix,
    without_copies,
)
from tests import scenes
from tests.scenes import banked, sailed, straight, turning

SETTLED = 100


def rms(errors):
    return math.sqrt(np.nanmean(errors[SETTLED:] ** 2))


def stepping(time):
    """An error of the receiver that changes by about a metre every 50 s, and stays."""
    change = np.random.default_rng(5).normal(0.0, 0.7, (2, 12))
    return np.cumsum(change, axis=1)[:, (time // 50.0).astype(int) % 12]


@pytest.mark.study
def test_a_step_of_the_receiver_moves_the_place_and_not_the_motion():
    scene = turning(1.5, 0.3, 599.0, seed=3)
    found = {}
    for name, fixes in (("clean", scene.fixes(0.05, 3)), ("stepping", scene.fixes(0.05, 3, stepping))):
        estimator = LogEstimator(fixes)
        found[name] = [estimator.motion(fixes, smooth=smooth) for smooth in (False, True)]
    assert all("steps" in each.parts for each in estimator.profile.structures)
    for clean, stepped in zip(found["clean"], found["stepping"], strict=True):
        assert rms(stepped.sog - scene.sog) < 1.3 * rms(clean.sog - scene.sog)
        assert not (stepped.status == REJECTED).any()


def test_an_outlier_behind_a_step_of_the_receiver_is_no_return():
    """Far from where the receiver was and from where it is: the fixes after it are taken."""
    off = np.where(np.arange(61) < 30, 0.0, 20.0) - 12.0 * (np.arange(61) == 50)
    fixes = straight(2.0, 0.0, 12.0).fixes(0.0, 0, lambda _: (0.0 * off, off))
    status = steerway.estimate(fixes, scenes.usual_profile("base", "wander"), causal=True).status
    assert np.flatnonzero(status == REJECTED).tolist() == [30, 31, 32, 33, 50]


def test_the_correction_has_the_moments_of_the_mixture_of_all_hypotheses():
    """Against the hypotheses corrected one by one, those of less than 1e-6 too; an outlier leaves a mode as it is."""
    parts = ("base", "wander", "steps", "clock")
    given = {"step_every": 20.0, "poor_rate": 0.1}
    model, bank = banked(parts, [(2.0 * k, 1.0 * k) for k in range(1, 20)], **given)
    values, states = medians_of(parts) | given, bank.x.shape[1]
    x, p = bank.x.copy(), bank.p.copy()
    fix = np.array([41.2, 19.1])
    take_fix(bank, model, *fix, 1.0)
    variance, late = values["fix_std"] ** 2, values["late_std"] ** 2
    wrong = values["outlier_rate"]
    for k in range(MODES):
        nu = fix - x[k, :2]
        velocity = x[k, 2] * np.array([math.cos(x[k, 3]), math.sin(x[k, 3])])
        seen = variance * np.eye(2) + values["time_std"] ** 2 * np.outer(velocity, velocity)
        s = p[k, :2, :2] + seen
        poor = 35.0 * variance * np.eye(2) + late * np.outer(velocity, velocity)
        step = values["step_std"] ** 2 * np.eye(2)
        far = max(1.0, (nu @ nu - np.trace(s)) / np.trace(step)) * step
        density = {
            "good": gaussian(nu, s),
            "poor": gaussian(nu, s + poor),
            "step": student(nu, s + step),
            "outlier": 1.0 / (20.0 * math.pi * (nu @ nu + np.trace(s) + 100.0 * variance)),
        }
        steps = 1.0 - math.exp(-1.0 / 20.0)
        prior = (1.0 - wrong) * np.array([0.9 * (1.0 - steps), 0.1, 0.9 * steps, wrong / (1.0 - wrong)])
        weights = prior * np.array(list(density.values()))
        weights /= weights.sum()
        moments, none = [], np.zeros((2, 2))
        for weight, added, moves in zip(weights, (none, poor, none, None), (none, none, far, none), strict=True):
            before = p[k].copy()
            before[:2, :2] += moves
            gain = np.zeros((states, 2))
            if added is not None:
                gain = before[:, :2] @ np.linalg.inv(before[:2, :2] + seen + added)
            moments.append((weight, gain @ nu, before - gain @ before[:2]))
        mean = sum(w * shift for w, shift, _ in moments)
        spread = sum(w * (after + np.outer(shift - mean, shift - mean)) for w, shift, after in moments)
        rows = np.setdiff1d(np.arange(states), (SPEED, COURSE))  # a velocity that is hardly known is turned besides
        np.testing.assert_allclose((bank.x[k] - x[k])[rows], mean[rows], rtol=1e-5, atol=1e-12)
        np.testing.assert_allclose(bank.p[k][np.ix_(rows, rows)], spread[np.ix_(rows, rows)], rtol=1e-5, atol=1e-12)


def gaussian(nu, s):
    return math.exp(-0.5 * nu @ np.linalg.solve(s, nu)) / (2.0 * math.pi * math.sqrt(np.linalg.det(s)))


def student(nu, s):
    return (1.0 + nu @ np.linalg.solve(s, nu) / 4.0) ** -3 / (2.0 * math.pi * math.sqrt(np.linalg.det(s)))


STATES = {  # parts, and offsets (m) to the east of fixes after twenty on a line
    "usual": (("base", "wander"), []),
    "after an outlier": (("base", "wander"), [20.0]),
    "in a run of outliers": (("base", "wander"), [20.0, 20.3, 19.8]),
    "after a followed step": (("base", "wander"), [20.0] * 4),
    "long after it": (("base", "wander"), [20.0] * 12),
    "after a return": (("base", "wander"), [20.0] * 8 + [0.0]),
    "with steps": (("base", "wander", "steps"), [1.0]),
    "in an obstruction": (("base", "wander", "obstructions"), [2.0, -1.5, 2.5]),
}


@pytest.mark.parametrize("state", STATES)
def test_the_density_of_the_next_fix_integrates_to_one(state):
    """By quasi-random importance sampling; that of outliers as far as its own integral is 1."""
    parts, tail = STATES[state]
    model, bank = banked(parts, [(2.0 * k, off) for k, off in enumerate([0.0] * 20 + tail, start=1)], fix_std=0.3)
    weights, x = bank.probability.copy(), bank.x[:, :2].copy()
    predicted = weights @ x
    s = (
        np.einsum("k,kij->ij", weights, bank.p[:, :2, :2])
        + (x - predicted).T * weights @ (x - predicted)
        + 0.09 * np.eye(2)
    )
    run = bank.run[0]
    centres = np.array(
        [[0.0, 0.0], [-run["step_north"], -run["step_east"]], [run["outlier_north"], run["outlier_east"]]]
    )
    shares, reach = (0.4, 0.15, 0.15, 0.15, 0.15), math.sqrt(np.trace(s) + 9.0)
    u = qmc.Sobol(3, rng=np.random.default_rng(7)).random(1 << 12)
    kind, angle = np.searchsorted(np.cumsum(shares)[:-1], u[:, 0]), 2.0 * math.pi * u[:, 1]
    around = np.c_[np.cos(angle), np.sin(angle)]
    near, wide = 1.5 * s, 9.0 * s + np.eye(2)
    normal = np.sqrt(-2.0 * np.log1p(-u[:, 2]))[:, None] * around @ np.linalg.cholesky(near).T
    heavy = np.sqrt(4.0 * ((1.0 - u[:, 2]) ** -0.5 - 1.0))[:, None] * around @ np.linalg.cholesky(wide).T
    far = (reach * np.sqrt(np.expm1(20.0 * u[:, 2])))[:, None] * around
    off = np.where(kind[:, None] < 3, normal + centres[np.minimum(kind, 2)], np.where(kind[:, None] == 3, heavy, far))
    before, ratios = [np.copy(each) for each in bank], np.empty(len(off))
    for i, each in enumerate(off):
        density = math.exp(take_fix(bank, model, *(predicted + each), 1.0)[1])
        proposed = [gaussian(each - centre, near) for centre in centres]
        proposed += [student(each, wide), 1.0 / (20.0 * math.pi * (each @ each + reach**2))]
        ratios[i] = density / np.dot(shares, proposed)
        for now, then in zip(bank, before, strict=True):
            now[...] = then
    assert abs(ratios.mean() - 1.0) < 0.01


def extrapolating(fixes, period):
    """The same fixes from a receiver that measures every `period`-th and goes on by the way between the last two."""
    rows = np.arange(len(fixes.time))
    measured = rows // period * period
    before = (measured - period).clip(0)
    way = (rows - measured) / period
    columns = {}
    for name in ("latitude", "longitude"):
        values = getattr(fixes, name)
        columns[name] = values[measured] + way * (values[measured] - values[before])
    return replace(fixes, **columns)


def test_fixes_that_a_receiver_extrapolates_are_predicted_and_tell_nothing():
    scene = turning(1.5, 0.3, 400.0, seed=2, density=1e-4)
    fixes = extrapolating(scene.fixes(0.1, 2), 5)
    estimator = scenes.small_craft()[2]
    motion = estimator.motion(fixes)
    measured = motion.status != PREDICTED
    assert measured.mean() == pytest.approx(0.2, abs=0.01)
    alone = estimator.motion(fixes.rows(measured))
    for name in ("sog", "cog", "course_rate"):
        apart = wrap_array(getattr(motion, name)[measured] - getattr(alone, name))
        assert rms(apart / getattr(alone, f"{name}_std")) < 0.5, name


def test_measured_fixes_are_not_taken_for_extrapolated_ones_or_those_of_two_receivers():
    """Fast ones in pairs under right stamps neither: neighbours are at unequal distances, and on one line."""
    scene = turning(1.5, 0.3, 300.0, seed=2)
    noise = np.random.default_rng(1).standard_normal((2, len(scene.time)))
    for std, rounded in itertools.product((0.0, 0.01, 0.5), (1e-9, 0.1, 1.0)):
        north, east = np.round((np.array([scene.north, scene.east]) + std * noise) / rounded) * rounded
        assert not extrapolated(scene.time, north, east).any()
        assert not of_other_receiver(scene.time, north, east).any()
    for shift in (0.0, 0.3):
        t = (np.arange(2000) + shift * (np.arange(2000) % 2)) / 5.0
        north, east = np.array([12.0 * t, 0.0 * t]) + np.random.default_rng(1).normal(0.0, 0.02, (2, len(t)))
        assert not of_other_receiver(t, north, east).any()


def two_receivers(scene, seed):
    """Errors (2, n) of fixes that alternate: 0.2 m of noise at the vessel, 0.5 m a metre ahead to port."""
    odd = np.arange(len(scene.time)) % 2 == 1
    noise = np.where(odd, 0.5, 0.2) * np.random.default_rng(seed).standard_normal((2, len(scene.time)))
    forward, starboard = 1.0 * odd, -0.5 * odd
    c, s = np.cos(scene.cog), np.sin(scene.cog)
    return noise + np.array([forward * c - starboard * s, forward * s + starboard * c])


def test_of_two_receivers_whose_fixes_alternate_the_better_one_is_followed():
    """In turns of 12 °/s, in which the place between the two antennas has a course that is off by 4°."""
    t = np.arange(3000) / 10.0
    rate = np.radians(12.0) * np.where(t % 60.0 < 30.0, 0.0, np.where(t % 120.0 < 60.0, 1.0, -1.0))
    scene = sailed(1.5, np.cumsum(rate) / 10.0, 10.0)
    fixes = scene.fixes(0.0, 1, lambda _: two_receivers(scene, 1))
    motion = scenes.small_craft()[2].motion(fixes, smooth=True)
    assert ((motion.status == PREDICTED) == (np.arange(len(t)) % 2 == 1))[SETTLED:].all()
    turns = (t > 20.0) & (np.abs(t % 30.0 - 15.0) < 10.0) & (rate != 0.0)
    assert abs(np.mean(wrap_array(motion.cog - scene.cog)[turns] * np.sign(rate[turns]))) < np.radians(0.5)
    for off, std in ((motion.sog - scene.sog, motion.sog_std), (wrap_array(motion.cog - scene.cog), motion.cog_std)):
        assert (np.abs(off) < 1.96 * std)[t > 20.0].mean() > 0.85


def test_of_a_coarse_receiver_that_is_asked_too_often_every_sixth_fix_is_a_copy_and_of_a_resting_boat_none():
    """New ones every 1.2 s, a row a second, at 5 m/s in digits of 1.85 m: no such step can be rounded to nothing.

    A boat at rest lies at one written place for a minute in the middle and at the end, and goes on at full speed.
    """
    time, digit = np.arange(600.0), (1.85, 1.72)
    measured = np.floor(time / 1.2) * 1.2
    north, east = (np.round(speed * measured / each) * each for speed, each in zip((-3.7, 3.4), digit, strict=True))
    copies = np.append(False, np.diff(measured) == 0.0)
    kept, _ = without_copies(time, north, east, digit)
    inner = slice(6, -6)
    np.testing.assert_array_equal(np.isnan(kept)[inner], copies[inner])
    slow = np.round(0.4 * time / 1.85) * 1.85
    kept, _ = without_copies(time, slow, 0.0 * time, digit)
    np.testing.assert_array_equal(kept, slow)
    rests = (time > 150.0) & (time <= 210.0) | (time > 340.0)
    north = np.cumsum(np.where(rests, 0.0, np.where(time < 60.0, 0.1, 3.0)))
    np.testing.assert_array_equal(without_copies(time, north, 0.5 * north)[0], north)
    held = north[np.arange(600) // 2 * 2]
    kept, _ = without_copies(time, held, 0.5 * held)
    np.testing.assert_array_equal(np.isfinite(kept[60:150]), np.arange(60, 150) % 2 == 0)
