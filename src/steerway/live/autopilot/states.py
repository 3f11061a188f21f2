"""The autopilot aboard: when it may steer, what it orders, and when it must let go.

A state machine in front of a control law. No clock of its own and no I/O: it is told the row and the leg of every tick
and says an order; what it knows of links and fixes it was told.
"""

import math
from enum import StrEnum
from typing import NamedTuple

from steerway.core.errors import InputError
from steerway.estimation.profiles import Profile
from steerway.formats.nmea0183.writing import Leg
from steerway.live.autopilot.limits import LimitGuard
from steerway.live.autopilot.mission import Boat, GeodeticRoute, Limits
from steerway.live.autopilot.steering import Steering
from steerway.live.autopilot.watch import Watch
from steerway.live.heard import Row


class State(StrEnum):
    """Idle until it knows enough; ready to be started; then it steers until it is stopped, and stays stopped."""

    IDLE = "idle"
    READY = "ready"
    RUNNING = "running"
    DEGRADED = "degraded"  # steers, on dead reckoning or against fixes that do not fit
    STOPPED = "stopped"


UNDER_WAY = (State.RUNNING, State.DEGRADED)
FIT = (State.READY, *UNDER_WAY)
"""States in which what is said of the leg may be steered by."""


class Order(NamedTuple):
    """What the vessel is to do; SI and rad. Whoever carries out orders carries out those that are `engaged`, only."""

    state: State
    reason: str = ""  # why it is not running, "" when all is well
    engaged: bool = False  # whether what follows is to be carried out; also of the safe output "stop"
    yaw_rate: float = 0.0  # rad/s, + to starboard
    thrust: float = 0.0  # fraction of full, -1 to 1
    port: float = 0.0  # propellers, -1 to 1 of full speed
    starboard: float = 0.0
    course: float = math.nan  # to steer, rad; NaN when unknown
    speed: float = math.nan  # asked over ground, m/s


class Autopilot:
    """Follows the leg it is told of, one step a tick.

    route:    what limits, fence, boat and safe output are taken from; without one those of `Settings`.
    profile:  of the estimator, to which the control law submits.
    patience: s without a fix for which it steers by dead reckoning.
    engage:   start by itself once, as soon as it is ready.
    """

    def __init__(
        self,
        route: GeodeticRoute | None = None,
        profile: Profile | str = "small-usv",
        patience: float = 10.0,
        engage: bool = False,
    ):
        limits, fence, boat = (Limits(), None, Boat()) if route is None else (route.limits, route.fence, route.boat)
        self.state = State.IDLE
        self.reason = "no position yet"
        self.hands_back = route is not None and route.safe == "hand-back"
        self._engage = engage
        self._has_route = route is not None
        self._is_done = True  # no leg of the route is under way that a start would go on with
        self._fresh = False  # started, and not stepped since
        self._obstacle = self.reason
        self._watch = Watch(patience)
        self._guard = LimitGuard(limits, fence)
        self._steering = Steering(boat, Profile.named(profile) if isinstance(profile, str) else profile)

    @property
    def begins(self) -> bool:
        """Whether the next step is the first of a route, which is to begin anew for it."""
        return self._fresh and self._is_done

    def start(self) -> None:
        """Steer from the next step on: the route from its beginning, or on from where it was stopped.

        Raises InputError in words when that is refused.
        """
        if self.state in UNDER_WAY:
            return
        if self._obstacle:
            raise InputError(f"the autopilot cannot be started: {self._obstacle}")
        self.state, self.reason = State.RUNNING, ""
        self._fresh, self._engage = True, False

    def stop(self, reason: str = "told to stop") -> None:
        """Let go: the safe output from now on, until started again. It withdraws an `engage` that has yet to happen."""
        self._engage = False
        if self.state in UNDER_WAY:
            self.state, self.reason, self._fresh = State.STOPPED, reason, False

    def link(self, name: str, alive: bool) -> None:
        """Whether the other end of an output's link is there; without it the autopilot does not steer."""
        self._watch.link(name, alive)
        if not alive and self.state in UNDER_WAY:
            self.stop(f"link {name} is lost")

    def fix(self, row: Row) -> None:
        """A fix was taken, or rejected by the filter's gate."""
        self._watch.fix(row)

    def astray(self) -> None:
        """A position was heard whose time does not follow that of the last fix."""
        self._watch.astray()

    def step(self, row: Row, leg: Leg | None, dt: float) -> Order:
        """The order of a tick, dt s after the one before."""
        trouble = self._watch.step(row, dt)
        if self.state in UNDER_WAY:
            self._go_on(row, leg, dt, trouble)
        self._obstacle = self._watch.obstacle(row) or self._missing_leg(leg) or self._guard.obstacle(row, leg)
        if self.state in (State.IDLE, State.READY):
            self._wait()
        return self._order(row, leg, dt)

    def _go_on(self, row, leg, dt, trouble):
        if self._fresh:
            self._fresh = self._is_done = False
            self._steering.start(row)
            self._guard.start()
        if leg is None:
            self._is_done = True
            trouble = trouble or "the route is finished"
        trouble = trouble or self._guard.step(row, leg, dt)
        if trouble:
            self.stop(trouble)
        else:
            self.reason = self._watch.doubt(row)
            self.state = State.DEGRADED if self.reason else State.RUNNING

    def _missing_leg(self, leg):
        return "" if leg is not None or (self._has_route and self._is_done) else "no route"

    def _wait(self):
        self.state, self.reason = (State.IDLE, self._obstacle) if self._obstacle else (State.READY, "")
        if self._engage and self.state is State.READY:
            self.start()

    def _order(self, row, leg, dt):
        if self.state not in UNDER_WAY or self._fresh or leg is None:
            return Order(self.state, self.reason, self.state is State.STOPPED and not self.hands_back)
        command = self._steering.step(row, leg, self._watch.interval, dt)
        return Order(self.state, self.reason, True, *command)
