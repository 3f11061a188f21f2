"""Supervision of the pilot aboard: when it may steer, and when it must stop.

A state machine that observes the pilot (`pilot.Observer`). It has no clock and no I/O: every tick gives it the row, and
it returns an order; fixes and links are reported to it.
"""

import logging
import math
from collections.abc import Sequence

from steerway.control.turns import Turn
from steerway.core.angles import wrap
from steerway.core.errors import InputError
from steerway.core.estimate import Estimate
from steerway.core.leg import Leg, LegState
from steerway.core.reference import Reference
from steerway.estimation.vessel.inferred import InferredProfile, profile_of
from steerway.estimation.vessel.profile import Profile
from steerway.guidance.waypoints import Phase
from steerway.live.autopilot.guide import POSITION, ROUTE
from steerway.live.autopilot.integrity import ReceiverMonitor, TurnMonitor
from steerway.live.autopilot.limits import LimitGuard
from steerway.live.autopilot.measured import measured_speed
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.mission_items import MissionItem
from steerway.live.autopilot.piloting import YAW_RATE, boat_of, limit_thrust, limit_turns, pilot_of
from steerway.live.autopilot.watch import Watch
from steerway.live.rows import UNDER_WAY, InputRow, Order, Row, State
from steerway.live.settings import EstimatorSettings
from steerway.pilot import DEFAULT_KINDS, Mode, Pilot, Steered

LOG = logging.getLogger("steerway.live")
_SLOWEST = 1.5
"""Share of the profile's steerageway that is the least speed demanded."""
_SLOWEST_TURN = 0.5
"""Share of the route's speed that is kept in a sharp turn."""

_FAR = 2000.0
"""m from the boat to the first leg, beyond which it has to be asked for."""
_TURN = "turns by %+.0f° into leg %d, %s"
_LOST, _AGAIN = " is lost", "; it is back, and the autopilot can be started again"
_NO_NUMBER = "the estimate is no number"


class Supervisor:
    """Lets its `pilot` steer along the leg of each tick, while everything allows it.

    route:   what is followed, with limits, fence, boat and safe output.
    profile: of the estimator, None for the prior; it limits the bandwidth of the course loop.
    max_dead_reckoning: time without a fix for which it steers on, s.
    engage:  start once without being asked, as soon as it is ready.
    takes:   what carries out the orders, one of `piloting.ACTUATIONS`.
    kinds:   of the autopilot and of the speed controller; see `build.build_pilot`.
    estimators: which filters give the heading (see `piloting.pilot_of`) and the speed that is held.
    from_here: whether the first leg may be as far away as it is.
    """

    def __init__(
        self,
        route: GeodeticRoute,
        profile: Profile | InferredProfile | str | None = None,
        max_dead_reckoning: float = 10.0,
        engage: bool = False,
        takes: str = YAW_RATE,
        kinds: tuple[str, str] = DEFAULT_KINDS,
        estimators: EstimatorSettings = EstimatorSettings(),  # noqa: B008
        from_here: bool = False,
    ):
        profile = profile_of(profile)
        built = pilot_of(route, profile, takes, kinds, estimators.heading, self)  # type: ignore[arg-type]
        self.estimator, self.guide, self.pilot = built
        self.leg: Leg | None = None  # of the last tick, None when the route is finished
        self.state = State.IDLE
        self.reason = "no position yet"
        self._safe, self._on_stop = route.settings.safe, route.settings.on_stop
        self.hands_back = self._safe == "hand-back"
        self._silent, self._operator_lost = 0.0, route.settings.limits.operator_lost or math.inf
        self._instead = ""  # why a position is held in place of the route
        self.measured = measured_speed(estimators.speed)
        self._slowest = _SLOWEST * profile.steerageway
        self._engage, self._from_here = engage, from_here
        self._was_engaged = False  # started by `engage`, not by hand
        self._vehicle = ""
        self._is_finished = True  # a start begins the route from its first leg
        self._is_new = False  # started, and no step since
        self._thrust = math.nan
        self._turn: Turn | None = None  # that was said last
        self._obstacle = self.reason
        self._watch = Watch(max_dead_reckoning)
        self._trouble, self._speed = "", math.nan  # of the tick: why to stop, and the speed of the leg
        self._guard = LimitGuard(route.settings.limits, route.fence, route.settings.lookahead_m, route.no_go)
        self._receiver = ReceiverMonitor()
        self._turns: TurnMonitor | None = None
        if takes == YAW_RATE:  # the turn that propellers make is not ordered, and is another in a current
            self._turns = TurnMonitor(boat_of(route, takes), route.settings.boat.max_yaw_rate_dps)
        self._monitors = [each for each in (self._receiver, self._turns) if each is not None]

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
        self.hands_back, self._instead, self._silent = self._safe == "hand-back", "", 0.0

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

    def operator_heard(self) -> None:
        """A helm page, a control client or a ground station gave a sign of life."""
        self._silent = 0.0

    def take_mission(self, items: Sequence[MissionItem]) -> None:
        """Another route, of uploaded items; what is learned of the current is kept. InputError for what cannot be."""
        self.guide.exchange(items, self.state in UNDER_WAY)
        self._begin_leg()
        self._guard.start()

    def _begin_leg(self) -> None:
        """A turn that was planned, and what was seen of the way made, are of another leg."""
        if self.pilot.in_current is not None:
            self.pilot.in_current.restart()

    def turns(self, limit: float) -> None:
        """The vehicle's own limit of its yaw rate, rad/s."""
        if self._turns is not None:
            self._turns.limit.vehicle(limit)

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
        new = measured if measured is not None and measured.time == row.time else None
        fits = None if new is None else self.estimator.fix(new)
        if self.estimator.is_broken:
            self.stop(_NO_NUMBER)
        self._watch.fix(row, fits, since)
        if new is not None:
            self._monitor(row, new)

    def _monitor(self, row: Row, measured: InputRow) -> None:
        """Receiver and boat, by the fix."""
        self._receiver.fix(measured.time, measured.latitude, measured.longitude, row.sog, self._watch.interval)
        if self._turns is not None:
            of_a_second = self._receiver.scatter * math.sqrt(min(1.0, self._watch.interval))
            self._turns.fix(measured, math.hypot(self.estimator.filter.slow_std, of_a_second))

    def take(self, row: InputRow) -> None:
        """Whatever a link reports, used by the navigator or not."""
        self.estimator.take(row)
        if self.measured is not None:
            self.measured.take(row)

    def untimely(self) -> None:
        """A position came whose time does not follow that of the last fix."""
        self._watch.untimely()

    def step(self, row: Row, dt: float) -> Order:
        """The order of a tick, dt s after the one before."""
        self._trouble = self._watch.step(row, dt)
        if self._turns is not None:
            self._turns.order(self.estimator.ordered, self._thrust, dt, self.estimator.throttle(row.time))
            limit_turns(self.pilot, self._turns.limit.rate)
        # A boat that seems to stand still is not driven faster before it is known to.
        limit_thrust(self.pilot, max(self._thrust, 0.0) if self._receiver.doubt else 1.0)
        if self._is_new and self._is_finished:
            self.guide.restart()
        self.guide.row = row
        done = self.pilot.step(row, dt)  # type: ignore[arg-type]  # its estimator takes rows
        course = done.desired.angle
        self.leg = self.guide.shown(done.leg, course)
        self._thrust = done.command[1] if done.command else math.nan
        if done.command and self.state in UNDER_WAY:
            return Order._make((self.state, self.reason, True, *done.command, course, done.speed))
        return Order(self.state, self.reason, self.state is State.STOPPED and not self.hands_back)

    def judge(self, pilot: Pilot, row: Row, estimate: Estimate, leg: LegState, dt: float) -> Mode:
        """See `pilot.Observer`: whether to steer, by what is known and where the boat is."""
        cross_track = math.nan if self.guide.finished else leg.cross_track + self.guide.offset
        self._say_turn(leg)
        self._speed = self.guide.slowed(leg)
        if self.state in UNDER_WAY:
            self._go_on(row, cross_track, dt)
        self._obstacle = self._watch.obstacle(row) or self._guard.obstacle(row, cross_track) or self._vehicle
        if self.state in (State.IDLE, State.READY):
            self._obstacle = self._obstacle or self._far(leg)
            self._wait()
        elif self.state is State.STOPPED and not self._obstacle and self.reason.endswith(_LOST):
            self.reason += _AGAIN
        if self.state not in UNDER_WAY or self._is_new:
            return Mode.IDLE
        return Mode.HOLDING if self.guide.phase is Phase.HOLDING else Mode.UNDER_WAY

    def ask(
        self, pilot: Pilot, desired: Reference, speed: float, estimate: Estimate
    ) -> tuple[Reference, float, Estimate]:
        """See `pilot.Observer`: a speed at which the boat can be steered and turns, and the speed that is measured."""
        if pilot.mode not in (Mode.UNDER_WAY, Mode.HOLDING):
            return desired, speed, estimate
        if pilot.autopilot.schedule is not None:
            pilot.autopilot.schedule.fix_interval = self._watch.interval
        turning = 1.0 if pilot.uses_current(estimate) else self._slowing(desired.angle)
        if self.measured is not None:
            along = self.measured.speed(self.guide.row.time)
            if math.isfinite(along):
                estimate = estimate._replace(sog=abs(along))
            pilot.measured_shaft(self.measured.shaft)
        return Reference(desired.angle, 0.0, 0.0), max(self._slowest, min(speed, self._speed) * turning), estimate

    def allows(self, pilot: Pilot, steered: Steered, estimate: Estimate) -> bool:
        """See `pilot.Observer`: whether the commands are numbers; where not, the autopilot stops."""
        if not steered.command or all(map(math.isfinite, (*steered.command, estimate.north, estimate.east))):
            return True
        self.stop(_NO_NUMBER)
        self.estimator.restart()
        return False

    def _go_on(self, row: Row, cross_track: float, dt: float) -> None:
        spot_turn = self.pilot.spot_turn
        is_held = self.guide.phase is Phase.HOLDING or (spot_turn is not None and spot_turn.turns)
        trouble = self._trouble
        if self._is_new:
            self._is_new = self._is_finished = False
            self.pilot.restart()
            self._guard.start()
            for monitor in self._monitors:
                monitor.restart()
        elif self.guide.rejoins:
            self._begin_leg()
            self._guard.rejoin()
        self.guide.rejoins = False
        if is_held and self._turns is not None:
            self._turns.restart()  # positions of a boat that hardly moves show no turn
        if self.guide.finished:
            self._is_finished = True
            trouble = trouble or "the route is finished"
        if self.pilot.in_current is not None:
            trouble = trouble or self.pilot.in_current.trouble
        limit = self._guard.step(row, cross_track, is_held, dt)
        self._silent += dt
        if self.guide.mode != POSITION:
            self._instead = ""
        if not trouble and self._holds_instead(limit):
            limit = ""
        trouble = trouble or limit
        trouble = trouble or next(filter(None, (each.trouble for each in self._monitors)), "")
        if trouble:
            self.stop(trouble)
        elif self.state in UNDER_WAY:
            doubts = (each.doubt for each in self._monitors)
            self.reason = self._watch.degradation(row) or next(filter(None, doubts), "") or self._instead
            self.state = State.DEGRADED if self.reason else State.RUNNING

    def _far(self, leg: LegState) -> str:
        """Why a route does not begin here: its first leg is further away than a mission usually begins."""
        if self._from_here or self.guide.mode != ROUTE or not self._is_finished:
            return ""
        beyond = max(-leg.along_track, -leg.remaining, 0.0)
        away = math.hypot(leg.cross_track, beyond)
        if not away > _FAR:
            return ""
        return f"the route begins {away / 1e3:.1f} km away, expected at most {_FAR / 1e3:g} km, or --from-here"

    def _say_turn(self, leg: LegState) -> None:
        """Log a turn that begins, with the side and the distance at which it passes the waypoint; as a warning where
        that is not within the acceptance.
        """
        turn = None if self.pilot.in_current is None else self.pilot.in_current.turning
        if turn is not None and turn is not self._turn:
            degrees, passes = math.degrees(turn.angle), f"{turn.closest:.1f} m from waypoint {leg.target - 1}"
            acceptance = float(self.guide.mission.route.acceptance[leg.target - 1])
            is_wide = turn.closest > acceptance
            passes += f", its acceptance is {acceptance:g} m: slow down, or turn quicker" if is_wide else ""
            LOG.log(logging.WARNING if is_wide else logging.INFO, _TURN, degrees, leg.target, passes)
        self._turn = turn

    def _holds_instead(self, limit: str) -> bool:
        """Whether a limit, or the loss of the operator, is answered by holding a position: as the mission says."""
        if self._instead:
            return not limit
        lost = self._silent > self._operator_lost
        if not (lost or (self._guard.is_off_route and limit)):
            return False
        reason = f"no operator was heard for {self._operator_lost:g} s" if lost else limit
        instead = self._on_stop.operator if lost else self._on_stop.off_route
        if instead in ("stop", "hand-back"):
            self.hands_back = instead == "hand-back" or self.hands_back
            self.stop(reason)
            return False
        if instead == "hold":
            self.guide.hold_position()
        else:
            self.guide.go_back()
        self._instead = f"{reason}: {'the position is held' if instead == 'hold' else 'the boat returns'}"
        return True

    def _wait(self) -> None:
        self.state, self.reason = (State.IDLE, self._obstacle) if self._obstacle else (State.READY, "")
        if self._engage and self.state is State.READY:
            self.start()

    def _slowing(self, course_to_steer: float) -> float:
        """Share of the route's speed, by the turn that the reference has still to make."""
        reference = self.pilot.autopilot.shaper.reference
        turn = 0.0 if reference is None else wrap(course_to_steer - reference.angle)
        return max(_SLOWEST_TURN, math.cos(turn)) if math.isfinite(turn) else 1.0
