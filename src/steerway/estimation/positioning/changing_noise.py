"""Noise that changes. Noise of process or fixes may depend on the estimated velocity, P2 (19)–(20) and the text beside
them. Noise of fixes may also be estimated from their innovations, by variational Bayes.

S. Särkkä and A. Nummenmaa (2009), Recursive noise adaptive Kalman filtering by variational Bayesian approximations,
IEEE Transactions on Automatic Control 54(3), algorithm 1. The variance of each direction is inverse-gamma. Between
fixes its evidence decays; at a fix, state and variance are estimated in turn.
"""

import math
from dataclasses import dataclass

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.kalman import Fix, correct, innovation
from steerway.estimation.positioning.vessel_filter import waves_in

_ITERATIONS = 5
"""Iterations of the fixed point in Särkkä and Nummenmaa's algorithm. For a fix at 4σ the variance is then within 0.2 %
of the fixed point, for a fix at 1.5σ within 10⁻⁶."""


@kernel
def saturated(speed: float, low: float, high: float) -> float:
    """|speed| held between `low` and `high`: the intention of (20). As printed, (20) is 0.25 for every speed."""
    return min(max(abs(speed), low), high)


@dataclass(frozen=True)
class TimeVaryingNoise:
    """Densities of the surge, sway and yaw acceleration for an estimated velocity: s (1 + c/f(û)^power), P2 (19).

    With `power` 1 this is the formula, with 2 the text beside it. `scale` s for surge and sway, `yaw` for the turn, 1
    in (19). Equal `low` and `high` make the noise constant.
    """

    coefficient: float = 2.5
    low: float = 0.25
    high: float = 0.5
    power: float = 1.0
    scale: float = 1.0
    yaw: float = 1.0

    def __post_init__(self) -> None:
        positive("time_varying.low", self.low)
        if not self.high >= self.low:
            raise InputError(f"time_varying.high is {self.high}, expected at least low, {self.low}")
        for name in ("coefficient", "power", "scale", "yaw"):
            not_negative(f"time_varying.{name}", getattr(self, name))

    def __call__(self, surge: float, sway: float) -> tuple[float, float, float]:
        return self._of(surge), self._of(sway), self.yaw

    def _of(self, speed: float) -> float:
        return self.scale * (1.0 + self.coefficient / saturated(speed, self.low, self.high) ** self.power)


@dataclass(frozen=True)
class SpeedDependentFixNoise:
    """A `FixNoise` (see `vessel_filter`) whose 1σ is that at rest times 1 + V/`doubling`, V the estimated speed (m/s).

    P2's text says that measurements are worse at speed: a statement about R, not about Q.
    """

    std: float
    doubling: float

    def __post_init__(self) -> None:
        positive("fix_noise.std", self.std)
        positive("fix_noise.doubling", self.doubling)

    def start(self, variances: tuple[float, float]) -> None:
        """Do nothing: the noise at rest is a parameter."""

    def expected(self, x: Floats) -> tuple[float, float]:
        if len(x) < 5:
            raise InputError(f"x has {len(x)} states, expected north, east, heading, surge and sway first")
        variance = (self.std * (1.0 + math.hypot(x[3], x[4]) / self.doubling)) ** 2
        return variance, variance

    def learned(self, x: Floats, p: Floats, north: float, east: float) -> tuple[float, float]:
        return self.expected(x)


@kernel
def learn(x: Floats, p: Floats, north: float, east: float, shape: Floats, scale: Floats, fading: float) -> None:
    """Update the two inverse-gamma densities (shape (2,), scale (2,)) by a fix, in place; x and P do not change."""
    n, fix = len(x), Fix(north, east, 0.0, 0.0)
    x_after, p_after, work = np.empty(n), np.empty((n, n)), np.empty((2, n))
    for i in range(2):
        shape[i] = fading * shape[i] + 0.5
        scale[i] *= fading
    posterior = scale * 1.0
    for _ in range(_ITERATIONS):
        x_after[:], p_after[:] = x, p
        expected = Fix(north, east, posterior[0] / shape[0], posterior[1] / shape[1])
        correct(x_after, p_after, work, expected, waves_in(x))
        left = innovation(x_after, p_after, fix, waves_in(x))
        posterior[0] = scale[0] + 0.5 * (left.north * left.north + left.nn)
        posterior[1] = scale[1] + 0.5 * (left.east * left.east + left.ee)
    scale[:] = posterior


class VariationalNoise:
    """A `FixNoise` (see `vessel_filter`) that estimates the variances of fixes, north and east separately.

    `memory`: number of fixes over which the evidence decays; `confidence`: number of fixes for which the
    initial variance counts.
    Raises InputError for a memory that is not above 1.
    """

    def __init__(self, memory: float = 10.0, confidence: float = 2.0) -> None:
        if not 1.0 < memory < math.inf:
            raise InputError(f"variational_noise.memory is {memory} fixes, expected more than 1")
        self._fading = 1.0 - 1.0 / memory
        self._confidence = positive("variational_noise.confidence", confidence)
        self._shape, self._scale = np.empty(0), np.empty(0)

    def start(self, variances: tuple[float, float]) -> None:
        """Begin from the variances (north, east) of `noise.position_std`."""
        self._shape = np.full(2, 0.5 * self._confidence)
        self._scale = self._shape * variances

    def expected(self, x: Floats) -> tuple[float, float]:
        return self._variances()

    def learned(self, x: Floats, p: Floats, north: float, east: float) -> tuple[float, float]:
        if x.ndim != 1 or len(x) < 2 or p.shape != (len(x), len(x)):
            raise InputError(f"x and p have shapes {x.shape} and {p.shape}, expected (n,) and (n, n)")
        self._variances()
        learn(x, p, north, east, self._shape, self._scale, self._fading)
        return self._variances()

    def _variances(self) -> tuple[float, float]:
        if not len(self._scale):
            raise InputError("the variances are not known, expected a call of start() before")
        north, east = (self._scale / self._shape).tolist()
        return north, east
