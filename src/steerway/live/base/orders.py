"""The state of the autopilot aboard and the order of one tick, as the outputs get them."""

import math
from enum import StrEnum
from typing import NamedTuple


class State(StrEnum):
    """Idle until all conditions are met; ready to be started; under way until stopped; stopped until started again."""

    IDLE = "idle"
    READY = "ready"
    RUNNING = "running"
    DEGRADED = "degraded"  # steers, by dead reckoning, with fixes that do not fit, or after a late tick
    STOPPED = "stopped"


UNDER_WAY = (State.RUNNING, State.DEGRADED)
FIT = (State.READY, *UNDER_WAY)
"""States in which another autopilot may steer by the leg."""


class Order(NamedTuple):
    """What the vessel is commanded; SI and rad. An order is carried out only while it is `engaged`."""

    state: State
    reason: str = ""  # why the state is not RUNNING, "" when it is
    engaged: bool = False  # whether the command is to be carried out; also the safe output "stop"
    yaw_rate: float = 0.0  # rad/s, + to starboard
    thrust: float = 0.0  # fraction of full, -1 to 1
    port: float = 0.0  # propellers, -1 to 1 of full speed
    starboard: float = 0.0
    course: float = math.nan  # to steer, rad; NaN when unknown
    speed: float = math.nan  # desired over ground, m/s
