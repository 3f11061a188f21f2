"""Maximum likelihood, or a posteriori, over the parameters of a profile.

Scoring as E. K. Berndt, B. H. Hall, R. E. Hall and J. A. Hausman have it (Annals of Economic and Social Measurement
3(4), 1974), damped after Levenberg and Marquardt. Innovations hardly depend on one another, so the sum of the outer
products of their scores is how curved the likelihood is: first differences are all that a step takes, and a ridge,
along which two parameters make up for each other, is followed and not searched. Differences to one side do.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from steerway.estimation.profiles import Profile

_DIFFERENCE, _SMALL_DIFFERENCE = 0.03, 1e-3
"""Of a logarithm: to both sides of the bottom, which is broad, and to one side on the way there."""
_LONGEST_STEP = 2.0
"""Of a logarithm in a step: a factor of seven."""
_LEAST_GAIN = 0.02
"""−log likelihood that a step has to gain: far below the 2 at which models differ."""
_DAMPING, _HOPELESS = 1e-2, 1e4
"""Of Levenberg and Marquardt: at the start, and where no step helps any more."""


@dataclass(frozen=True)
class Search:
    """Parameters of a profile to be found, in logarithms: what is minimised is −log likelihood plus that of a prior.

    `row_nll` gives (n,) −log likelihoods of rows under a profile; `expected` the prior's median and its deviation of
    the logarithm by name, `bounds` the least and the largest value.
    """

    row_nll: Callable[[Profile], np.ndarray]
    base: Profile
    names: tuple[str, ...]
    expected: dict[str, tuple[float, float]]
    bounds: dict[str, tuple[float, float]]
    step: Callable[[], None] = field(default=lambda: None)

    def profile(self, logs) -> Profile:
        """The profile with these logarithms of its parameters."""
        return self.base.model_copy(update=dict(zip(self.names, np.exp(logs).tolist(), strict=True)))

    def logs(self, profile: Profile) -> np.ndarray:
        """(p,) and the logarithms of a profile, brought within the bounds."""
        return np.clip(np.log([max(getattr(profile, name), 1e-300) for name in self.names]), *self.limits)

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """(p,), (p,): the logarithms of the bounds."""
        low, high = np.log([self.bounds[name] for name in self.names]).T
        return low, high

    @property
    def prior(self) -> tuple[np.ndarray, np.ndarray]:
        """(p,), (p,): mean and variance of the logarithms."""
        median, spread = np.array([self.expected[name] for name in self.names]).T
        return np.log(median), spread**2

    def rows(self, logs) -> np.ndarray:
        """(n,) −log likelihoods of the rows."""
        self.step()
        return self.row_nll(self.profile(logs))

    def total(self, rows, logs) -> float:
        """What is minimised, from the −log likelihoods of the rows."""
        mean, variance = self.prior
        return float(rows.sum() + 0.5 * ((logs - mean) ** 2 / variance).sum())

    def value(self, logs) -> float:
        """What is minimised."""
        return self.total(self.rows(logs), logs)

    def values(self, points) -> np.ndarray:
        """(k,) the same at points (k, p), on all cores."""
        return np.array(_at_once(self.value, points))

    def scores(self, logs, here=None) -> np.ndarray:
        """(n, p) derivatives of the rows' −log likelihood by each logarithm; the prior is not in them.

        By differences to both sides, or, where the −log likelihoods (n,) `here` are given, to one side only.
        """
        directions = np.eye(len(logs))
        if here is not None:
            ahead = np.array(_at_once(self.rows, logs + _SMALL_DIFFERENCE * directions))
            return (ahead - here).T / _SMALL_DIFFERENCE
        shifts = _DIFFERENCE * np.concatenate([directions, -directions])
        ahead, behind = np.split(np.array(_at_once(self.rows, logs + shifts)), 2)
        return (ahead - behind).T / (2.0 * _DIFFERENCE)


def _at_once(task, arguments) -> list:
    with ThreadPoolExecutor(min(len(arguments), os.cpu_count() or 1)) as pool:
        return list(pool.map(task, arguments))


@dataclass(frozen=True)
class Fit:
    """The end of a search."""

    profile: Profile
    cost: float  # −log likelihood with that of the prior
    search: Search

    @property
    def logs(self) -> np.ndarray:
        """(p,) logarithms of the parameters found."""
        return self.search.logs(self.profile)


def minimise(search: Search, start: Profile, steps: int = 40) -> Fit:
    """Follow the likelihood from the parameters of `start`, at most so many steps."""
    logs, damping = search.logs(start), _DAMPING
    rows = search.rows(logs)
    value = search.total(rows, logs)
    (low, high), (mean, variance) = search.limits, search.prior
    for _ in range(steps):
        scores = search.scores(logs, rows)
        slope = scores.sum(axis=0) + (logs - mean) / variance
        curvature = scores.T @ scores + np.diag(1.0 / variance)
        free = ~((logs <= low) & (slope > 0.0) | (logs >= high) & (slope < 0.0))
        before = value
        while damping < _HOPELESS:
            change = _damped(slope, curvature, free, damping)
            if -0.5 * slope @ change < _LEAST_GAIN * min(damping, 1.0):
                break
            trial = np.clip(logs + change, low, high)
            tried = search.rows(trial)
            if search.total(tried, trial) < value:
                logs, rows, value, damping = trial, tried, search.total(tried, trial), max(damping / 5.0, 1e-4)
                break
            damping *= 5.0
        if before - value < _LEAST_GAIN:
            break
    return Fit(search.profile(logs), value, search)


def _damped(slope, curvature, free, damping):
    change = np.zeros(len(slope))
    chosen = curvature[np.ix_(free, free)]
    change[free] = -np.linalg.solve(chosen + damping * np.diag(np.diag(chosen)), slope[free])
    return change * min(1.0, _LONGEST_STEP / max(np.abs(change).max(initial=0.0), 1e-12))
