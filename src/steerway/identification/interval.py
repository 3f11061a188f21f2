"""An estimate with its interval, and the covariance of a maximum-likelihood estimate."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.statistics import NORMAL_95


class Interval(NamedTuple):
    """A value with the ends of its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def around(cls, value: float, std: float) -> "Interval":
        """The interval of a value whose error is normal."""
        return cls(float(value), float(value - NORMAL_95 * std), float(value + NORMAL_95 * std))

    @classmethod
    def around_positive(cls, value: float, log_std: float) -> "Interval":
        """The interval of a positive value whose logarithm's error is normal."""
        reach = math.exp(min(NORMAL_95 * log_std, 700.0))
        return cls(value, value / reach, value * reach)

    def __str__(self) -> str:
        return f"{self.value:.4g} ({self.low:.4g} to {self.high:.4g})"

    def __contains__(self, value: object) -> bool:
        return isinstance(value, float | int) and self.low <= value <= self.high


def covariance(cost: Callable[[np.ndarray], float], optimum: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """(n, n) covariance of a maximum-likelihood estimate: the inverse curvature of −log L by central differences.

    optimum: (n,); steps: (n,), first guesses of the steps that raise −log L by about a half, which is one σ. A
    direction that the data do not determine gets a variance of 1e12.
    """
    n = len(optimum)
    centre = cost(optimum)
    offsets = np.diag([_deviation(cost, optimum, centre, i, steps[i]) for i in range(n)])
    curvature = np.empty((n, n))
    for i in range(n):
        curvature[i, i] = cost(optimum + offsets[i]) - 2.0 * centre + cost(optimum - offsets[i])
        for j in range(i):
            along, against = offsets[i] + offsets[j], offsets[i] - offsets[j]
            mixed = cost(optimum + along) + cost(optimum - along) - cost(optimum + against) - cost(optimum - against)
            curvature[i, j] = curvature[j, i] = 0.25 * mixed
    values, vectors = np.linalg.eigh(curvature)
    known = values > 1e-6
    spread = np.where(known, 1.0 / np.where(known, values, 1.0), 1e12)
    taken = np.diag(offsets)
    return (vectors * spread) @ vectors.T * np.outer(taken, taken)


def _deviation(cost: Callable[[Floats], float], optimum: Floats, centre: float, i: int, step: float) -> float:
    """Step of parameter i that raises −log L by about a half (0.1 to 1), searched from a first guess."""
    offset = np.zeros(len(optimum))
    for _ in range(60):
        offset[i] = step
        rise = 0.5 * (cost(optimum + offset) + cost(optimum - offset)) - centre
        if 0.1 <= rise <= 1.0:
            break
        step *= 0.5 if not rise < 1.0 else min(4.0, max(1.2, math.sqrt(0.5 / max(rise, 1e-3))))
        if step > 1e9:
            break
    return step
