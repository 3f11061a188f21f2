"""Limits, rate and lag of an actuator, as data for controllers and vessels."""

import math
from dataclasses import dataclass

from steerway.core.compiled import kernel


@dataclass(frozen=True)
class Actuator:
    """One actuator: it takes commands from `low` to `high` and follows with `lag` s, at most `rate` a second."""

    name: str
    low: float
    high: float
    rate: float = math.inf
    lag: float = 0.0


@kernel
def follow(value, command, low, high, rate, lag, step):
    """The position of an `Actuator` at `value` after `step` s of one command: exact lag, then limited to its rate."""
    wanted = min(max(command, low), high)
    change = wanted - value
    if lag > 0.0:
        change *= -math.expm1(-step / lag)
    most = rate * step
    return value + min(max(change, -most), most)
