"""Waypoint switching: the active leg of a route, when a waypoint is reached or missed, and what follows the last one.

`Mission` serves path following, waypoint missions and live runs. It uses positions only and does not steer.
"""

import math
from dataclasses import dataclass
from enum import Enum

from steerway.core.checks import not_negative, one_of, positive
from steerway.core.errors import InputError
from steerway.core.leg import UNSEEN, LegState, leg_direction, seen_from_leg
from steerway.guidance.mission_log import MissionLog, Passage
from steerway.guidance.route import Route


class Phase(Enum):
    """What the boat should be doing."""

    UNDER_WAY = "under way"
    CONTINUING = "continuing"  # beyond the last waypoint, along the last leg's line
    HOLDING = "holding"  # keep station at the last waypoint
    STOPPED = "stopped"


AT_END = {"continue": Phase.CONTINUING, "hold": Phase.HOLDING, "stop": Phase.STOPPED}


@dataclass(frozen=True)
class Passing:
    """When a waypoint counts as reached, and when as missed.

    rule "remaining": reached when the signed along-track distance left is within the radius of acceptance, whatever the
        cross-track error; P1 (45) with x_e signed, so that a boat behind the leg does not switch.
    rule "circle": reached inside the circle of acceptance, P4 (22); missed when the boat passes the waypoint's plane
        normal to the leg outside of the circle. (The sign change of the range rate, as in P4, also occurs at the start
        and after every switch.)
    With either rule, a leg with a desired speed is given up after time_factor · length / speed + time_margin (s). The
    length is that of the leg, or the boat's first distance from the waypoint if longer. time_factor None: never.
    """

    rule: str = "remaining"
    by_plane: bool = True
    time_factor: float | None = 3.0
    time_margin: float = 60.0

    def __post_init__(self) -> None:
        one_of("passing.rule", self.rule, ("remaining", "circle"))
        if self.time_factor is not None:
            positive("passing.time_factor", self.time_factor)
        not_negative("passing.time_margin", self.time_margin)

    def verdict(self, leg: LegState, acceptance: float, lead: float = math.nan) -> tuple[bool, str] | None:
        """(reached, why) if the leg is done, else None; also None for an unknown position.

        lead: distance (m) of the wheel-over point from the waypoint, which replaces the rule; NaN for none.
        """
        if not math.isnan(lead):
            return (True, "turn") if leg.remaining <= lead else None
        left = leg.remaining if self.rule == "remaining" else leg.distance
        if left <= acceptance:
            return True, self.rule
        if self.rule == "circle" and self.by_plane and leg.remaining < 0.0:
            return False, "plane"
        return None


class Mission:
    """Progress of a boat along a route; one step per position.

    start "line": the first leg runs from waypoint 0 to 1; its line is followed also from behind or beside it. A boat
        already beyond the line's end passes waypoint 1 by the rule. Waypoint 0 begins the route and is no goal.
    start "point": waypoint 0 is the first goal, on a leg from the boat's first known position.
    at_end "continue" | "hold" | "stop": sets `phase` after the last waypoint. The last leg's line continues beyond it;
        the desired speed is the last leg's for "continue" and 0 otherwise.
    The step that passes a waypoint still returns the old leg; the next step returns the new one. A step passes at most
    one waypoint. `lead` is the distance (m) of the wheel-over point from the waypoint. If you set it before a step, the
    leg ends there, whatever the rule (NaN: by the rule). A curve at the end of a leg belongs to the leg; on it, the
    leg's direction is that of the curve `preview` m ahead, because a boat follows with a delay. `following` is the
    direction (rad) of the next leg. It is NaN without a next leg, if a curve leads to it, or once it is active.
    """

    given_course = math.nan

    def __init__(self, route: Route, passing: Passing | None = None, *, start: str = "line", at_end: str = "stop"):
        self.route = route
        self.passing = passing or Passing()
        self._start = one_of("mission.start", start, ("line", "point"))
        self._end_phase = AT_END[one_of("mission.at_end", at_end, tuple(AT_END))]
        self.restart()

    def restart(self) -> None:
        """Reset to the beginning of the route, with an empty log."""
        self.lead, self.preview, self.following = math.nan, 0.0, math.nan
        self.phase = Phase.UNDER_WAY
        self.log = MissionLog()
        self._target = -1  # no known position yet
        self._leg_since = 0.0
        self._time_limit = math.inf

    def step(self, north: float, east: float, dt: float, effort: float = 0.0) -> LegState:
        """The position relative to the active leg. Position in m (NaN for unknown), dt in s since the previous step.

        `effort`: cost of control per second, in a unit of your choice; the log integrates it.
        """
        known = math.isfinite(north) and math.isfinite(east)
        if self._target < 0:
            if not known:
                return UNSEEN
            self._begin(north, east)
        leg = self._seen(north, east)
        self.following = self._next_direction()
        if self.phase is Phase.UNDER_WAY:
            self.log.add(north, east, leg, dt, effort)
            if known:
                self._judge(leg, north, east)
        if self._target != leg.target:  # the turn has begun: its lead is not needed any more
            self.following = math.nan
        return leg

    @property
    def target(self) -> int | None:
        """Index of the waypoint at the end of the active leg, None before the first known position."""
        return None if self._target < 0 else self._target

    def skip(self, why: str = "skipped") -> None:
        """Record the active waypoint as missed, with the reason `why`, and go on to the next one."""
        if self.phase is Phase.UNDER_WAY and self._target >= 0:
            north, east = self._last_seen
            self._pass(False, why, (north, east), math.hypot(self._ends[2] - north, self._ends[3] - east))

    def go_to(self, target: int) -> None:
        """Make the leg to waypoint `target` active, and go on from there.

        A boat beyond the leg's end, and not at the waypoint, goes straight to the waypoint.
        """
        if not 1 <= target < len(self.route) or self._target < 0:
            raise InputError(f"waypoint is {target}, expected 1 to {len(self.route) - 1} of a mission under way")
        self.phase = Phase.UNDER_WAY
        north, east = self._last_seen
        self._sail(target, self.route.north[target - 1], self.route.east[target - 1], north, east)
        remaining = seen_from_leg(north, east, *self._ends, self._direction, self._length)[2]
        if remaining <= self._acceptance < math.hypot(self._ends[2] - north, self._ends[3] - east):
            self._sail(target, north, east, north, east)

    def exchange(self, route: Route) -> None:
        """Replace the route by another with as many waypoints, from the active leg on.

        Raises InputError for a route with more or fewer.
        """
        if len(route) != len(self.route):
            raise InputError(f"the route has {len(route)} waypoints, expected {len(self.route)} as before")
        self.route = route
        if self._target > 0 and self.phase is Phase.UNDER_WAY:
            before = self._target - 1
            self._sail(self._target, route.north[before], route.east[before], *self._last_seen)

    def _begin(self, north: float, east: float) -> None:
        route = self.route
        self._last_seen = (north, east)
        if self._start == "line":
            self._sail(1, route.north[0], route.east[0], north, east)
            return
        distance = math.hypot(route.north[0] - north, route.east[0] - east)
        if distance <= route.acceptance[0]:
            self.log.record(Passage(0, True, "start", 0.0, 0.0, distance, distance))
            self._sail(1, route.north[0], route.east[0], north, east)
        else:
            self._sail(0, north, east, north, east)

    def _sail(self, target: int, north_0: float, east_0: float, north: float, east: float) -> None:
        """Make the leg from a point (north_0, east_0) to a waypoint active, for a boat at (north, east)."""
        route = self.route
        end = (float(route.north[target]), float(route.east[target]))
        on_route = target > 0 and (north_0, east_0) == (route.north[target - 1], route.east[target - 1])
        self._curve = route.curves[target] if on_route else None
        self._target = target
        self._ends = (float(north_0), float(east_0), *end)
        self._direction = leg_direction(*self._ends)
        self._length = math.hypot(end[0] - north_0, end[1] - east_0)
        self._speed = float(route.speed[target])
        self._acceptance = float(route.acceptance[target])
        self._leg_since = self.log.time
        self._time_limit = self._leg_time(max(self._length, math.hypot(end[0] - north, end[1] - east)))
        self.log.closest = math.inf

    def _leg_time(self, length: float) -> float:
        factor = self.passing.time_factor
        if factor is None or math.isnan(self._speed):
            return math.inf
        return factor * length / self._speed + self.passing.time_margin

    def _next_direction(self) -> float:
        following = self._target + 1
        if following >= len(self.route) or self.phase is not Phase.UNDER_WAY or self._curve is not None:
            return math.nan
        return float(leg_direction(*self._ends[2:], self.route.north[following], self.route.east[following]))

    def _seen(self, north: float, east: float) -> LegState:
        curve, direction = self._curve, self._direction
        along, cross, remaining, distance, bearing = seen_from_leg(north, east, *self._ends, direction, self._length)
        if curve is not None:
            begins = self._length - curve.before
            if along > begins:
                on_curve, cross = curve.seen(north, east)
                along = begins + on_curve
            remaining = begins + curve.length - along
            direction = curve.direction_at(along + self.preview - begins)
        return LegState(self._target, direction, along, cross, remaining, distance, bearing, self._speed)

    def _judge(self, leg: LegState, north: float, east: float) -> None:
        self._last_seen = (north, east)
        if self._curve is not None:
            verdict = (True, "corner") if leg.remaining <= 0.0 else None
        else:
            verdict = self.passing.verdict(leg, self._acceptance, self.lead)
        if verdict is None and self.log.time - self._leg_since > self._time_limit:
            verdict = (False, "time")
        if verdict is not None:
            self._pass(*verdict, (north, east), leg.distance)

    def _pass(self, reached: bool, why: str, position: tuple[float, float], distance: float) -> None:
        log, target = self.log, self._target
        log.record(Passage(target, reached, why, log.time, log.distance, distance, log.closest))
        if target + 1 < len(self.route):
            self._sail(target + 1, self.route.north[target], self.route.east[target], *position)
            return
        self.phase = self._end_phase
        if self.phase is not Phase.CONTINUING:
            self._speed = 0.0
