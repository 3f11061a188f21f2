"""The yardsticks of estimator-limits: the bound against an independent prototype, and intervals over runs."""

import math

import numpy as np
import pytest

from steerway_studies.testing import BOUNDS, CELLS, bounded, filtering_bound, over_runs
from steerway_studies.testing import scenarios_sail as sail


@pytest.mark.parametrize("name", CELLS)
def test_the_bound_is_that_of_an_independent_prototype(name):
    cell = CELLS[name]
    voyages = [sail(cell.scenario, seed) for seed in range(2 * cell.scenario.runs)]
    rows = np.array([bounded(filtering_bound(each, cell.profile), each, cell.scenario) for each in voyages])
    for k in range(2):
        for i, scale in enumerate((1.0, math.degrees(1.0), math.degrees(1.0))):
            value = over_runs(rows[:, k, i], rows[:, k, 3]).value * scale
            assert value == pytest.approx(BOUNDS[name][k][i], rel=0.02), (k, i)


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
