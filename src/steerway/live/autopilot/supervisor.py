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
from steerway.estimation.estimator_tables import EstimatorSettings
from steerway.estimation.vessel.profile import Profile, profile_of
from steerway.guidance.waypoints import Phase
from steerway.live.autopilot.guide import POSITION, ROUTE
from steerway.live.autopilot.integrity import ReceiverMonitor, TurnMonitor
from steerway.live.autopilot.limits import LimitGuard
from steerway.live.autopilot.measured import measured_speed
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.mission_items import MissionItem
from steerway.live.autopilot.piloting import YAW_RATE, boat_of, limit_thrust, limit_turns, pilot_of
from steerway.live.autopilot.watch import Watch
from steerway.live.rows import ENDED, UNDER_WAY, InputRow, Order, Row, State
from steerway.pilot import DEFAULT_KINDS, Mode, Pilot, Steered

LOG = logging.getLogger("steerway.live")
_SLOWEST = 1.5
"""Lowest desired speed, as a multiple of the profile's steerageway."""
_SLOWEST_TURN = 0.5
"""Lowest desired speed in a sharp turn, as a fraction of the route's speed."""

_FAR = 2000.0
"""Largest distance (m) from the boat to the first leg at which a route begins without `from_here`."""
_TURN = "turns by %+.0f° into leg %d, %s"
_LOST, _AGAIN = " is lost", "; it is back, and the autopilot can be started again"
_NO_NUMBER = "the estimate is no number"


class Supervisor:
    """Lets its `pilot` steer along the leg of each tick while all checks pass.

    route:   the route, with its limits, fence, boat and safe output.
    profile: profile of the estimator, None for the prior; it limits the bandwidth of the course loop.
    max_dead_reckoning: longest time without a fix for which the autopilot continues, s.
    engage: start once without a command, as soon as the autopilot is ready.
    takes:   receiver of the orders, one of `piloting.ACTUATIONS`.
    kinds:   kinds of autopilot and speed controller; see `build.build_pilot`.
    estimators: the filters of the heading (see `piloting.pilot_of`) and of the controlled speed.
    from_here: whether a route may begin at any distance from its first leg.
    """

    def __init__(
        self,
        route: GeodeticRoute,
        profile: Profile | str | None = None,
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
        self.leg: Leg | None = None  # the leg of the last tick, None after the end of the route
        self.state = State.IDLE
        self.reason = "no position yet"
        self._safe, self._on_stop = route.settings.safe, route.settings.on_stop
        self.hands_back = self._safe == "hand-back"
        self._silent, self._operator_lost = 0.0, route.settings.limits.operator_lost or math.inf
        self._instead = ""  # why a position is held instead of following the route
        self.measured = measured_speed(estimators.speed)
        self._slowest = _SLOWEST * profile.steerageway
        self._engage, self._from_here = engage, from_here
        self._was_engaged = False  # started by `engage`, not by hand
        self._vehicle = ""
        self._is_finished = True  # a start begins the route from its first leg
        self._is_new = False  # started, and no step since
        self._thrust = math.nan
        self._turn: Turn | None = None  # the turn logged last
        self._obstacle = self.reason
        self._watch = Watch(max_dead_reckoning)
        self._trouble, self._speed = "", math.nan  # in this tick: why to stop, and the speed of the leg
        self._guard = LimitGuard(route.settings.limits, route.fence, route.settings.lookahead_m, route.no_go)
        self._receiver = ReceiverMonitor()
        self._turns: TurnMonitor | None = None
        if takes == YAW_RATE:  # propeller orders contain no yaw rate to compare a turn with
            self._turns = TurnMonitor(boat_of(route, takes), route.settings.boat.max_yaw_rate_dps)
        self._monitors = [each for each in (self._receiver, self._turns) if each is not None]

    def start(self) -> None:
        """Steer from the next step on: begin the route, or continue from the place of the last stop.

        Raises InputError with the obstacle if the start is refused.
        """
        if self.state in UNDER_WAY:
            return
        if self._obstacle:
            raise InputError(f"the autopilot cannot be started: {self._obstacle}")
        self.state, self.reason = State.RUNNING, ""
        self._is_new, self._was_engaged, self._engage = True, self._engage, False
        self.hands_back, self._instead, self._silent = self._safe == "hand-back", "", 0.0

    def stop(self, reason: str = "stopped by command", ended: State = State.STOPPED) -> None:
        """Give the safe output in the state `ended` until started again. A pending `engage` is withdrawn."""
        self._engage = False
        if self.state in UNDER_WAY:
            self.state, self.reason, self._is_new = ended, reason, False

    def link(self, name: str, alive: bool) -> None:
        """Take whether the peer of an output's link answers; while it does not, the autopilot does not steer."""
        self._watch.link(name, alive)
        if not alive and self.state in UNDER_WAY:
            self.stop(f"link {name} is lost")

    def vehicle(self, obstacle: str) -> None:
        """Take the reason why the vehicle could not be steered, "" for none. It prevents a start, but does not stop."""
        self._vehicle = obstacle

    def operator_heard(self) -> None:
        """Take a sign of life from a helm page, a control client or a ground station."""
        self._silent = 0.0

    def take_mission(self, items: Sequence[MissionItem]) -> None:
        """Change to the route of uploaded items; keep the estimated current. Raises InputError as `Guide.exchange`."""
        self.guide.exchange(items, self.state in UNDER_WAY)
        self._begin_leg()
        self._guard.start()

    def _begin_leg(self) -> None:
        """Reset the planned turn and the check of headway, which belong to another leg."""
        if self.pilot.in_current is not None:
            self.pilot.in_current.restart()

    def turns(self, limit: float) -> None:
        """Take the vehicle's own limit of its yaw rate, rad/s."""
        if self._turns is not None:
            self._turns.limit.vehicle(limit)

    def refused(self, reason: str) -> None:
        """Note that the vehicle refused the take-over: stop, or after a start by `engage` wait and start again."""
        if self._was_engaged and self.state in UNDER_WAY:
            self.state, self.reason, self._is_new = State.IDLE, reason, False
            self._obstacle, self._engage = reason, True
        else:
            self.stop(reason)

    def fix(self, row: Row, measured: InputRow | None = None, since: float = 0.0) -> None:
        """Take a fix that the navigator's filter used or rejected.

        row: the estimate at the fix; measured: the receiver's row; since: time from the last step to its arrival, s.
        """
        new = measured if measured is not None and measured.time == row.time else None
        fits = None if new is None else self.estimator.fix(new)
        if self.estimator.is_broken:
            self.stop(_NO_NUMBER)
        self._watch.fix(row, fits, since)
        if new is not None:
            self._monitor(row, new)

    def _monitor(self, row: Row, measured: InputRow) -> None:
        """Pass a fix to the monitors of receiver and turns."""
        self._receiver.fix(measured.time, measured.latitude, measured.longitude, row.sog, self._watch.interval)
        if self._turns is not None:
            of_a_second = self._receiver.scatter * math.sqrt(min(1.0, self._watch.interval))
            self._turns.fix(measured, math.hypot(self.estimator.filter.slow_std, of_a_second))

    def take(self, row: InputRow) -> None:
        """Take any row of a link, whether or not the navigator uses it."""
        self.estimator.take(row)
        if self.measured is not None:
            self.measured.take(row)

    def untimely(self) -> None:
        """Note a position whose time does not follow the time of the last fix."""
        self._watch.untimely()

    def step(self, row: Row, dt: float) -> Order:
        """The order of a tick, dt s after the one before."""
        self._trouble = self._watch.step(row, dt)
        if self._turns is not None:
            self._turns.order(self.estimator.ordered, self._thrust, dt, self.estimator.throttle(row.time))
            limit_turns(self.pilot, self._turns.limit.rate)
        # While the receiver may be frozen, the boat seems to stand still: do not raise the thrust.
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
        return Order(self.state, self.reason, self.state in ENDED and not self.hands_back)

    def judge(self, pilot: Pilot, row: Row, estimate: Estimate, leg: LegState, dt: float) -> Mode:
        """See `pilot.Observer`: whether to steer, from the state of fixes, links and limits."""
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
        """See `pilot.Observer`: the desired speed within its limits, and the estimate with the measured speed."""
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
        """See `pilot.Observer`: whether the commands are finite; if not, the autopilot stops."""
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
            if not trouble:
                self.stop("the end of the route is reached", State.FINISHED)
                return
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
        """The reason why a route does not begin here, if its first leg is more than `_FAR` away; else ""."""
        if self._from_here or self.guide.mode != ROUTE or not self._is_finished:
            return ""
        beyond = max(-leg.along_track, -leg.remaining, 0.0)
        away = math.hypot(leg.cross_track, beyond)
        if not away > _FAR:
            return ""
        return f"the route begins {away / 1e3:.1f} km away, expected at most {_FAR / 1e3:g} km, or --from-here"

    def _say_turn(self, leg: LegState) -> None:
        """Log a turn that begins: its angle, its distance from the waypoint; warn if it exceeds the radius of
        acceptance."""
        turn = None if self.pilot.in_current is None else self.pilot.in_current.turning
        if turn is not None and turn is not self._turn:
            degrees, passes = math.degrees(turn.angle), f"{turn.closest:.1f} m from waypoint {leg.target - 1}"
            acceptance = float(self.guide.mission.route.acceptance[leg.target - 1])
            if is_wide := turn.off > acceptance:
                passes += f" and {turn.outside:.1f} m outside of its corner"
                passes += f", its acceptance is {acceptance:g} m: sail slower, or turn quicker"
            LOG.log(logging.WARNING if is_wide else logging.INFO, _TURN, degrees, leg.target, passes)
        self._turn = turn

    def _holds_instead(self, limit: str) -> bool:
        """Whether the boat holds a position after a limit or loss of the operator, as in the mission's [on_stop]."""
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
        """Factor on the route's speed, below 1 for a large turn that the reference still has to make."""
        reference = self.pilot.autopilot.shaper.reference
        turn = 0.0 if reference is None else wrap(course_to_steer - reference.angle)
        return max(_SLOWEST_TURN, math.cos(turn)) if math.isfinite(turn) else 1.0
