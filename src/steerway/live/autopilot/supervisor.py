"""Supervision of the pilot aboard: when it may steer, and when it must stop.

A state machine around the pilot's control. It has no clock and no I/O: every tick gives it the row and the leg, and it
returns an order; fixes and links are reported to it.
"""

import math

from steerway.core.angles import wrap
from steerway.core.errors import InputError
from steerway.core.leg import Leg
from steerway.estimation.profiles import Profile
from steerway.estimation.profiles.inferred import InferredProfile
from steerway.estimation.tables import HeadingEstimatorTable
from steerway.guidance.reference import Reference
from steerway.live.autopilot.integrity import ReceiverMonitor, ResponseMonitor
from steerway.live.autopilot.limits import LimitGuard
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.piloting import DEFAULT_KINDS, YAW_RATE, pilot_of, response_of
from steerway.live.autopilot.speeds import MeasuredSpeed
from steerway.live.autopilot.watch import Watch
from steerway.live.base.orders import UNDER_WAY, Order, State
from steerway.live.base.rows import InputRow, Row

_SLOWEST = 1.5
"""Of the profile's steerageway: the least speed that is demanded."""
_SLOWEST_TURN = 0.5
"""Share of the route's speed that is kept in a sharp turn."""

_NO_NUMBER = "the estimate is no number"


class Supervisor:
    """Steers along the leg of each tick by its `pilot`, while everything allows it.

    route:   gives limits, fence, boat and safe output.
    profile: of the estimator; it limits the bandwidth of the course loop.
    max_dead_reckoning: time without a fix for which it steers on, s.
    engage:  start once without being asked, as soon as it is ready.
    takes:   what carries out the orders, one of `piloting.ACTUATIONS`.
    kinds:   of the autopilot and of the speed controller; see `piloting.pilot_of`.
    measured: gives the speed that is held; None: the row's.
    heading: which filter gives the heading; see `piloting.pilot_of`.
    """

    def __init__(
        self,
        route: GeodeticRoute,
        profile: Profile | InferredProfile | str = "small-usv",
        max_dead_reckoning: float = 10.0,
        engage: bool = False,
        takes: str = YAW_RATE,
        kinds: tuple[str, str] = DEFAULT_KINDS,
        measured: MeasuredSpeed | None = None,
        heading: HeadingEstimatorTable = HeadingEstimatorTable(),  # noqa: B008
    ):
        profile = Profile.named(profile) if isinstance(profile, str) else profile
        self.pilot = pilot_of(route, profile, takes, max_dead_reckoning, kinds, heading)
        self.state = State.IDLE
        self.reason = "no position yet"
        self.hands_back = route.safe == "hand-back"
        self.measured = measured
        self._slowest = _SLOWEST * profile.steerageway
        self._engage = engage
        self._was_engaged = False  # started by `engage`, not by hand
        self._vehicle = ""
        self._is_finished = True  # a start begins the route from its first leg
        self._is_new = False  # started, and no step since
        self._obstacle = self.reason
        self._watch = Watch(max_dead_reckoning)
        self._guard = LimitGuard(route.limits, route.fence)
        self._receiver, self._response = ReceiverMonitor(), None
        if takes == YAW_RATE:  # the turn that propellers make is not ordered, and is another in a current
            response = response_of(route, takes)
            self._response = ResponseMonitor(response.time, response.speed)
        self._monitors = [each for each in (self._receiver, self._response) if each]

    @property
    def begins(self) -> bool:
        """Whether the next step is the first of a route, which has to be restarted for it."""
        return self._is_new and self._is_finished

    def start(self) -> None:
        """Steer from the next step on: the route from its beginning, or on from where it was stopped.

        Raises InputError with the obstacle when that is refused.
        """
        if self.state in UNDER_WAY:
            return
        if self._obstacle:
            raise InputError(f"the autopilot cannot be started: {self._obstacle}")
        self.state, self.reason = State.RUNNING, ""
        self._is_new, self._was_engaged, self._engage = True, self._engage, False

    def stop(self, reason: str = "stopped by command") -> None:
        """The safe output from now on, until started again. A pending `engage` is withdrawn."""
        self._engage = False
        if self.state in UNDER_WAY:
            self.state, self.reason, self._is_new = State.STOPPED, reason, False

    def link(self, name: str, alive: bool) -> None:
        """Whether the peer of an output's link answers; without it the autopilot does not steer."""
        self._watch.link(name, alive)
        if not alive and self.state in UNDER_WAY:
            self.stop(f"link {name} is lost")

    def vehicle(self, obstacle: str) -> None:
        """Why the vehicle that carries out the orders could not be steered, "" when it could; under way it says so."""
        self._vehicle = obstacle

    def refused(self, reason: str) -> None:
        """The vehicle was not taken over: stopped, or ready again later where `engage` had started it."""
        if self._was_engaged and self.state in UNDER_WAY:
            self.state, self.reason, self._is_new = State.IDLE, reason, False
            self._obstacle, self._engage = reason, True
        else:
            self.stop(reason)

    def fix(self, row: Row, measured: InputRow | None = None, since: float = 0.0) -> None:
        """A fix was used, or rejected by the navigator's filter; `measured` is what the receiver gave.

        `since`: s from the last step to its arrival.
        """
        is_new = measured is not None and measured.time == row.time
        fits = self.pilot.estimator.fix(measured) if is_new else None
        if self.pilot.estimator.is_broken:
            self.stop(_NO_NUMBER)
        self._watch.fix(row, fits, since)
        if is_new:
            self._monitor(row, measured)

    def _monitor(self, row, measured):
        """Receiver and boat, by the fix and the motion that the navigator makes of positions."""
        self._receiver.fix(measured.time, measured.latitude, measured.longitude, row.sog, self._watch.interval)
        if self._response is None:
            return
        estimate = self.pilot.estimator.step(row, 0.0)
        current = estimate.current_north, estimate.current_east
        self._response.fix(row.time, row.sog, row.cog, measured.yaw_rate, current)

    def take(self, row: InputRow) -> None:
        """Whatever a link reports, used by the navigator or not."""
        self.pilot.estimator.take(row)
        if self.measured is not None:
            self.measured.take(row)

    def untimely(self) -> None:
        """A position came whose time does not follow that of the last fix."""
        self._watch.untimely()

    def step(self, row: Row, leg: Leg | None, dt: float) -> Order:
        """The order of a tick, dt s after the one before; leg None: the route is finished."""
        trouble = self._watch.step(row, dt)
        if self._response is not None:
            self._response.order(self.pilot.estimator.ordered, dt)
        if self.state in UNDER_WAY:
            self._go_on(row, leg, dt, trouble)
        self._obstacle = self._watch.obstacle(row) or self._guard.obstacle(row, leg) or self._vehicle
        if self.state in (State.IDLE, State.READY):
            self._wait()
        return self._order(row, leg, dt)

    def _go_on(self, row, leg, dt, trouble):
        if self._is_new:
            self._is_new = self._is_finished = False
            self.pilot.restart()
            self._guard.start()
            for monitor in self._monitors:
                monitor.restart()
        if leg is not None and leg.is_held and self._response is not None:
            self._response.restart()  # positions of a boat that hardly moves show no turn
        if leg is None:
            self._is_finished = True
            trouble = trouble or "the route is finished"
        if self.pilot.in_current is not None:
            trouble = trouble or self.pilot.in_current.trouble
        trouble = trouble or self._guard.step(row, leg, dt)
        trouble = trouble or next(filter(None, (each.trouble for each in self._monitors)), "")
        if trouble:
            self.stop(trouble)
        else:
            doubts = (each.doubt for each in self._monitors)
            self.reason = self._watch.degradation(row) or next(filter(None, doubts), "")
            self.state = State.DEGRADED if self.reason else State.RUNNING

    def _wait(self):
        self.state, self.reason = (State.IDLE, self._obstacle) if self._obstacle else (State.READY, "")
        if self._engage and self.state is State.READY:
            self.start()

    def _order(self, row, leg, dt):
        if self.state not in UNDER_WAY or self._is_new or leg is None:
            return self._none()
        pilot = self.pilot
        if pilot.autopilot.schedule is not None:
            pilot.autopilot.schedule.fix_interval = self._watch.interval
        estimate = pilot.estimator.step(row, dt)
        knows = pilot.uses_current(estimate)
        speed = max(self._slowest, leg.speed * (1.0 if knows else self._slowing(leg.course_to_steer)))
        if self.measured is not None:
            along = self.measured.speed(row.time)
            if math.isfinite(along):
                estimate = estimate._replace(sog=abs(along))
            pilot.measured_shaft(self.measured.shaft)
        if leg.is_held and knows and pilot.holds:
            steered = pilot.hold(leg.distance, leg.bearing, estimate, dt)
        else:
            steered = pilot.steer(Reference(leg.course_to_steer, 0.0, 0.0), speed, estimate, dt)
        if not all(map(math.isfinite, (*steered.command, estimate.north, estimate.east))):
            self.stop(_NO_NUMBER)
            pilot.estimator.restart()
            return self._none()
        return Order(self.state, self.reason, True, *steered.command, leg.course_to_steer, speed)

    def _none(self):
        """The order of an autopilot that does not steer."""
        self.pilot.estimator.order(math.nan, math.nan)
        return Order(self.state, self.reason, self.state is State.STOPPED and not self.hands_back)

    def _slowing(self, course_to_steer):
        """Share of the route's speed, by the turn that the reference has still to make."""
        reference = self.pilot.autopilot.shaper.reference
        turn = 0.0 if reference is None else wrap(course_to_steer - reference.angle)
        return max(_SLOWEST_TURN, math.cos(turn)) if math.isfinite(turn) else 1.0
