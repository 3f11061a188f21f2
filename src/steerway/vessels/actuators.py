"""What an actuator can do, as data: controllers saturate by it, vessels obey it."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Actuator:
    """One actuator: it takes commands from `low` to `high` and follows with `lag` s, at most `rate` a second."""

    name: str
    low: float
    high: float
    rate: float = math.inf
    lag: float = 0.0
