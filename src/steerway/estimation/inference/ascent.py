"""Maximum of a posterior that is a sum over rows, by the scores of the rows.

Fisher's scoring within a trust region. The information is the sum of outer products of the rows' scores (E. K. Berndt,
B. H. Hall, R. E. Hall and J. A. Hausman, Annals of Economic and Social Measurement 3(4), 1974) and the prior's. Between
differences the scores are kept up to date by the secants of the steps (C. G. Broyden, Mathematics of Computation 19,
1965). Along a number that the record hardly tells of the outer products exceed the curvature, and scoring all but
stands still; therefore every number is tried once by a long step of its own.
"""

import math

import numpy as np

_TOLERANCE = 0.3
"""Gain of log posterior below which an iteration is the last: a tenth of what distinguishes two structures
(`selection.BETTER`)."""
_LEAST_REACH = 0.1
"""Prior deviations; a shorter step is not tried: at the median it changes the log prior by 0.005."""
_LONG_STEP = 0.5
"""Prior deviations of the steps of a sweep. Chosen: half the first reach of `climb`."""


class Ascent:
    """Where the search for a maximum stands: numbers x, log densities and scores of every row, log posterior."""

    def __init__(self, posterior, x):
        self.posterior, self.x = posterior, x
        self.each = posterior.densities(x)
        self.log = posterior.log(x, self.each)
        self.scores = None

    def differentiate(self):
        """Take the scores by differences."""
        self.scores = self.posterior.scores(self.x, self.each)

    def information(self):
        """Of the record and the prior about the numbers."""
        return self.scores @ self.scores.T + np.eye(len(self.x))

    def slope(self):
        """Gradient of the log posterior."""
        return self.scores.sum(axis=1) - self.x

    def try_step(self, step) -> float:
        """Go this step, as far as it leads to numbers that may be sought, if it leads up. Returns what it gains."""
        step = self.posterior.within(self.x + step) - self.x
        if not step.any():
            return 0.0
        each = self.posterior.densities(self.x + step)
        log = self.posterior.log(self.x + step, each)
        gained = log - self.log
        if gained > 0.0:
            self.scores = self.scores + np.outer(step, each - self.each - step @ self.scores) / float(step @ step)
            self.x, self.each, self.log = self.x + step, each, log
        return gained


def climb(ascent: Ascent, gradients):
    """Go up by scoring, with scores taken so often by differences."""
    reach, taken, exact = 1.0, 0, False
    if gradients:
        ascent.differentiate()
        taken, exact = 1, True
    while True:
        step = np.linalg.solve(ascent.information(), ascent.slope())
        largest = np.abs(step).max()
        gained = ascent.try_step(step * min(1.0, reach / largest))
        if gained > 0.0:
            reach, finished = min(2.0, 1.5 * reach), gained < _TOLERANCE
            converged = finished and exact
            exact = False
        else:
            reach, finished = 0.3 * min(reach, largest), not exact
            converged = exact and reach < _LEAST_REACH
        if converged or (finished and taken >= gradients):
            return
        if finished:
            ascent.differentiate()
            taken, exact = taken + 1, True


def sweep(ascent: Ascent) -> bool:
    """Try a long step up along every number by itself, the steepest first. Returns whether that gained anything."""
    before = ascent.log
    for i in np.argsort(-np.abs(ascent.slope())):
        step = np.zeros(len(ascent.x))
        step[i] = math.copysign(_LONG_STEP, ascent.slope()[i])
        ascent.try_step(step)
    return ascent.log - before > _TOLERANCE
