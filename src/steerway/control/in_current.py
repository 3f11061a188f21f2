"""Steering a course over ground in an estimated current, by the heading that yields this course.

A loop on the heading has the boat's own gain. A loop on the course would have the further gain dχ/dψ, 0.6 to 5 in a
current of 80 % of the boat's speed (`core.kinematics.course_per_heading`). Heading, speed through the water and current
are estimated together from the motion over ground, so their errors compensate each other in the course.
"""

import math
from dataclasses import dataclass

from steerway.control.course import AnglePID, AnglePIDGains, YawResponse
from steerway.control.handover import Autopilot
from steerway.control.headway import Headway
from steerway.control.turns import Turn, TurnLimits, TurnSpeeds, plan_turn
from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.checks import positive
from steerway.core.estimate import Estimate
from steerway.core.kinematics import heading_for, water_speed_for
from steerway.core.leg import LegState
from steerway.core.reference import Reference, ReferenceModel
from steerway.core.wheel_over import ahead_on, in_line, off_path, wheel_over

_ORDERED_NOISE = 0.3
"""Largest yaw rate that the estimate's noise may order, as a fraction of the largest rate. `steerway study at-sea`
judges this number and those below."""
SURE = 0.5
"""σ of the heading (rad) above which the boat turns at half the rate, and no turn begins early."""
_LOST = 1.0
"""1σ of the heading, rad, above which a boat that begins to steer goes straight ahead at first."""
_DEPARTURE = 10.0
"""Longest time for which such a boat goes straight ahead, s. Its turns then make the heading observable."""
_KEPT_SIDE = 0.5
"""Remaining turn (rad) above which the bow turns to the planned side. Without this rule a boat turned to and fro: with
90° left, the course back to the turn's path required a turn to the other side."""
_SHORTEST = 0.3
"""Smallest factor on the lookahead of a slow boat."""
_APPROACH, _NEAR = 1.5, 1.0
"""_APPROACH: distance before a turn, in lookaheads, over which the boat moves beside the leg to the turn's beginning.
_NEAR: time (s) before a turn; from then on the plan uses the boat's actual distance to the leg."""
_SOON, _AGAIN = 2.0, 0.2
"""_SOON: time before a turn, s; from then on it is planned at every step. _AGAIN: time between earlier plans, s."""
_LATE, _AT_ONCE = 0.2, 0.7
"""_LATE: delay (s) with which a vehicle with inner loops follows the reference. _AT_ONCE: speed through the water, as a
fraction of the largest, below which the rudder is weak; the delay then grows by 1 s per unit of the missing fraction.
On squares it was 0.35 s longer at a fraction of 0.35, and 0.2 s longer at 0.5."""
_FIRMER = 3.0
"""Factor on the bandwidth of the heading loop in a turn of a vehicle with inner loops. If the rudder reaches its limit
at first, the boat falls behind the reference by 8 to 15°; catching up in 2 s would take it 0.5 m off the path."""
_TIGHTER, _SETTLES = 2.0, 4.0
"""Divisor of the lookahead in a turn of a vehicle with inner loops; time for which it applies after the turn, s."""
_QUICKEST = 3.0
"""Largest ratio of the reference's bandwidth to the declared one. With 2 instead, a turn of 90° takes 0.8 s longer."""
_LEAST = 0.1
"""Smallest bandwidth of the heading loop, as a fraction of the boat's own."""
_SLOW, _WIDE, _WORTH = 0.5, 0.14, 0.8
"""A corner is wide if its path leaves the legs to the outside by more than _WIDE acceptance radii, or passes the
waypoint at more than one radius. It is turned at _SLOW times the route's speed if the current is slower than that, and
if the cost of the turn falls below _WORTH times the cost at full speed. On planned paths with corners of 150°, this
reduces the excursion from 1.4 to 0.7 m without a current, and from 1.1 to 1.0 m in one of half the boat's speed. With a
_WIDE of 0.2, corners of 120° without a current were turned at full speed, 1.8 m from the waypoint instead of 1.0 m."""
_SHORT = 0.1
"""A vehicle's motor counts as at its limit if the speed is below the ordered one by more than this share of the top
speed. Without this rule the speed loop's integral raised the order from 1.2 to 1.9 m/s on a leg across a current of
1.3 m/s, and the vehicle kept full thrust for 1.5 s of the turn that followed."""
_BRAKING = 0.25
"""Deceleration (m/s²) of a vehicle with inner loops before a slow corner: half of what such vehicles achieve."""


@dataclass
class InCurrent:
    """Steers a boat in a current; the fields are parameters of the boat.

    response: response of the yaw rate to the autopilot's output, which is at most `limit`. top_speed and slowest (m/s):
    limits of the speed through the water; below `slowest` the boat hardly steers. turn_rate: largest ordered yaw rate,
    rad/s. bandwidth: bandwidth of the heading loop with a perfect estimate, rad/s. over_ground: whether the boat's
    inner loop controls the speed over ground along the bow; else it controls the speed through the water. pivot,
    slip_time, lookahead: as in `Boat`. speed_time: time constant of the speed, s. acceptance: waypoint radius, m.
    """

    response: YawResponse
    top_speed: float
    slowest: float
    turn_rate: float
    bandwidth: float
    limit: float = math.inf
    over_ground: bool = False
    pivot: float = 0.0
    speed_time: float = 2.0
    slip_time: float = 0.0
    lookahead: float = 10.0
    acceptance: float = math.inf

    def __post_init__(self) -> None:
        for name in ("top_speed", "slowest", "turn_rate", "bandwidth"):
            positive(f"in_current.{name}", getattr(self, name))
        self._headway = Headway(self.top_speed, self.response.time)
        self.restart()

    def restart(self) -> None:
        """Reset, when the boat begins to steer."""
        self._headway.restart()
        self._departing = 0.0
        self.turning: Turn | None = None  # the turn from the last leg into this one
        self._path: Floats | None = None  # path of this turn
        self._left, self._seen = 0.0, math.nan  # remaining turn, and last reference heading, rad
        self._planned_at = math.inf  # distance from the waypoint at the last plan of a turn, m
        self._next: tuple[int, Turn | None, tuple[float, float]] = (-1, None, (0.0, 0.0))
        self._turned_for, self._direction = 0.0, math.nan  # s since the leg began, and its direction, rad
        # Waypoint of the next corner, speed (m/s) of its turn, and distance (m) when this speed was chosen; speed of
        # the turn under way.
        self._corner, self._turn_speed = (-1, math.inf, math.inf), math.inf

    @property
    def trouble(self) -> str:
        """Why the boat cannot follow the leg, "" while it can."""
        return self._headway.trouble

    def watch(self, leg: LegState, estimate: Estimate, dt: float) -> None:
        """Check whether the boat comes nearer to the waypoint, or could by the estimated current."""
        if leg.target != self._headway.target:
            self._begin_turn(leg.target)
        self._turned_for, self._direction = self._turned_for + dt, leg.direction
        if self.turning is not None and self._turned_for >= self.turning.time:
            self._path = None
        # A speed gain above 1 may be a wrong split into speed and current; a boat that is faster comes nearer anyway.
        believed = estimate._replace(speed_gain=min(estimate.speed_gain, 1.0))
        fastest = self.progress(leg.direction, believed) + estimate.current_std
        self._headway.watch(leg, fastest if estimate.heading_std <= SURE else math.inf, self.turn_rate, dt)

    def _begin_turn(self, target: int) -> None:
        """Begin the leg to a waypoint; the turn planned into this leg, if any, is then under way."""
        into, turn, begins = self._next
        self.turning, self._turned_for, self._seen = (turn if into == target else None), 0.0, math.nan
        self._turn_speed = self._corner[1] if self._corner[0] == target - 1 else math.inf
        self._path, self._left, self._next = None, 0.0, (-1, None, (0.0, 0.0))
        if self.turning is not None:
            self._left = self.turning.angle
            self._path = self.turning.path + begins if self.turning.lead > 0.0 else None

    def departs(self, estimate: Estimate, dt: float) -> bool:
        """Whether to go straight ahead because the heading is still uncertain."""
        lost = estimate.heading_std > (_LOST if self._departing == 0.0 else SURE)
        departs = lost and self._departing < _DEPARTURE
        self._departing = self._departing + dt if departs else math.inf
        return departs

    def water_speed(self, course: float, speed: float, estimate: Estimate) -> float:
        """Speed through the water (m/s) for a speed over ground along a course, within the boat's limits.

        In a planned turn the result is the speed planned for the next leg: less thrust would turn the boat less.
        """
        current = estimate.current_north, estimate.current_east
        course = course if self._path is None else self._direction
        return float(water_speed_for(course, speed, *current, min(self.slowest, speed), self._fastest(estimate)))

    def _fastest(self, estimate: Estimate) -> float:
        """Largest speed through the water (m/s), by the estimated speed gain.

        With an inner loop of the speed over ground it is at least `top_speed`: against a current it gives full thrust.
        """
        least = 1.0 if self.over_ground else 0.0
        return self.top_speed * max(estimate.speed_gain, least)

    def current_along_bow(self, estimate: Estimate) -> tuple[float, ...]:
        """(current along the bow,), m/s, if the boat's inner loop controls the speed over ground; else ()."""
        heading = estimate.heading
        along = estimate.current_north * math.cos(heading) + estimate.current_east * math.sin(heading)
        return (estimate.made_up * along,) if self.over_ground else ()

    def reached(self, ordered: float, estimate: Estimate) -> float:
        """Share of an ordered speed (m/s) over ground that the vehicle's own speed loop reaches; 1 if nearly all."""
        if not self.over_ground:
            return 1.0
        along = max(0.0, estimate.water_speed + sum(self.current_along_bow(estimate)))
        return along / ordered if ordered - along > _SHORT * self.top_speed else 1.0

    def heading(
        self, desired: Reference, water_speed: float, estimate: Estimate, reference: Reference | None = None
    ) -> Reference:
        """The heading that yields a course in the current; in a planned turn, on the planned side of the reference."""
        fastest = max(estimate.water_speed, 0.7 * water_speed)
        heading = float(heading_for(desired.angle, fastest, estimate.current_north, estimate.current_east)[0])
        if reference is not None and self.turning is not None and self._left != 0.0:
            heading = self._to_the_side(heading, reference.angle, self.turning.angle)
        return Reference(heading, 0.0, 0.0)

    def _to_the_side(self, heading: float, reached: float, turn: float) -> float:
        """The heading; in a planned turn at most 143° beyond the reference `reached`, on the side of the turn."""
        self._left -= 0.0 if math.isnan(self._seen) else wrap(reached - self._seen)
        self._seen = reached
        side = math.copysign(1.0, turn)
        if side * self._left < _KEPT_SIDE:
            self._left = 0.0
            return heading
        left = wrap(heading - reached)
        return wrap(reached + ahead_on(left if side * left > 0.0 else left + side * math.tau))

    def with_shorter_lookahead(self, leg: LegState, speed: float, estimate: Estimate) -> LegState:
        """The leg; for a boat slower than `speed` (m/s over ground) its cross-track error is scaled up.

        This acts like a shorter lookahead: the error decays in the same time as at `speed`. In a turn the cross-track
        error is the distance from the turn's path.
        """
        leg = self._beside(leg)
        off = leg.cross_track
        if self._path is not None:
            turned, is_over = off_path(self._path, estimate.north, estimate.east)
            # Off the path by more than a turn's radius, and nearer to the leg: the boat does not turn as planned.
            lost = abs(turned) > max(abs(off), estimate.water_speed / self.turn_rate)
            self._path, off = (None, off) if is_over or lost else (self._path, turned)
        slower = min(1.0, max(_SHORTEST, estimate.sog / speed)) if speed > 0.0 else 1.0
        turns = self.over_ground and self.turning is not None and self._turned_for < self.turning.time + _SETTLES
        return leg._replace(cross_track=off / slower * (_TIGHTER if turns else 1.0))

    def _beside(self, leg: LegState) -> LegState:
        """The leg, bent towards the place where the turn at its end begins; this place may be beside the leg."""
        into, turn, _ = self._next
        if turn is None or into != leg.target + 1 or self._path is not None:
            return leg
        left, way = leg.remaining - turn.lead, _APPROACH * self.lookahead
        if not 0.0 < left < way:
            return leg
        x = 1.0 - left / way
        off, slope = turn.beside * x * x * (3.0 - 2.0 * x), turn.beside * 6.0 * x * (1.0 - x) / way
        return leg._replace(cross_track=leg.cross_track - off, direction=leg.direction + math.atan(slope))

    def turn(self, leg: LegState, following: float, estimate: Estimate, model: ReferenceModel) -> float:
        """Distance (m) from a waypoint at which the turn into the next leg, of the direction `following`, has to begin.

        The turn's path is stored; the boat follows this path once the next leg is under way.
        """
        into, planned, _ = self._next
        if planned is not None and into == leg.target + 1:
            is_far = leg.remaining - planned.lead > _SOON * estimate.sog
            if is_far and abs(leg.remaining - self._planned_at) < _AGAIN * estimate.sog:
                return planned.lead
        self._planned_at = leg.remaining
        turn = self._slow_or_not(leg, following, estimate, model)
        left, beside = leg.remaining - turn.lead, turn.beside
        is_near = left < _NEAR * estimate.sog and abs(leg.cross_track - beside) < estimate.water_speed / self.turn_rate
        if is_near and not in_line(leg.direction, following):
            beside = leg.cross_track
            side = -math.copysign(1.0, math.sin(following - leg.direction))
            displaced = float(turn.path[-1, 0]), float(turn.path[-1, 1])
            lead = wheel_over(leg.direction, following, *displaced, side * beside, side * turn.beside)
            turn, left = turn._replace(lead=float(lead)), leg.remaining - float(lead)
        c, s, aside = math.cos(leg.direction), math.sin(leg.direction), beside - leg.cross_track
        begins = estimate.north + left * c - aside * s, estimate.east + left * s + aside * c
        self._next = leg.target + 1, turn, begins
        late = _LATE + max(0.0, _AT_ONCE - estimate.water_speed / self.top_speed)
        return turn.lead + (late * estimate.sog if self.over_ground else 0.0)

    def _slow_or_not(self, leg: LegState, following: float, estimate: Estimate, model: ReferenceModel) -> Turn:
        """The turn at the end of a leg, at full speed or slowly: chosen once a second until the boat brakes."""
        target, slow, seen_at = self._corner
        if target != leg.target:
            slow, seen_at = math.inf, math.inf
        turn = self._at(slow, leg, following, estimate, model)
        braking = 0.5 * leg.speed**2 * (1.0 - _SLOW**2) / _BRAKING
        if self.over_ground and braking < leg.remaining - turn.lead and seen_at - leg.remaining > estimate.sog:
            fast = turn if slow == math.inf else self._at(math.inf, leg, following, estimate, model)
            slowed = self._at(_SLOW * leg.speed, leg, following, estimate, model)
            is_wide = fast.closest > self.acceptance or fast.outside > _WIDE * self.acceptance
            current = math.hypot(estimate.current_north, estimate.current_east) + estimate.current_std
            is_worth = is_wide and current < _SLOW * leg.speed and slowed.cost < _WORTH * fast.cost
            slow, turn = (_SLOW * leg.speed, slowed) if is_worth else (math.inf, fast)
            seen_at = leg.remaining
        self._corner = leg.target, slow, seen_at
        return turn

    def _at(self, slow: float, leg: LegState, following: float, estimate: Estimate, model: ReferenceModel) -> Turn:
        """The turn at the end of a leg at a speed over ground of at most `slow` (m/s)."""
        before = after = estimate.water_speed
        if math.isfinite(leg.speed):
            after = self.water_speed(following, min(leg.speed, slow), estimate)
            before = min(before, self.water_speed(leg.direction, slow, estimate)) if slow < leg.speed else before
        current, fastest = (estimate.current_north, estimate.current_east), self._fastest(estimate)
        return self.planned(leg.direction, following, (before, after), current, model, fastest, estimate.slip_time)

    def speed(self, leg: LegState, speed: float) -> float:
        """The desired speed (m/s): the route's `speed`, but lower before and in a corner that is turned slowly."""
        if self._path is not None:
            return min(speed, self._turn_speed)
        into, turn, _ = self._next
        target, slow, _ = self._corner
        if turn is None or into != leg.target + 1 or target != leg.target or slow >= speed:
            return speed
        return min(speed, math.sqrt(slow**2 + 2.0 * _BRAKING * max(leg.remaining - turn.lead, 0.0)))

    def planned(
        self,
        direction: float,
        following: float,
        speeds: tuple[float, float],
        current: tuple[float, float],
        model: ReferenceModel,
        fastest: float | None = None,
        slip_time: float | None = None,
    ) -> Turn:
        """The turn between two legs (rad) in a current, at the speeds through the water (m/s) before and in the turn.

        fastest (m/s), slip_time (s): by default as declared.
        """
        limits = TurnLimits(model.bandwidth, model.max_rate, model.max_acceleration)
        most = (self.top_speed if fastest is None else fastest) if self.over_ground else math.inf
        motion = TurnSpeeds(*speeds, self.speed_time, most, self.slip_time if slip_time is None else slip_time)
        before = 0.0 if self._next[1] is None else self._next[1].angle
        return plan_turn(direction, following, current, limits, motion, self.pivot, self.over_ground, before)

    def progress(self, course: float, estimate: Estimate) -> float:
        """Largest speed (m/s) along a course over ground; at most 0 if the current is too strong."""
        north, east = estimate.current_north, estimate.current_east
        fastest = self._fastest(estimate)
        along = float(heading_for(course, fastest, north, east)[1])
        across = abs(east * math.cos(course) - north * math.sin(course))
        return along if across < fastest else min(along, 0.0)

    def identified(self, estimate: Estimate) -> YawResponse:
        """The declared response, corrected by the estimated gain, time constant and damping."""
        declared = self.response
        return declared._replace(
            gain=declared.gain * estimate.yaw_gain,
            time=declared.time * estimate.yaw_time,
            linear=declared.linear + estimate.yaw_damping,
        )

    def feedforward(self, autopilot: Autopilot, estimate: Estimate) -> float:
        """The output that turns the boat like the reference; 0 if the controller would estimate it as a bias."""
        reference = autopilot.shaper.reference
        if reference is None or not isinstance(autopilot.controller, AnglePID):
            return 0.0
        _, rate, acceleration = reference
        return self.identified(estimate).order(rate, acceleration, estimate.water_speed, estimate.yaw_bias)

    def tune(self, autopilot: Autopilot, estimate: Estimate) -> None:
        """Adapt the reference's rate, and the gains of a PID, to the present accuracy of the estimate.

        The reference's bandwidth grows in proportion if the boat is identified as faster than declared.
        """
        shaper = autopilot.model
        shaper.max_rate = self.turn_rate * (1.0 if estimate.heading_std < SURE else 0.5)
        if self._left == 0.0 and self._path is None:
            quicker = min(_QUICKEST, max(1.0, 1.0 / estimate.yaw_time)) if estimate.yaw_time > 0.0 else _QUICKEST
            shaper.bandwidth = 2.0 * self.bandwidth * quicker
        if isinstance(autopilot.controller, AnglePID):
            autopilot.controller.gains = self.gains(estimate)

    def gains(self, estimate: Estimate) -> AnglePIDGains:
        """The gains of the heading loop, with the bandwidth that the present accuracy of the estimate allows."""
        across = estimate.cog_std * estimate.sog / max(estimate.water_speed, 0.3 * self.slowest)
        carried = _ORDERED_NOISE * self.turn_rate / max(across, 1e-9)
        bandwidth = min(self.bandwidth, max(_LEAST * self.bandwidth, carried))
        bandwidth *= _FIRMER if self.over_ground and self._path is not None else 1.0
        return self.identified(estimate).gains(bandwidth, estimate.water_speed, self.limit)
