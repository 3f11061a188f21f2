"""The study estimator-limits in small: its yardsticks against exact answers, and the estimator against its targets."""

import itertools
import math

import numpy as np
import pytest

from steerway_studies.testing import (
    CELLS,
    SLOW,
    WHAT,
    WHERE,
    accuracy,
    all_histories,
    bounded,
    filtering_bound,
    known_mode_smoother,
    known_modes,
    over_runs,
    particle_filter,
)
from steerway_studies.testing import scenarios_sail as sail


@pytest.mark.parametrize("name", CELLS)
def test_the_bound_is_that_of_an_independent_prototype(name):
    cell = CELLS[name]
    voyages = [sail(cell.scenario, seed) for seed in range(2 * cell.scenario.runs)]
    rows = np.array([bounded(filtering_bound(each, cell.profile), each, cell.scenario) for each in voyages])
    for k in range(2):
        for i, scale in enumerate((1.0, math.degrees(1.0), math.degrees(1.0))):
            value = over_runs(rows[:, k, i], rows[:, k, 3]).value * scale
            assert value == pytest.approx(accuracy.PUBLISHED[name][k][i], rel=0.02), (WHERE[k], WHAT[i])


def test_with_known_modes_the_filter_is_consistent():
    """NEES of 3 straight and in turns; the textbook's correction takes an error of the course for one of the speed."""
    runs = [known_modes.one("o05", seed) for seed in range(12)]
    nees = np.sum([run["invariant_nees"] for run in runs], axis=0)
    assert np.all(np.abs(nees[:, 0] / nees[:, 1] - 3.0) < 0.5)
    textbook, invariant = (np.sum([run[f"{form}_known"] for run in runs], axis=0) for form in ("textbook", "invariant"))
    assert np.sqrt(textbook[1, 0] / invariant[1, 0]) > 1.08, "SOG in turns"
    assert np.all(np.abs(np.sqrt(textbook[:, 1:3] / invariant[:, 1:3]) - 1.0) < 0.03), "COG and rate"


def restless():
    """Ten steps of a boat that begins and ends turns all the time: every history of modes can be written out."""
    profile = SLOW.profile.model_copy(
        update={"straight_time": 0.3, "turn_time": 0.3, "turn_course_rate_noise": 0.5, "position_std": 0.05}
    )
    models, dt = profile.modes(), 0.2
    time = dt * np.arange(11)
    rate = np.where(time > 0.7, 1.0, 0.0)
    course = np.cumsum(rate) * dt
    north, east = np.cumsum(1.3 * dt * np.cos(course)), np.cumsum(1.3 * dt * np.sin(course))
    places = np.column_stack([north, east]) + np.random.default_rng(4).normal(0.0, 0.05, (11, 2))
    start = np.array([north[0], east[0], 1.3, 0.0, 0.0]), np.diag([4e-4, 4e-4, 0.04, 0.04, 1e-4])
    return places, start, models, dt


def written_out(places, start, models, dt):
    """Every history's probability given the record, its smoothed states and its last filtered one."""
    from steerway_studies.testing import _forward, steps

    step, chances = steps(models, dt)
    n = len(places)
    logs, smoothed, last = [], [], []
    for later in itertools.product((0, 1), repeat=n - 1):
        mode = np.array((0, *later))
        x, p, density = np.empty((n, 5)), np.empty((n, 5, 5)), np.zeros(n)
        x[0], p[0] = start
        _forward(places, mode, models, step, x, p, density, 0, n)
        change = mode[1:] != mode[:-1]
        chance = chances[mode[:-1]]
        logs.append(density.sum() + np.log(np.where(change, chance, 1.0 - chance)).sum())
        smoothed.append(known_mode_smoother(places, start, mode.astype(bool), models, dt))
        last.append(x[-1])
    weights = np.exp(np.array(logs) - max(logs))
    weights /= weights.sum()
    return weights, np.array(smoothed), np.array(last)


def test_the_walk_over_histories_finds_what_writing_them_out_gives():
    places, start, models, dt = restless()
    weights, smoothed, _ = written_out(places, start, models, dt)
    exact = np.einsum("h,hki->ki", weights, smoothed)
    spread = np.sqrt(np.einsum("h,hki->ki", weights, (smoothed - exact) ** 2))
    for guess in (np.zeros(11, bool), np.arange(11) > 2):
        walked, accepted = all_histories(places, start, guess, models, dt, 40_000, 1, kept=8000)
        assert accepted > 0.03
        assert np.all(np.abs(walked - exact)[:, 2:] < 0.05 * spread[:, 2:] + 1e-6)


def test_the_filter_of_many_histories_finds_what_writing_them_out_gives():
    places, start, models, dt = restless()
    weights, _, last = written_out(places, start, models, dt)
    exact = weights @ last
    spread = np.sqrt(weights @ (last - exact) ** 2)
    means, spreads = particle_filter(places, start, models, dt, 20_000, 2)
    assert np.all(np.abs(means[-1] - exact) < 0.1 * spread + 1e-6)
    assert np.all(np.diag(spreads[-1]) > 0.8 * spread**2)


def test_many_runs_as_one_number():
    """The ratio of sums, and an interval that holds the truth about 95 times in a hundred."""
    assert over_runs([4.0, 12.0], [1.0, 3.0]).value == 2.0
    chance = np.random.default_rng(0)
    held = 0
    for _ in range(100):
        squares = chance.normal(0.0, 2.0, (30, 10)) ** 2
        _, low, high = over_runs(squares.sum(axis=1), np.full(30, 10.0))
        held += low < 2.0 < high
    assert 85 <= held <= 99
