"""Actuation by shaft speed: a force becomes a shaft speed by thrust = gain · n|n|; beside it a yaw moment, or none."""

import math
from dataclasses import dataclass

from steerway.control.speed_guess import signed_root, signed_square
from steerway.core.checks import not_negative, positive


@dataclass(frozen=True)
class ShaftSpeed:
    """One command, the shaft speed (rev/s) from `low` to `high`; `gain` in N per (rev/s)². Yaw is not actuated."""

    gain: float
    high: float
    low: float = 0.0

    def __post_init__(self):
        positive("shaft.gain", self.gain)
        positive("shaft.high", self.high)
        not_negative("shaft.low", -self.low)

    def turning(self, surge_force: float) -> tuple[float, float]:
        """(shaft speed, force it gives at rest) for a force (N)."""
        shaft = min(max(signed_root(surge_force / self.gain), self.low), self.high)
        return shaft, self.gain * signed_square(shaft)

    def step(self, surge_force: float, yaw: float) -> tuple[float, float, float]:
        """(shaft speed, achieved force, achieved yaw) for a force (N)."""
        shaft, force = self.turning(surge_force)
        return shaft, force, 0.0


@dataclass(frozen=True)
class ShaftAndMoment(ShaftSpeed):
    """Two commands, the shaft speed and a yaw moment within ± `moment` N·m."""

    moment: float = math.inf

    def step(self, surge_force: float, yaw: float) -> tuple[float, float, float, float]:
        """(shaft speed, yaw moment, achieved force, achieved moment) for a force (N) and a moment (N·m)."""
        shaft, force = self.turning(surge_force)
        moment = min(max(yaw, -self.moment), self.moment)
        return shaft, moment, force, moment
