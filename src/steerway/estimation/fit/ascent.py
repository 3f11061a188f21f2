"""Maximum of a log posterior that is a sum over rows, from each row's score (derivatives of its log density).

Fisher scoring within a trust region. The information is that of the prior plus the sum of outer products of the rows'
scores (E. K. Berndt, B. H. Hall, R. E. Hall and J. A. Hausman, Annals of Economic and Social Measurement 3(4), 1974).
Between differentiations every step, up or down, updates the scores by its secant (C. G. Broyden, Mathematics of
Computation 19, 1965). Scoring stalls where the outer products exceed the curvature. It also stalls at a kink of the
likelihood, for instance where a fix is an outlier on one side only. Then each number is varied alone.
"""

import math
from typing import Protocol

import numpy as np

from steerway.core.arrays import Floats

_TOLERANCE = 0.3
"""The search ends after a round that raises the log posterior by less than this: a tenth of `selection.BETTER`."""
_STALLED = 2.0
"""Gain of log posterior by scoring below which each number is varied alone. After a larger gain, the next round of
scoring gains more per run of the filter."""
_FAILURES = 2
"""Failed steps in a row that scoring allows; each is at most half as long as the one before."""
_SHORTEST, _LONGEST = 0.1, 1.0
"""Bounds of the step of a number varied alone, in prior standard deviations. At the prior median the shortest step
changes the log prior by 0.005."""
_BLOCK = 64
"""Rows of scores per matrix product. BLAS starts threads for larger matrices; when other processes use the cores, such
a product takes up to a thousand times as long (324 ms instead of 0.4)."""
_PROMISING = 0.03
"""A number is varied alone if its slope promises a gain above this: a tenth of `_TOLERANCE`."""


class LogPosterior(Protocol):
    """A log posterior of numbers x, as a sum over rows: `posterior.Posterior`."""

    def densities(self, x: Floats) -> Floats: ...

    def log(self, x: Floats, each: Floats) -> float: ...

    def scores(self, x: Floats, each: Floats) -> Floats: ...

    def within(self, x: Floats) -> Floats: ...


class Ascent:
    """State of the search: numbers x, log density and scores of every row, log posterior."""

    scores: Floats
    measured: Floats

    def __init__(self, posterior: LogPosterior, x: Floats) -> None:
        self.posterior, self.x = posterior, x
        self.each = posterior.densities(x)
        self.log = posterior.log(x, self.each)

    def differentiate(self) -> None:
        """Compute the scores by finite differences."""
        self.scores = self.measured = self.posterior.scores(self.x, self.each)

    def information(self) -> Floats:
        """Information matrix of the numbers, from the record and the prior."""
        total = np.eye(len(self.x))
        for begin in range(0, self.scores.shape[1], _BLOCK):
            some = self.scores[:, begin : begin + _BLOCK]
            total += some @ some.T
        return total

    def slope(self) -> Floats:
        """Gradient of the log posterior."""
        return self.scores.sum(axis=1) - self.x

    def try_step(self, step: Floats) -> float:
        """Clip a step to the bounds of the search, and take it if it leads up. Returns the gain, taken or not."""
        step = self.posterior.within(self.x + step) - self.x
        if not step.any():
            return 0.0
        each = self.posterior.densities(self.x + step)
        log = self.posterior.log(self.x + step, each)
        if not math.isfinite(log):
            return -math.inf
        gained = log - self.log
        self.scores = self.scores + np.outer(step, each - self.each - step @ self.scores) / float(step @ step)
        if gained > 0.0:
            self.x, self.each, self.log = self.x + step, each, log
        return gained


def climb(ascent: Ascent, rounds: int) -> bool:
    """Climb for at most `rounds` rounds: differentiate and score; where scoring stalls, vary each number alone.

    Returns whether the last round gained less than `_TOLERANCE`.
    """
    for _ in range(rounds):
        before = ascent.log
        ascent.differentiate()
        score(ascent)
        if ascent.log - before < _STALLED:
            scored = ascent.log
            sweep(ascent)
            if ascent.log - scored > _TOLERANCE:
                score(ascent)
        if ascent.log - before < _TOLERANCE:
            return True
    return False


def score(ascent: Ascent) -> None:
    """Take steps of scoring until one gains less than `_TOLERANCE` or too many lead down."""
    reach, failures = 1.0, 0
    while failures <= _FAILURES:
        step = np.linalg.solve(ascent.information(), ascent.slope())
        largest = np.abs(step).max()
        if largest == 0.0:  # the start is the maximum: no row depends on the numbers
            return
        gained = ascent.try_step(step * min(1.0, reach / largest))
        if gained > 0.0:
            reach, failures = min(2.0, 1.5 * reach), 0
            if gained < _TOLERANCE:
                return
        else:
            reach, failures = 0.5 * min(reach, largest), failures + 1


def sweep(ascent: Ascent) -> None:
    """Vary each number alone whose slope promises a gain, the steepest first."""
    information = np.diag(ascent.information())
    for i in np.argsort(-np.abs(ascent.slope())):
        slope = ascent.slope()[i]
        length = np.clip(abs(slope) / information[i], _SHORTEST, _LONGEST)
        if abs(slope) * length > _PROMISING:
            step = np.zeros(len(ascent.x))
            step[i] = math.copysign(length, slope)
            ascent.try_step(step)
