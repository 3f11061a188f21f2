"""Sailing a route: which leg is under way, when a waypoint is reached or missed, and what happens at the ends.

One `Mission` serves line-of-sight path following, waypoint missions and live runs. It knows positions only; who steers
is none of its business.
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
    CONTINUING = "continuing"  # beyond the last waypoint on the last leg's line, no end
    HOLDING = "holding"  # keep station at the last waypoint
    STOPPED = "stopped"


AT_END = {"continue": Phase.CONTINUING, "hold": Phase.HOLDING, "stop": Phase.STOPPED}


@dataclass(frozen=True)
class Passing:
    """When a waypoint counts as reached, and when as missed.

    rule "remaining": reached when the signed distance left along the leg is within the acceptance radius, however far
        to the side; P1 (45) with x_e signed, so that a boat behind the leg does not switch.
    rule "circle": reached inside the circle of acceptance, P4 (22); missed on passing the plane through the waypoint
        normal to the leg outside of it. (The sign change of the range rate, which P4 prints, also fires at the start
        and after every switch.)
    Under both, a leg whose speed is known is given up after time_factor · length / speed + time_margin; the length is
    the boat's own distance where that is longer. time_factor None: never.
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
        """(reached, why) when the leg is done, None when it is not; unknown position leaves it open.

        lead: distance along the leg (m) at which the turn into the next one begins, in place of the rule.
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
    """A boat on a route; one step per position.

    start "line": the first leg runs from waypoint 0 to 1 and is followed along its line even from behind its beginning
        or beside it; a boat already beyond its end passes on by the rule. Waypoint 0 begins the route and is no goal.
    start "point": waypoint 0 is the first goal, on a leg that begins where the boat is first seen.
    at_end "continue" | "hold" | "stop": beyond the last waypoint the last leg's line goes on; the asked speed is the
        last leg's for "continue" and 0 otherwise. `phase` says which.
    A passed waypoint switches the leg for the next step: the step that passes it still answers for the old leg, and at
    most one waypoint is passed in a step. `lead` (m before the waypoint, NaN for none) may be set before a step by who
    knows how the boat turns: then the leg ends there, in place of the rule. A curve at the leg's end belongs to it; its
    direction is that of the way `preview` m ahead, for a boat that follows with a delay. `following` is the direction
    (rad) of the leg after that of the last step, NaN where there is none, a curve leads to it, or it is under way now.
    """

    given_course = math.nan

    def __init__(self, route: Route, passing: Passing | None = None, *, start: str = "line", at_end: str = "stop"):
        self.route = route
        self.passing = passing or Passing()
        self._start = one_of("mission.start", start, ("line", "point"))
        self._end_phase = AT_END[one_of("mission.at_end", at_end, tuple(AT_END))]
        self.restart()

    def restart(self) -> None:
        """Forget everything sailed so far."""
        self.lead, self.preview, self.following = math.nan, 0.0, math.nan
        self.phase = Phase.UNDER_WAY
        self.log = MissionLog()
        self._target = -1  # no position was known yet
        self._leg_since = 0.0
        self._time_limit = math.inf

    def step(self, north: float, east: float, dt: float, effort: float = 0.0) -> LegState:
        """The position seen from the leg under way. Position in m (NaN for unknown), dt since the step before.

        `effort` is what the control costs per second, in a unit of the caller's choice; the log integrates it.
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
        if self._target != leg.target:  # the turn has begun: how far before a waypoint it does is no longer asked
            self.following = math.nan
        return leg

    @property
    def target(self) -> int | None:
        """Index of the waypoint under way, None before a position was known."""
        return None if self._target < 0 else self._target

    def skip(self, why: str = "skipped") -> None:
        """Give up the waypoint under way as missed, on the word of an outer judge or a person."""
        if self.phase is Phase.UNDER_WAY and self._target >= 0:
            north, east = self._last_seen
            self._pass(False, why, (north, east), math.hypot(self._ends[2] - north, self._ends[3] - east))

    def go_to(self, target: int) -> None:
        """Sail the leg that leads to a waypoint, whichever is under way, and go on from there.

        A boat that is beyond the leg's end, and not at the waypoint, sails straight to it.
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
        """Sail another route of as many waypoints, from the leg under way on."""
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
        """Set the leg from point 0 to a waypoint, the boat being at (north, east)."""
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
