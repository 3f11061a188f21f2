"""How an actuator follows its commands: limits, lag and rate."""

import math

from steerway.core.compiled import kernel


@kernel
def follow(value: float, command: float, low: float, high: float, rate: float, lag: float, step: float) -> float:
    """Position after `step` s of one command of an actuator at `value`: exact lag, then limited to its rate."""
    wanted = min(max(command, low), high)
    change = wanted - value
    if lag > 0.0:
        change *= -math.expm1(-step / lag)
    most = rate * step
    return value + min(max(change, -most), most)
