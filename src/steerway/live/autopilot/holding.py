"""What the skipper asks for instead of the route: a course that is held, a position, or a leg to go on from."""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.earth import displaced, displacement
from steerway.core.errors import InputError
from steerway.core.leg import UNKNOWN_LEG, Leg
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.route import Guide
from steerway.live.base.rows import Row

ROUTE, COURSE, POSITION = MODES = ("route", "course", "position")
"""What is followed."""
_AHEAD = 1000.0
"""m from the boat to the point that a held course leads to, for displays."""
_TURNS, _LEAST_RADIUS = 3.0, 8.0
"""Radius of the circle about a position: radii of the tightest turn, and m."""


class HoldingGuide:
    """A guide whose route gives way to what is held; see `Guide`.

    A position is held by thrust where the autopilot knows heading and current (`control.holding`). Where it does not,
    and for another autopilot, the course to steer leads round a circle about it, clockwise, since a boat at rest has no
    course: that of a vector field (Nelson, Barber, McLain and Beard, "Vector field path following for miniature air
    vehicles", 2007, equation for orbits).
    """

    def __init__(self, guide: Guide, route: GeodeticRoute):
        self._guide = guide
        self._legs = len(route.latitude) - 1
        self.speed = float(np.min(route.speed))
        turn = math.radians(route.boat.max_yaw_rate_dps)
        self.radius = max(_LEAST_RADIUS, _TURNS * self.speed / turn)
        self.mode = ROUTE
        self.course = math.nan
        self.place = math.nan, math.nan
        self._end = (float(route.latitude[-1]), float(route.longitude[-1])) if route.at_end == "hold" else None
        self._leg = 0  # to go on from; 0: the one under way
        self._row: Row | None = None

    @property
    def finished(self) -> bool:
        """See Guide."""
        return self.mode == ROUTE and self._guide.finished

    def restart(self) -> None:
        """See Guide. What is held stays held."""
        self._guide.restart()

    def step(self, row: Row) -> Leg | None:
        """See Guide."""
        self._row = row
        if self.mode != ROUTE:
            self._guide.interrupt()
        if self.mode == COURSE and row.valid:
            return self._towards(row, self.course, *displaced(row.latitude, row.longitude, *_polar(self.course)))
        if self.mode == POSITION and row.valid:
            return self._around(row)
        if self._leg:
            if self._guide.finished:
                self._guide.restart()
            leg = self._guide.step(row)
            if row.valid and leg is not None:
                self._guide.go_on_from(self._leg)
                self._leg = 0
        leg = self._guide.step(row)
        if leg is None and self._end is not None:
            self.mode, self.place = POSITION, self._end
            return self._around(row) if row.valid else UNKNOWN_LEG
        return leg

    def hold_course(self, course: float | None = None) -> None:
        """Hold a course (rad), by default the present one. Raises InputError where that is unknown."""
        course = self._known("cog", "course") if course is None else course
        self.mode, self.course = COURSE, wrap(course)

    def adjust(self, by: float) -> None:
        """Turn the course that is held by an angle (rad, + to starboard); of another mode, the present course."""
        before = self.course if self.mode == COURSE else self._known("cog", "course")
        self.hold_course(before + by)

    def hold_position(self) -> None:
        """Hold the present position. Raises InputError where that is unknown."""
        self.place = self._known("latitude", "position"), self._known("longitude", "position")
        self.mode = POSITION

    def follow(self, leg: int | None = None) -> None:
        """Follow the route again: go on, or from a leg (1 is the first). Raises InputError for a leg that is none."""
        if leg is not None and (isinstance(leg, bool) or not isinstance(leg, int) or not 1 <= leg <= self._legs):
            raise InputError(f"leg is {leg!r}, expected 1 to {self._legs}")
        self.mode, self._leg = ROUTE, leg or 0

    def _known(self, name, what):
        value = math.nan if self._row is None else getattr(self._row, name)
        if math.isnan(value):
            raise InputError(f"the {what} is not known, expected one that can be held")
        return value

    def _towards(self, row, course, latitude, longitude):
        closing = row.sog * math.cos(wrap(course - row.cog))
        return Leg(0.0, course, course, _AHEAD, course, closing, latitude, longitude, speed=self.speed)

    def _around(self, row):
        north, east = displacement(row.latitude, row.longitude, *self.place)
        distance, outward = math.hypot(north, east), math.atan2(east, north)
        course = wrap(outward + 0.5 * math.pi + math.atan(2.0 * (distance - self.radius) / self.radius))
        closing = -row.sog * math.cos(wrap(outward - row.cog))
        bearing = wrap(outward + math.pi)
        return Leg(0.0, course, bearing, distance, course, closing, *self.place, speed=self.speed, is_held=True)


def _polar(course):
    return _AHEAD * math.cos(course), _AHEAD * math.sin(course)
