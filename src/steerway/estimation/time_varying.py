"""Process noise that follows the estimated velocity, P2 (19)–(20)."""

from dataclasses import dataclass

from steerway.checks import not_negative, positive
from steerway.compiled import kernel
from steerway.errors import InputError


@kernel
def saturated(speed, low, high):
    """|speed| held between `low` and `high`: what (20) is to do. Printed, min(max(x, 0.5), 0.25) is 0.25 for every x."""
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
