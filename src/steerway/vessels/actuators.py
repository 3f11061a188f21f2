"""Limits, rate and lag of an actuator, as data for controllers and vessels."""

import math
from dataclasses import dataclass

from steerway.core.following import follow

__all__ = ["Actuator", "follow"]


class Actuated:
    """A vessel, whose representation names her actuators."""

    actuators: tuple["Actuator", ...]

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {', '.join(each.name for each in self.actuators)}"


@dataclass(frozen=True)
class Actuator:
    """One actuator: it takes commands from `low` to `high` and follows with `lag` s, at most `rate` a second."""

    name: str
    low: float
    high: float
    rate: float = math.inf
    lag: float = 0.0
