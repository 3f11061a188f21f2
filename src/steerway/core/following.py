"""How an actuator follows its commands: limits, lag and rate."""

import math

from steerway.core.compiled import kernel


@kernel
def follow(value, command, low, high, rate, lag, step):
    """Position after `step` s of one command of an actuator at `value`: exact lag, then limited to its rate."""
    wanted = min(max(command, low), high)
    change = wanted - value
    if lag > 0.0:
        change *= -math.expm1(-step / lag)
    most = rate * step
    return value + min(max(change, -most), most)
