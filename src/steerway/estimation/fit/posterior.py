"""Maximum a posteriori fit of a structure's numbers, and its evidence.

The search is Fisher scoring within a trust region, from the derivatives of each row's log density (its score). The
information is that of the prior plus the sum of outer products of the rows' scores (E. K. Berndt, B. H. Hall, R. E.
Hall and J. A. Hausman, Annals of Economic and Social Measurement 3(4), 1974). Between differentiations every step, also
one that lowers the posterior, updates the scores by its secant (C. G. Broyden, Mathematics of Computation 19, 1965).
Scoring stalls where the outer products exceed the curvature. It also stalls at a kink of the likelihood, for instance
where a fix is an outlier on one side only. After a stall each number is varied alone.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.estimation.filter.model import FUSED, bank_in, bank_size, room_to_keep
from steerway.estimation.filter.row import Asked, Rows, run_record
from steerway.estimation.vessel.parts import LONGEST_ROLL, Parts, Values
from steerway.estimation.vessel.structures import log_share, model_of, priors_of

_NO_OUT = np.empty((0, FUSED + 2))
_SETTLING = 10
"""Fixes after a start that do not count in a fit, because the prior of the start is no part of the structure; at most a
third of a record. In simulated logs of 4 to 29 fixes, fits have 0.4 and 0.7 times the SOG error of prior medians."""
DRAWS, _WIDTH = 6, 0.6
"""Number of posterior samples that represent the parameter uncertainty of a short record, and their spread relative to
the normal approximation. The 95 % interval of the course rate covers 90 to 96 % of the rows of the scenes `drifting`,
`docking` and `circles` without samples, 92 to 96 % with a spread of 0.6, and 95 % with 1 (1 % larger errors)."""
_DIFFERENCE = 1e-3
"""Step of the finite differences, in prior standard deviations. With a curvature of 50 the slope of the log posterior
is off by 0.025, and rounding (1e-10) changes it less. With 0.05, fits end up to 50 below the maximum."""
_STEEPEST = 100.0
"""Score of a row above which its density counts as discontinuous. Outliers at any distance score at most about 20."""
FURTHEST = 6.0
"""Bound of the search around a prior median, in prior σ. The prior probability beyond it is 2·10⁻⁹."""
_TOLERANCE = 0.3
"""The search ends after a round that raises the log posterior by less than this: a tenth of `selection.BETTER`."""
_STALLED = 2.0
"""Gain of log posterior by scoring below which each number is varied alone. After a larger gain, the next round of
scoring gains more per run of the filter."""
_FAILURES = 2
"""Failed steps in a row that scoring allows; each is at most half as long as the one before."""
_SHORTEST, _LONGEST = 0.1, 1.0
"""Shortest and longest step when one number is varied alone, in prior standard deviations. At the prior
median the shortest step changes the log prior by 0.005."""
_BLOCK = 64
"""Rows of scores per matrix product. BLAS starts threads for larger matrices; when other processes use the cores, such
a product takes up to a thousand times as long (324 ms instead of 0.4)."""
_PROMISING = 0.03
"""A number is varied alone if its slope promises a gain above this: a tenth of `_TOLERANCE`."""


class Fit(NamedTuple):
    """A fitted structure: its numbers, log posterior and log evidence (Laplace, plus `log_share`) on the same rows.

    calls: runs of the filter. deviations: σ of the numbers' logarithms (Laplace). others: samples of the posterior,
    with equal weights.
    """

    parts: Parts
    values: Values
    log_posterior: float
    evidence: float
    calls: int
    deviations: Values
    others: tuple[Values, ...]

    @property
    def at_bounds(self) -> list[str]:
        """Names of the numbers that ended at the bounds of the search."""
        priors, values = priors_of(self.parts), self.values
        furthest = {name: 0.999 * FURTHEST * prior.deviation for name, prior in priors.items()}
        return [name for name in values if abs(math.log(values[name] / priors[name].median)) > furthest[name]]


class Posterior:
    """Posterior of a structure's numbers x, each in prior standard deviations from its prior median."""

    def __init__(self, parts: Parts, rows: Rows, shortest: float = 0.0) -> None:
        self.parts, self.rows, self.calls = parts, rows, 0
        self.settling = min(_SETTLING, len(rows.time) // 3)
        priors = priors_of(parts)
        self.names = tuple(priors)
        median, self.deviations, least, most, periods, digits = np.array(list(priors.values())).T
        self.medians = np.log(median)
        least = np.maximum.reduce([least, periods * shortest, digits * max(rows.quantum)])
        if "antenna" in parts and "waves" in parts:
            least[self.names.index("yaw_period")] = max(least[self.names.index("yaw_period")], LONGEST_ROLL)
        with np.errstate(divide="ignore"):
            self.least = np.maximum((np.log(least) - self.medians) / self.deviations, -FURTHEST)
        self.most = np.minimum((np.log(most) - self.medians) / self.deviations, FURTHEST)
        self._memory = np.empty(0)

    def densities(self, x: Floats) -> Floats:
        """(n,) log density of every row, 0 for rows that do not count."""
        self.calls += 1
        model = model_of(self.parts, self.values(x), self.rows.quantum)
        m, n = len(model.modes), model.states + (model.states % 4 == 3)  # rows of whole vectors of four are faster
        if not len(self._memory):
            self._memory = np.empty(bank_size(m, n))
        self._memory[:] = 0.0
        each = np.zeros(len(self.rows.time))
        asked = Asked(_NO_OUT, each, room_to_keep(0, model), self.settling)
        run_record(self.rows, model, bank_in(self._memory, m, n), asked)
        return each

    def log(self, x: Floats, each: Floats) -> float:
        """Log posterior of x, up to a constant, by the log densities `each` of its rows."""
        value = float(each.sum()) - 0.5 * float(x @ x)
        return value if math.isfinite(value) else -math.inf

    def values(self, x: Floats) -> Values:
        """The numbers by name."""
        return dict(zip(self.names, np.exp(self.medians + self.deviations * x).tolist(), strict=True))

    def point(self, values: Values) -> Floats:
        """The point of these numbers by name; numbers that are missing stay at their prior medians."""
        x = np.zeros(len(self.names))
        for i, name in enumerate(self.names):
            if name in values:
                x[i] = (math.log(values[name]) - self.medians[i]) / self.deviations[i]
        return self.within(x)

    def within(self, x: Floats) -> Floats:
        """The nearest point within the bounds of the search."""
        return np.clip(x, np.minimum(self.least, self.most), self.most)

    def scores(self, x: Floats, each: Floats) -> Floats:
        """(numbers, n) derivative of every row's log density by every number. The score is 0 where the density jumps:
        where the density vanishes by rounding, or a decision of the filter changes."""
        steps = _DIFFERENCE * np.eye(len(x))
        scores = np.array([(self.densities(x + step) - each) / _DIFFERENCE for step in steps])
        return np.where(np.abs(scores) < _STEEPEST, scores, 0.0)


class Ascent:
    """State of the search: numbers x, log density and scores of every row, log posterior."""

    scores: Floats
    measured: Floats

    def __init__(self, posterior: Posterior, x: Floats) -> None:
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
        """Clip a step to the bounds of the search, and take it if the posterior rises. Returns the gain in either
        case."""
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
    """Take steps of scoring until one gains less than `_TOLERANCE`, or too many lower the posterior."""
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


def likeliest(
    parts: Parts, rows: Rows, starts: Sequence[Values], shortest: float = 0.0, most: int = 1
) -> list[tuple[Values, float]]:
    """The `most` likeliest starting points (dicts), each with its log posterior, the likeliest first."""
    posterior = Posterior(parts, rows, shortest)
    logs = [posterior.log(x, posterior.densities(x)) for x in map(posterior.point, starts)]
    return [(starts[i], logs[i]) for i in np.argsort(-np.array(logs), kind="stable")[:most]]


def fitted(parts: Parts, rows: Rows, start: Values, rounds: int = 2, shortest: float = 0.0, draws: int = 0) -> Fit:
    """Maximise the posterior from a starting point (dict), in at most `rounds` rounds.

    shortest: period (s) below which fixes do not resolve an oscillation. draws: number of `others` (even).
    """
    posterior = Posterior(parts, rows, shortest)
    ascent = Ascent(posterior, posterior.point(start))
    if climb(ascent, rounds):
        ascent.scores = ascent.measured  # secants of short steps are inaccurate
    elif rounds > 1:
        ascent.differentiate()
    information = ascent.information()
    with np.errstate(invalid="ignore"):
        evidence = ascent.log - 0.5 * float(np.linalg.slogdet(information)[1]) + log_share(parts)
    values = posterior.values(ascent.x)
    if not math.isfinite(evidence):
        return Fit(parts, values, -math.inf, -math.inf, posterior.calls, {}, ())
    spread = posterior.deviations * np.sqrt(np.diag(np.linalg.inv(information)))
    deviations = dict(zip(posterior.names, spread.tolist(), strict=True))
    others = drawn(posterior, ascent, information, draws)
    return Fit(parts, values, ascent.log, evidence, posterior.calls, deviations, others)


def drawn(posterior: Posterior, ascent: Ascent, information: Floats, draws: int) -> tuple[Values, ...]:
    """Samples around a maximum by the normal distribution with this information, in opposite pairs.

    A sample is moved towards the maximum if the posterior at the sample has fallen farther than the normal
    distribution. This happens where a noise is too large.
    """
    x = ascent.x
    lower = np.linalg.cholesky(information)
    others = []
    for normal in _WIDTH * np.random.default_rng(0).standard_normal((len(x), draws // 2)).T:
        expected = 0.5 * float(normal @ normal)
        for step in np.outer((1.0, -1.0), np.linalg.solve(lower.T, normal)):
            point = posterior.within(x + step)
            fall = ascent.log - posterior.log(point, posterior.densities(point))
            others.append(posterior.values(x + (point - x) * math.sqrt(min(expected / max(fall, expected), 1.0))))
    return tuple(others)
