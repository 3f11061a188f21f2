"""Maximum of a posterior that is a sum over rows, by the scores of the rows.

Fisher's scoring within a trust region. The information is the sum of outer products of the rows' scores (E. K. Berndt,
B. H. Hall, R. E. Hall and J. A. Hausman, Annals of Economic and Social Measurement 3(4), 1974) and the prior's. Between
differences the scores are kept up to date by the secants of the steps, also of those that lead down (C. G. Broyden,
Mathematics of Computation 19, 1965). Scoring stands still where the outer products exceed the curvature, and where the
likelihood has a kink, as at a fix that is an outlier on one side only; therefore every number is tried by itself too.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from steerway.core.arrays import Floats

if TYPE_CHECKING:
    from steerway.estimation.fit.posterior import Posterior

_TOLERANCE = 0.3
"""Gain of log posterior below which a round is the last: a tenth of what distinguishes two structures
(`selection.BETTER`)."""
_STANDS = 2.0
"""Gain of scoring below which it stands still, and every number is tried by itself. Chosen: else new differences gain
more for as many runs of the filter."""
_FAILURES = 2
"""Steps in a row that lead down, each at most half as long as the one before, after which scoring has had its turn.
Chosen."""
_SHORTEST, _LONGEST = 0.1, 1.0
"""Prior deviations of the step of one number by itself. Chosen: at the median the shortest changes the log prior by
0.005."""
_BLOCK = 64
"""Rows of scores in one product. BLAS starts threads for larger matrices; when other processes use the cores, a product
then takes up to a thousand times as long (324 ms in place of .4)."""
_PROMISING = 0.03
"""Gain of such a step by the slope alone below which it is not tried: a tenth of `_TOLERANCE`. Chosen."""


class Ascent:
    """Where the search for a maximum stands: numbers x, log densities and scores of every row, log posterior."""

    scores: Floats
    measured: Floats

    def __init__(self, posterior: "Posterior", x: Floats) -> None:
        self.posterior, self.x = posterior, x
        self.each = posterior.densities(x)
        self.log = posterior.log(x, self.each)

    def differentiate(self) -> None:
        """Take the scores by differences."""
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
        """Go this step, as far as it leads to numbers that may be sought, if it leads up. Returns what it gains."""
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
    """Go up in at most so many rounds: differences and scoring; where that stands still, every number by itself.

    Returns whether the last round gained hardly anything.
    """
    for _ in range(rounds):
        before = ascent.log
        ascent.differentiate()
        score(ascent)
        if ascent.log - before < _STANDS:
            scored = ascent.log
            sweep(ascent)
            if ascent.log - scored > _TOLERANCE:
                score(ascent)
        if ascent.log - before < _TOLERANCE:
            return True
    return False


def score(ascent: Ascent) -> None:
    """Steps of scoring until they gain hardly anything."""
    reach, failures = 1.0, 0
    while failures <= _FAILURES:
        step = np.linalg.solve(ascent.information(), ascent.slope())
        largest = np.abs(step).max()
        if largest == 0.0:  # the start is the maximum: no row says anything of the numbers
            return
        gained = ascent.try_step(step * min(1.0, reach / largest))
        if gained > 0.0:
            reach, failures = min(2.0, 1.5 * reach), 0
            if gained < _TOLERANCE:
                return
        else:
            reach, failures = 0.5 * min(reach, largest), failures + 1


def sweep(ascent: Ascent) -> None:
    """Step up along every number by itself that promises a gain, the steepest first."""
    information = np.diag(ascent.information())
    for i in np.argsort(-np.abs(ascent.slope())):
        slope = ascent.slope()[i]
        length = np.clip(abs(slope) / information[i], _SHORTEST, _LONGEST)
        if abs(slope) * length > _PROMISING:
            step = np.zeros(len(ascent.x))
            step[i] = math.copysign(length, slope)
            ascent.try_step(step)
