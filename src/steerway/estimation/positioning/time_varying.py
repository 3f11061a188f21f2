"""Noise that follows the estimated velocity: of the motion, P2 (19)–(20), and of fixes, what its text speaks of."""

import math
from dataclasses import dataclass

from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError


@kernel
def saturated(speed, low, high):
    """|speed| held between `low` and `high`: what (20) is to do; as printed it is 0.25 for every speed."""
    return min(max(abs(speed), low), high)


@dataclass(frozen=True)
class TimeVaryingNoise:
    """Densities of the surge, sway and yaw acceleration for an estimated velocity: s (1 + c/f(û)^power), P2 (19).

    `power` 1 is the formula, 2 the text beside it. `scale` s for surge and sway, `yaw` for the turn, which (19) keeps
    at 1. Equal `low` and `high` make the noise constant.
    """

    coefficient: float = 2.5
    low: float = 0.25
    high: float = 0.5
    power: float = 1.0
    scale: float = 1.0
    yaw: float = 1.0

    def __post_init__(self):
        positive("time_varying.low", self.low)
        if not self.high >= self.low:
            raise InputError(f"time_varying.high is {self.high}, expected at least low, {self.low}")
        for name in ("coefficient", "power", "scale", "yaw"):
            not_negative(f"time_varying.{name}", getattr(self, name))

    def __call__(self, surge: float, sway: float) -> tuple[float, float, float]:
        return self._of(surge), self._of(sway), self.yaw

    def _of(self, speed):
        return self.scale * (1.0 + self.coefficient / saturated(speed, self.low, self.high) ** self.power)


@dataclass(frozen=True)
class SpeedDependentFixNoise:
    """A `FixNoise` (see `vessel_filter`) whose 1σ is that at rest times 1 + V/`doubling`, V the estimated speed (m/s).

    P2's text has measurements worse at speed; that is a statement about R, not about Q.
    """

    std: float
    doubling: float

    def __post_init__(self):
        positive("fix_noise.std", self.std)
        positive("fix_noise.doubling", self.doubling)

    def start(self, variances) -> None:
        """Nothing to remember: the noise at rest is its own."""

    def expected(self, x) -> tuple[float, float]:
        variance = (self.std * (1.0 + math.hypot(x[3], x[4]) / self.doubling)) ** 2
        return variance, variance

    def learned(self, x, p, north: float, east: float) -> tuple[float, float]:
        return self.expected(x)
