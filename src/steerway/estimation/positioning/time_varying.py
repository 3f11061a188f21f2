"""Noise that depends on the estimated velocity: process noise, P2 (19)–(20), and measurement noise as in its text."""

import math
from dataclasses import dataclass

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError


@kernel
def saturated(speed: float, low: float, high: float) -> float:
    """|speed| held between `low` and `high`: the intention of (20); as printed it is 0.25 for every speed."""
    return min(max(abs(speed), low), high)


@dataclass(frozen=True)
class TimeVaryingNoise:
    """Densities of the surge, sway and yaw acceleration for an estimated velocity: s (1 + c/f(û)^power), P2 (19).

    `power` 1 is the formula, 2 the text beside it. `scale` s for surge and sway, `yaw` for the turn, 1 in (19).
    Equal `low` and `high` make the noise constant.
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
        """Nothing: the noise at rest is a parameter."""

    def expected(self, x: Floats) -> tuple[float, float]:
        if len(x) < 5:
            raise InputError(f"x has {len(x)} states, expected north, east, heading, surge and sway first")
        variance = (self.std * (1.0 + math.hypot(x[3], x[4]) / self.doubling)) ** 2
        return variance, variance

    def learned(self, x: Floats, p: Floats, north: float, east: float) -> tuple[float, float]:
        return self.expected(x)
