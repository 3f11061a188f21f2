"""The four cells of the comparison with the bound, two vessels by two receivers, and what one run gives."""

from dataclasses import dataclass

import numpy as np

from steerway.estimation.filter import FiveStateFilter
from steerway.records import Fixes
from steerway.sensors.gnss import white
from steerway.studies.estimator_limits.scenarios import FAST, SLOW, Scenario, Voyage, cells, sail
from steerway.studies.estimator_limits.statistics import error_squares, turned

WHAT = ("sog", "cog", "rate")
WHERE = ("straight", "turn")
EARLIER = 100_000
"""Added to a seed: another voyage of the same vessel."""


@dataclass(frozen=True)
class Cell:
    """A vessel and a receiver, with the known parameters of both."""

    scenario: Scenario
    position_std: float

    @property
    def profile(self):
        return self.scenario.known(self.position_std)

    def sailed(self, seed: int) -> tuple[Voyage, Fixes]:
        """One voyage and what the receiver says of it."""
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
    return sums(error_squares(motion, voyage), cells(scenario, voyage))


def bounded(covariance, voyage, scenario) -> np.ndarray:
    """`sums` of a bound (n, 5, 5)."""
    return sums(np.diagonal(covariance, axis1=1, axis2=2)[:, 2:].T, cells(scenario, voyage))


def consistency(voyage: Voyage, fixes: Fixes, profile, scenario) -> tuple[np.ndarray, np.ndarray]:
    """Sum and rows (2,) of the NIS of fixes, and (3, 2) of the NEES of (U, χ, ω): straight, in turns, all along."""
    estimator = FiveStateFilter(profile)
    nis, nees = np.full(len(fixes), np.nan), np.full(len(fixes), np.nan)
    truth = voyage.states
    for k in range(len(fixes)):
        if k:
            estimator.predict(fixes.time[k] - fixes.time[k - 1])
        nis[k] = estimator.update(fixes.latitude[k], fixes.longitude[k])
        if estimator.underway:
            error = estimator.state[2:5] - truth[k, 2:]
            error[1] = turned(error[1])
            nees[k] = error @ np.linalg.solve(estimator.covariance[2:5, 2:5], error)
    settled = voyage.time >= scenario.settling
    counted = settled & np.isfinite(nis)
    return np.array([nis[counted].sum(), counted.sum()]), by_place(nees, voyage, scenario)


def by_place(nees, voyage, scenario) -> np.ndarray:
    """(3, 2) sum and rows of what is known of (n,): straight, in turns, and all along."""
    places = (*cells(scenario, voyage), voyage.time >= scenario.settling)
    masks = [mask & np.isfinite(nees) for mask in places]
    return np.array([[nees[mask].sum(), mask.sum()] for mask in masks])
