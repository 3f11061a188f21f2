"""The autopilot aboard: when it may steer, what it orders, and when it must let go.

A state machine in front of a control law. No clock of its own and no I/O: it is told the row and the leg of every tick
and says an order; what it knows of links and fixes it was told.
"""

import math
from enum import StrEnum
from typing import NamedTuple

from steerway.angles import wrap
from steerway.errors import InputError
from steerway.formats.nmea0183.writing import Leg
from steerway.live.heard import Row


class State(StrEnum):
    """Idle until it knows enough; ready to be started; then it steers until it is stopped, and stays stopped."""

    IDLE = "idle"
    READY = "ready"
    RUNNING = "running"
    DEGRADED = "degraded"
    STOPPED = "stopped"


class Order(NamedTuple):
    """What the vessel is to do; SI and rad. Whoever carries out orders carries out those that are `engaged`, only."""

    state: State
    reason: str = ""  # why it is not running, "" when all is well
    engaged: bool = False  # whether what follows is to be carried out; also of the safe output "stop"
    yaw_rate: float = 0.0  # rad/s, + to starboard
    thrust: float = 0.0  # fraction of full, -1 to 1
    port: float = 0.0  # propellers, -1 to 1
    starboard: float = 0.0
    course: float = math.nan  # to steer, rad; NaN when unknown
    speed: float = math.nan  # asked over ground, m/s


class Autopilot:
    """Follows the leg it is told of, one step a tick."""

    def __init__(self):
        self.state = State.IDLE
        self.reason = "no position yet"
        self._links: dict[str, bool] = {}

    def start(self) -> None:
        """Steer from the next step on. Raises InputError in words when that is refused."""
        if self.state in (State.RUNNING, State.DEGRADED):
            return
        if self.state is State.IDLE:
            raise InputError(f"the autopilot is not ready: {self.reason}")
        self.state, self.reason = State.RUNNING, ""

    def stop(self, reason: str = "told to stop") -> None:
        """Let go: the safe output from now on, until started again."""
        if self.state in (State.RUNNING, State.DEGRADED):
            self.state, self.reason = State.STOPPED, reason

    def link(self, name: str, alive: bool) -> None:
        """Whether an output's other end is there; while one that was there is not, the autopilot does not steer."""
        self._links[name] = alive
        if not alive:
            self.stop(f"link {name} is lost")

    def fix(self, row: Row) -> None:
        """A fix was taken."""

    def step(self, row: Row, leg: Leg | None, dt: float) -> Order:
        """The order of a tick, dt s after the one before."""
        known = row.valid and not math.isnan(row.cog) and leg is not None and not math.isnan(leg.course_to_steer)
        if self.state in (State.IDLE, State.READY):
            self.state, self.reason = (State.READY, "") if known else (State.IDLE, "course or route unknown")
        elif not known:
            self.stop("course or route unknown")
        if self.state is State.RUNNING:
            rate = 0.3 * wrap(leg.course_to_steer - row.cog)
            return Order(self.state, "", True, rate, 0.5, 0.5 + rate, 0.5 - rate, leg.course_to_steer)
        return Order(self.state, self.reason, engaged=self.state is State.STOPPED)
