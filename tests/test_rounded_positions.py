"""Positions of few digits: each is an interval of its last digit, a cell."""

import math

import numpy as np
import pytest
from scipy import stats

import steerway
from steerway.core import NORMAL_95
from steerway.core.testing import PREDICTED
from steerway.estimation import LearningFilter, choose_profile, load_profile
from steerway.estimation.testing import (
    Sym2,
    Vec2,
    cell_of,
    interval_of,
    step_density,
    take_fix,
)
from steerway_studies.testing import rounded
from tests.scenes import banked, straight

CELLS = (0.0, 0.4), (0.7, 0.3), (-2.5, 1.0), (6.0, 0.5), (0.1, 30.0), (0.3, 0.05), (30.0, 1.0)
"""Middle and width of an interval about which a number of unit variance is known: also narrow, wide and far."""


@pytest.mark.parametrize(("middle", "width"), CELLS)
def test_an_interval_has_the_moments_of_the_normal_distribution_in_it(middle, width):
    """A narrow or far one has those of a normal likelihood of the same variance, q²/12."""
    y = np.linspace(middle - 0.5 * width, middle + 0.5 * width, 20_001)
    is_exact = width >= 0.2 and abs(middle) < 25.0
    if not is_exact:
        y = np.linspace(middle - 5.0, middle + 5.0, 200_001)
    density = np.exp(-0.5 * y**2) / math.sqrt(2.0 * math.pi)
    if is_exact:
        density[[0, -1]] *= 0.5
        expected = density.sum() * (y[1] - y[0]) / width
    else:
        density = np.exp(-0.5 * (y**2 - middle**2) - 6.0 * ((y - middle) / width) ** 2)
        whole = 1.0 + width**2 / 12.0
        expected = math.exp(-0.5 * middle**2 / whole) / math.sqrt(2.0 * math.pi * whole)
    mean = density @ y / density.sum()
    found = interval_of(4.0 * middle, 16.0, 4.0 * width)
    assert found.density == pytest.approx(expected / 4.0, rel=1e-5)
    assert found.mean == pytest.approx(4.0 * mean, rel=1e-4, abs=1e-6)
    assert found.variance == pytest.approx(16.0 * (density @ (y - mean) ** 2 / density.sum()), rel=1e-3)


@pytest.mark.parametrize(("covariance", "wider"), [(0.0, 1.0), (0.3, 1.25)], ids=["independent", "correlated"])
def test_a_cell_has_the_moments_of_the_plane_normal_distribution_in_it(covariance, wider):
    """By samples of which those in the cell are kept. What east adds to north, which is not normally distributed any
    more, is an approximation: the variance of north may be a quarter too large."""
    s = np.array([[0.5, covariance], [covariance, 0.8]])
    off, width = np.array([0.9, -0.4]), np.array([1.2, 0.8])
    samples = np.random.default_rng(3).multivariate_normal(np.zeros(2), s, 2_000_000)
    inside = samples[(np.abs(samples - off) < 0.5 * width).all(axis=1)]
    found = cell_of(Vec2(*off), Sym2(s[0, 0], s[0, 1], s[1, 1]), Vec2(*width))
    assert found.density == pytest.approx(len(inside) / len(samples) / width.prod(), rel=0.02)
    np.testing.assert_allclose(found.mean, inside.mean(axis=0), atol=0.02)
    sampled = np.cov(inside.T)
    assert 0.98 * sampled[0, 0] < found.spread.nn < 1.02 * wider * sampled[0, 0]
    np.testing.assert_allclose(found.spread[1:], sampled[1], atol=0.005)


@pytest.mark.parametrize(("middle", "width"), [(0.0, 0.4), (0.7, 3.0), (-2.5, 1.0), (40.0, 1.0), (0.3, 50.0)])
def test_a_cell_behind_a_step_has_the_density_of_students_distribution(middle, width):
    of_steps = stats.t(4.0, scale=2.0)
    low, high = abs(middle) - 0.5 * width, abs(middle) + 0.5 * width
    expected = (of_steps.sf(low) - of_steps.sf(high)) / width
    found = step_density(Vec2(middle, 0.0), Sym2(4.0, 0.5, 4.0), Vec2(width, 1.0))
    assert found == pytest.approx(expected * (1.0 - 2.0 * of_steps.sf(0.5)), rel=1e-9)


@pytest.mark.parametrize("steps", [{}, {"step_every": 8.0, "step_std": 0.4}], ids=["plain", "with steps"])
def test_the_densities_of_all_cells_add_up_to_one(steps):
    """Those of outliers fill a kilometre, of which the cells hold little."""
    parts = ("base", "wander", "steps") if steps else ("base", "wander")
    width = np.array([1.85, 1.2])
    places = np.round(np.outer(np.arange(1, 30), [0.6, 0.4]) / width) * width
    model, bank = banked(parts, places, tuple(width), fix_std=0.01, outlier_rate=1e-4, **steps)
    before = [np.copy(each) for each in bank]
    total = 0.0
    for i in range(-8, 20):
        for j in range(-8, 25):
            total += math.exp(take_fix(bank, model, i * width[0], j * width[1], 1.0)[1]) * width.prod()
            for now, then in zip(bank, before, strict=True):
                now[...] = then
    assert total == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize(("digit", "speed", "rate"), [("5 decimals", 0.556, 1.0), ("0.001'", 2.5, 1.0)])
def test_a_straight_track_is_as_fast_as_it_is(digit, speed, rate, smooth):
    """North at half a digit a fix, too: no fix is another receiver's."""
    step = rounded.DIGITS[digit]
    fixes = rounded_to(step, straight(speed, 0.0, 300.0, rate).fixes(0.02, 1))
    motion = steerway.estimate(fixes, smooth=smooth)
    off = (motion.sog - speed)[30:]
    assert (motion.status == PREDICTED).mean() < 0.02, "a half are those of another receiver"
    assert np.abs(off.mean()) < 0.02 * speed
    assert (np.abs(off) < NORMAL_95 * motion.sog_std[30:]).mean() > 0.9
    assert np.nanmin(motion.sog_std) > math.radians(step) * 4e6 / math.sqrt(12.0) / math.sqrt(300.0) / 300.0


@pytest.mark.parametrize(("digit", "noise", "place", "speed"), [(1e-4, 0.05, 0.5, 1e-3), (1e-7, 0.0, 1e-3, 1e-5)])
def test_a_moored_boat_is_known_no_better_than_its_digit(digit, noise, place, speed):
    """Also where the receiver holds its place, in digits that are otherwise too fine to matter."""
    fixes = rounded_to(digit, straight(0.0, 0.0, 300.0, 1.0).fixes(noise, 1))
    motion = steerway.estimate(fixes, smooth=True)
    assert motion.position_std.min() > place and np.nanmin(motion.sog_std) > speed
    assert (motion.sog < NORMAL_95 * motion.sog_std)[30:].mean() > 0.9


def test_the_digit_is_in_the_profile_and_learned_from_a_stream(tmp_path):
    fixes = rounded_to(1e-5, straight(1.5, 0.7, 60.0, 2.0).fixes(0.1, 2))
    profile = choose_profile(fixes)
    profile.save(tmp_path / "mine.toml")
    assert load_profile(tmp_path / "mine.toml") == profile
    north, east = profile.structures[0].quantum
    assert north == pytest.approx(1.11, abs=0.02) and 0.4 < east < north
    learning = LearningFilter(background=False)
    for latitude, longitude in zip(fixes.latitude, fixes.longitude, strict=True):
        learning.row(0.5, latitude, longitude)
    assert learning.learned.structures[0].quantum == pytest.approx((north, east), rel=1e-4)
    assert choose_profile(straight(1.5, 0.7, 60.0, 2.0).fixes(0.1, 2)).structures[0].quantum == (0.0, 0.0)


def rounded_to(digit, fixes):
    """The fixes, from a place of many digits on, with positions of this last digit (degrees)."""
    places = (np.degrees(each) + 0.01234567 for each in (fixes.latitude, fixes.longitude))
    return steerway.Fixes(fixes.time, *(np.radians(np.round(each / digit) * digit) for each in places))
