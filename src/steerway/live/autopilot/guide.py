"""Guidance aboard: follows the route, or a course, position or other leg that the skipper requests in its place."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from steerway.control.boats import Boat
from steerway.core.angles import wrap
from steerway.core.earth import displaced, displacement
from steerway.core.errors import InputError
from steerway.core.leg import UNKNOWN_LEG, Leg, LegState
from steerway.guidance.route_table import route_of
from steerway.guidance.waypoints import Mission, Passing, Phase
from steerway.live.autopilot.limits import widest
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.mission_items import SPEED, MissionItem, items_of
from steerway.live.rows import lost

ROUTE, COURSE, POSITION = MODES = ("route", "course", "position")
"""Modes: follow the route, hold a course, or hold a position."""
_AHEAD = 1000.0
"""Distance (m) from the boat to the destination that displays show for a held course."""
_TURNS, _LEAST_RADIUS = 3.0, 8.0
"""Radius of the circle around a held position: _TURNS radii of the tightest turn, but at least _LEAST_RADIUS, m."""
_BRAKING = 0.1
"""Deceleration before the last waypoint, m/s²."""
_SLOWEST = 0.6
"""Speed at the last waypoint, as a fraction of the route's speed; above 0, because a boat at rest has no course."""
_SAME = 1.0
"""Largest distance of two places that count as one waypoint, m."""
_OFFSET = 0.5
"""Largest offset from the route, as a fraction of the cross-track limit. Chosen: half is margin for errors."""
_UNKNOWN = LegState(0, *[math.nan] * 7)


class Followed(NamedTuple):
    """The mode, and the changes that the skipper requested."""

    mode: str  # one of MODES
    course: float = math.nan  # held course, rad
    dodges: bool = False  # whether the held course leads off the route for a while
    offset: float = 0.0  # m to starboard of the route
    faster: float = 0.0  # m/s above the route's speed


class Guide:
    """The mission of a pilot aboard (`pilot.LegSource`). It steps at every tick, for other autopilots too.

    If heading and current are known, a position is held by thrust (`control.holding`). Otherwise, and for another
    autopilot, the boat circles the position clockwise, because a boat at rest has no course. The course along the
    circle is that of a vector field (Nelson, Barber, McLain and Beard, "Vector field path following for miniature air
    vehicles", 2007, equation for orbits).
    Raises InputError for a route that cannot be sailed.
    """

    def __init__(self, route: GeodeticRoute, boat: Boat):
        self._origin, self._boat = route.places[0], boat
        self._items: list[MissionItem] = []  # uploaded items
        self._take(route)
        self.radius = max(_LEAST_RADIUS, _TURNS * self.speed / boat.turn_rate)
        self.mode = ROUTE
        self.course = math.nan  # held course, rad
        self.place = math.nan, math.nan  # held position, rad
        self.given_course = math.nan
        self.row = lost(math.nan)  # the row of the tick
        self.finished = False  # the last waypoint was passed before this tick
        self._leg = 0  # leg from which to continue; 0: the leg under way
        self.rejoins = False  # whether the boat returns to the route; the supervisor reads and resets it
        self.dodges = False  # whether the held course leads off the route for a while
        self._direction = math.nan  # direction of the leg under way

    def _take(self, route: GeodeticRoute) -> None:
        places = [displacement(*place, *self._origin) for place in route.places]
        pairs = zip(route.tables, route.speed.tolist(), strict=True)
        tables = [each.model_copy(update={"speed": speed}) for each, speed in pairs]
        self.mission = Mission(route_of(route.settings, places, tables, self._boat), Passing(time_factor=None))
        self.speed = float(route.speed.min())
        self.route = self._sailed = route
        self._straight = self.mission.route  # the route without an offset
        self.offset = self.faster = 0.0  # m to starboard of the route, m/s above its speed

    @property
    def followed(self) -> Followed:
        """The mode and the requested changes, for displays and other programs."""
        course = self.course if self.mode == COURSE else math.nan
        return Followed(self.mode, course, self.dodges, self.offset, self.faster)

    @property
    def items(self) -> Sequence[MissionItem]:
        """The route as mission items, home first: the uploaded items, else items made from the route."""
        route = self.route
        return self._items or items_of(route.places, route.speed.tolist(), route.settings.at_end)

    @property
    def item_under_way(self) -> int:
        """Index of the item of the next waypoint."""
        return self._waypoint_items()[self.target]

    def go_to_item(self, index: int) -> None:
        """Go on to the waypoint of an item. Raises InputError if the item is no waypoint."""
        waypoints = self._waypoint_items()
        if index not in waypoints:
            raise InputError(f"item {index} is no waypoint, expected one of {', '.join(map(str, waypoints))}")
        self.follow(max(1, waypoints.index(index)))

    def _waypoint_items(self) -> list[int]:
        """Indices of the items that are waypoints, without home."""
        return [k for k, each in enumerate(self.items) if k and each.command != SPEED]

    def exchange(self, items: Sequence[MissionItem], under_way: bool) -> None:
        """Replace the route by that of uploaded items, in the same plane. Raises InputError if it cannot be sailed.

        Under way to a waypoint that the new route contains, the boat stays on this leg; else the first leg begins.
        """
        towards = self.route.places[self.target] if under_way and self.mission.phase is Phase.UNDER_WAY else None
        route = self.route.with_items(items)
        self._take(route)
        self._items = list(items)
        if under_way:
            near = [displacement(*place, *towards) if towards else (math.inf, 0.0) for place in route.places]
            same = [k for k, each in enumerate(near) if k and math.hypot(*each) < _SAME]
            self._leg = same[0] if same else 1

    @property
    def target(self) -> int:
        """Index of the next waypoint."""
        return max(1, self.mission.target or 0)

    @property
    def phase(self) -> Phase:
        """What the boat should be doing."""
        if self.mode == POSITION:
            return Phase.HOLDING
        return Phase.UNDER_WAY if self.mode == COURSE else self.mission.phase

    @property
    def following(self) -> float:
        """See `Mission`."""
        return self.mission.following if self.mode == ROUTE else math.nan

    @property
    def lead(self) -> float:
        """See `Mission`."""
        return self.mission.lead

    @lead.setter
    def lead(self, lead: float) -> None:
        self.mission.lead = lead

    @property
    def preview(self) -> float:
        """See `Mission`."""
        return self.mission.preview

    @preview.setter
    def preview(self, preview: float) -> None:
        self.mission.preview = preview

    def restart(self) -> None:
        """Begin again with the first leg. A held course or position stays held."""
        self.mission.restart()

    def step(self, north: float, east: float, dt: float, effort: float = 0.0) -> LegState:
        """See `Mission.step`; a held course or position is also returned as a leg."""
        leg = self._step(north, east, dt)
        return leg if not self.faster or math.isnan(leg.speed) else leg._replace(speed=self._changed(leg.speed))

    def _step(self, north: float, east: float, dt: float) -> LegState:
        self.given_course = math.nan
        self.finished = self.mode == ROUTE and not self._leg and self.mission.phase is not Phase.UNDER_WAY
        if self.finished and self.route.settings.at_end == "hold":
            self.mode, self.place, self.finished = POSITION, self.route.places[-1], False
        if math.isnan(north):
            return _UNKNOWN
        if self.mode == ROUTE:
            return self._on_route(north, east, dt)
        if self.mode == COURSE:
            self.given_course = self.course
            return LegState(0, self.course, 0.0, 0.0, _AHEAD, _AHEAD, self.course, self.speed)
        return self._around(north, east)

    def hold_course(self, course: float | None = None) -> None:
        """Hold a course (rad), by default the present one. Raises InputError if the present course is unknown."""
        course = self._known("cog", "course") if course is None else course
        self.mode, self.course, self.dodges = COURSE, wrap(course), False

    def adjust(self, by: float) -> None:
        """Turn the held course, or else the present one, by an angle (rad, + to starboard); hold the result."""
        before, dodges = (self.course if self.mode == COURSE else self._known("cog", "course")), self.dodges
        self.hold_course(before + by)
        self.dodges = dodges

    def dodge(self, by: float | None) -> None:
        """Leave the route at an angle (rad, + to starboard) to its leg; a further call adds its angle. None: go back.

        Raises InputError if the route is not followed.
        """
        if self.mode != ROUTE and not self.dodges:
            raise InputError("the route is not followed, so the boat cannot dodge; expected an adjusted course")
        if by is None:
            self.follow()
            return
        before = self._direction if self.mode == ROUTE else self.course
        if math.isnan(before):
            raise InputError("the leg is not known, expected one to leave")
        self.hold_course(before + by)
        self.dodges = True

    def shift(self, by: float | None) -> None:
        """Move the followed line `by` m further to starboard; None: back to the route itself.

        Raises InputError for an offset above half of the cross-track limit, and if the line cannot be sailed.
        """
        offset = 0.0 if by is None else self.offset + by
        settings = self.route.settings
        most = _OFFSET * widest(settings.limits, settings.lookahead_m)
        if abs(offset) > most:
            raise InputError(f"the offset is {offset:g} m, expected at most {most:g} m, half of the cross-track limit")
        beside, sailed = self._straight, self.route
        if offset:
            beside = self._straight.beside(offset)
            places = zip(beside.north.tolist(), beside.east.tolist(), strict=True)
            latitude, longitude = np.array([displaced(*self._origin, *each) for each in places]).T
            sailed = replace(self.route, latitude=latitude, longitude=longitude)  # refused beyond the fence
        self.mission.exchange(beside)
        self.offset, self._sailed, self.rejoins = offset, sailed, True

    def change_speed(self, by: float | None) -> None:
        """Go faster by `by` m/s than before; None: at the route's speed. Raises InputError for an impossible speed."""
        faster, most = (0.0 if by is None else self.faster + by), self._boat.top_speed
        speeds = [float(each) + faster for each in (self.route.speed.min(), self.route.speed.max())]
        wrong = next((each for each in speeds if not 0.0 < each <= most), None)
        if wrong is not None:
            raise InputError(f"the speed of a leg is {wrong:.2f} m/s, expected above 0 and at most {most:g} m/s")
        self.faster = faster

    def _changed(self, speed: float) -> float:
        return speed + self.faster if speed > 0.0 else speed

    def hold_position(self) -> None:
        """Hold the present position. Raises InputError if it is unknown."""
        self.place = self._known("latitude", "position"), self._known("longitude", "position")
        self.mode, self.dodges = POSITION, False

    def go_back(self) -> None:
        """Return to the rally place, or without one to the route's beginning, and hold this position."""
        self.place, self.mode, self.dodges = self.route.rally or self.route.places[0], POSITION, False

    def follow(self, leg: int | None = None) -> None:
        """Follow the route again, by default on its present leg; 1 is the first leg. Other legs: InputError."""
        legs = len(self.route.latitude) - 1
        if leg is not None and (isinstance(leg, bool) or not isinstance(leg, int) or not 1 <= leg <= legs):
            raise InputError(f"leg is {leg!r}, expected 1 to {legs}")
        self.mode, self._leg, self.rejoins, self.dodges = ROUTE, leg or 0, True, False

    def slowed(self, leg: LegState) -> float:
        """The desired speed on a leg, m/s; reduced before the route's end."""
        route = self.mission.route
        if self.mode != ROUTE or leg.target < len(route) - 1:
            return leg.speed
        left = max(leg.remaining - route.acceptance[leg.target], 0.0)
        return max(_SLOWEST * leg.speed, min(leg.speed, math.sqrt(2.0 * _BRAKING * left)))

    def shown(self, leg: LegState, course_to_steer: float) -> Leg | None:
        """The leg of the tick for displays and other autopilots; unknown without a position, None after the route."""
        row, held = self.row, self.mode != ROUTE
        if self.finished:
            return None
        if not row.valid or math.isnan(leg.direction):
            return UNKNOWN_LEG
        place, names = self.place, ("", "")
        if self.mode == COURSE:
            north, east = _AHEAD * math.cos(self.course), _AHEAD * math.sin(self.course)
            place = displaced(row.latitude, row.longitude, north, east)
        elif self.mode == ROUTE:
            place, names = self._sailed.places[leg.target], (f"WP{max(leg.target - 1, 0)}", f"WP{leg.target}")
        return Leg(
            leg.cross_track,
            leg.direction,
            leg.bearing,
            leg.distance,
            course_to_steer,
            row.sog * math.cos(wrap(leg.bearing - row.cog)),
            *place,
            *names,
            not held and bool(leg.distance <= self.mission.route.acceptance[leg.target]),
            not held and leg.remaining <= 0.0,
            self.slowed(leg),
            self.mode == POSITION,
        )

    def _on_route(self, north: float, east: float, dt: float) -> LegState:
        if self._leg:
            if self.mission.phase is not Phase.UNDER_WAY:
                self.mission.restart()
            self.mission.step(north, east, dt)
            self.mission.go_to(self._leg)
            self._leg, dt = 0, 0.0
        leg = self.mission.step(north, east, dt)
        self._direction = leg.direction
        return leg

    def _around(self, north: float, east: float) -> LegState:
        place_north, place_east = displacement(*self.place, *self._origin)
        off_north, off_east = north - place_north, east - place_east
        distance, outward = math.hypot(off_north, off_east), math.atan2(off_east, off_north)
        circle = outward + 0.5 * math.pi + math.atan(2.0 * (distance - self.radius) / self.radius)
        self.given_course = wrap(circle)
        bearing = wrap(outward + math.pi)
        return LegState(0, self.given_course, 0.0, 0.0, distance, distance, bearing, self.speed)

    def _known(self, name: str, what: str) -> float:
        value = getattr(self.row, name)
        if math.isnan(value):
            raise InputError(f"the {what} is not known, expected one that can be held")
        return value
