"""Polygons: the fence, which the boat must not leave, and areas that it must not enter, now and for `AHEAD` s."""

import math
from collections.abc import Sequence

from steerway.core.earth import displacement
from steerway.core.errors import InputError

AHEAD = 3.0
"""Time (s) within which the boat must not cross the fence if it keeps its course and speed."""
_SOON = f"within {AHEAD:g} s"


class Polygon:
    """A simple polygon of places (latitude, longitude; rad); its last corner is joined to the first.

    Raises InputError for fewer than three corners, and for edges that cross.
    """

    def __init__(self, places: Sequence[tuple[float, float]], name: str = "the fence"):
        self.name = name
        if len(places) > 1 and tuple(places[0]) == tuple(places[-1]):
            places = places[:-1]
        if len(places) < 3:
            raise InputError(f"{name} has {len(places)} corners, expected at least 3")
        self.places = tuple(places)
        self._origin = float(places[0][0]), float(places[0][1])
        corners = [displacement(*place, *self._origin) for place in places]
        self._edges = [(*corner, *after) for corner, after in zip(corners, corners[1:] + corners[:1], strict=True)]
        self._refuse_crossings()

    def is_met(self, latitude: float, longitude: float, sog: float, cog: float) -> bool:
        """Whether the boat crosses an edge within `AHEAD` s if it keeps its course and speed."""
        way = sog * AHEAD
        if not (math.isfinite(way) and math.isfinite(cog)):
            return False
        north, east = displacement(latitude, longitude, *self._origin)
        return self.is_crossed(north, east, north + way * math.cos(cog), east + way * math.sin(cog))

    def holds(self, latitude: float, longitude: float) -> bool:
        """Whether a place is inside."""
        return self._holds(*displacement(latitude, longitude, *self._origin))

    def is_crossed_by(self, start: tuple[float, float], end: tuple[float, float]) -> bool:
        """Whether the straight leg between two places (latitude, longitude) crosses an edge."""
        return self.is_crossed(*displacement(*start, *self._origin), *displacement(*end, *self._origin))

    def is_crossed(self, north_0: float, east_0: float, north_1: float, east_1: float) -> bool:
        """Whether the line between two points of the polygon's own plane (m) crosses an edge."""
        way = (north_0, east_0, north_1, east_1)
        return any(_cross(*way, *edge) for edge in self._edges)

    def _holds(self, north: float, east: float) -> bool:
        """Whether a point is inside: a ray from it to the east then crosses an odd number of edges."""
        inside = False
        for north_0, east_0, north_1, east_1 in self._edges:
            if (north_0 > north) != (north_1 > north):
                meets = east_0 + (north - north_0) / (north_1 - north_0) * (east_1 - east_0)
                inside ^= east < meets
        return inside

    def _refuse_crossings(self) -> None:
        count = len(self._edges)
        for i in range(count):
            for j in range(i + 2, count - (i == 0)):
                if _cross(*self._edges[i], *self._edges[j]):
                    raise InputError(
                        f"{self.name} crosses itself between corners {i} and {j}, expected a simple polygon"
                    )


class Fence(Polygon):
    """The area that the boat must not leave."""

    def trouble(self, latitude: float, longitude: float, sog: float = 0.0, cog: float = 0.0) -> str:
        """Why to stop here; "" while the boat is inside and will stay inside for `AHEAD` s."""
        if not self.holds(latitude, longitude):
            return "the fence is left"
        return f"the fence is about to be left, {_SOON}" if self.is_met(latitude, longitude, sog, cog) else ""


class NoGo(Polygon):
    """An area that the boat must not enter."""

    def trouble(self, latitude: float, longitude: float, sog: float = 0.0, cog: float = 0.0) -> str:
        """Why to stop here; "" while the boat is outside and will stay outside for `AHEAD` s."""
        if self.holds(latitude, longitude):
            return f"the boat is inside of {self.name}"
        return f"{self.name} is about to be entered, {_SOON}" if self.is_met(latitude, longitude, sog, cog) else ""


def _cross(
    a_north: float,
    a_east: float,
    b_north: float,
    b_east: float,
    c_north: float,
    c_east: float,
    d_north: float,
    d_east: float,
) -> bool:
    """Whether the segments ab and cd cross at a point inside both segments."""

    def side(north: float, east: float, north_0: float, east_0: float, north_1: float, east_1: float) -> float:
        return (north_1 - north_0) * (east - east_0) - (east_1 - east_0) * (north - north_0)

    c, d = (side(*end, a_north, a_east, b_north, b_east) for end in ((c_north, c_east), (d_north, d_east)))
    a, b = (side(*end, c_north, c_east, d_north, d_east) for end in ((a_north, a_east), (b_north, b_east)))
    return (c > 0.0) != (d > 0.0) and (a > 0.0) != (b > 0.0)
