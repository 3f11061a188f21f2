"""The four cells of the comparison with the bound, two vessels by two receivers, and what one run gives."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from steerway.core import Fixes
from steerway.sensors import white
from steerway_studies.estimator_limits.scenarios import (
    FAST,
    SLOW,
    LimitsScenario,
    TrueMotion,
    sail,
    straight_and_turning,
)
from steerway_studies.estimator_limits.statistics import error_squares
from steerway_studies.parts import over_cases

WHAT = ("sog", "cog", "rate")
WHERE = ("straight", "turn")
PLACES = {"straight": "straight", "turn": "in turns", "all": "all along"}
QUANTITIES = {"sog": "SOG", "cog": "COG", "rate": "course rate"}
"""In words."""
EARLIER = 100_000
"""Added to a seed: another voyage of the same vessel."""


@dataclass(frozen=True)
class Cell:
    """A vessel and a receiver, with the known parameters of both."""

    scenario: LimitsScenario
    position_std: float

    @property
    def profile(self):
        return self.scenario.known(self.position_std)

    def sailed(self, seed: int) -> tuple[TrueMotion, Fixes]:
        """One voyage and its fixes."""
        voyage = sail(self.scenario, seed)
        return voyage, voyage.fixes(white(self.position_std, self.scenario.rate), seed)


CELLS = {"o05": Cell(SLOW, 0.5), "o25": Cell(SLOW, 2.5), "m05": Cell(FAST, 0.5), "m25": Cell(FAST, 2.5)}
WORDS = {"o05": "O, 0.5 m", "o25": "O, 2.5 m", "m05": "M, 0.5 m", "m25": "M, 2.5 m"}


def sums(squares, masks) -> np.ndarray:
    """(2, 5): straight and in turns, sums of three squares (3, n), rows counted, and rows without a course."""
    found = np.empty((2, 5))
    for k, mask in enumerate(masks):
        chosen = squares[:, mask]
        known = np.isfinite(chosen[1])
        found[k, :3] = chosen[:, known].sum(axis=1)
        found[k, 3:] = known.sum(), (~known).sum()
    return found


def judged(motion, voyage, scenario) -> np.ndarray:
    """`sums` of the errors of an estimate."""
    return sums(error_squares(motion, voyage), straight_and_turning(scenario, voyage))


def bounded(covariance, voyage, scenario) -> np.ndarray:
    """`sums` of a bound (n, 5, 5)."""
    return sums(np.diagonal(covariance, axis1=1, axis2=2)[:, 2:].T, straight_and_turning(scenario, voyage))


def over_cells(measure, runs, first_seed, progress) -> dict[str, dict[str, np.ndarray]]:
    """Cell → kind → what `measure(cell, seed)` gives, a row a run; `runs` is how many, for all or by cell."""
    counts = runs if isinstance(runs, dict) else dict.fromkeys(CELLS, runs)
    cases = [(name, first_seed + k) for name, count in counts.items() for k in range(count)]
    measured = over_cases(partial(_of_case, measure), cases, progress=progress)
    found = {}
    for name in counts:
        of_cell = [run for (cell, _), run in zip(cases, measured, strict=True) if cell == name]
        found[name] = {kind: np.array([run[kind] for run in of_cell if kind in run]) for kind in of_cell[0]}
    return found


def _of_case(measure, case):
    return measure(*case)
