"""The tables of a route in scenarios and missions: positions, waypoints, survey lines, corners.

A position is given in metres north and east of an origin, or in latitude and longitude.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, Protocol

import numpy as np
from pydantic import AliasChoices, Field

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.earth import displaced, displacement
from steerway.core.errors import InputError
from steerway.core.settings import Latitude, Longitude, NotNegative, Number, Positive, Table
from steerway.guidance.corners import KINDS as CORNERS
from steerway.guidance.route import Route


def lawnmower(
    north: float, east: float, direction: float, length: float, spacing: float, lines: int, run_in: float = 0.0
) -> Floats:
    """Waypoints (2 · lines, 2) of parallel lines to and fro, north and east in m.

    The first line begins at (north, east) and runs `length` m in a `direction` (rad). Each next line lies `spacing` m
    to starboard of the line before, to port if negative. Every line is extended by `run_in` m at both ends, so that the
    turns and their cross-track errors lie outside of the area. Raises InputError for less than one line, a length that
    is not positive, and a spacing of 0.
    """
    positive("survey.length", length)
    not_negative("survey.run_in", run_in)
    if lines < 1:
        raise InputError(f"survey.lines is {lines}, expected at least 1")
    if not math.isfinite(spacing) or spacing == 0.0:
        raise InputError(f"survey.spacing is {spacing:g} m, expected a number other than 0")
    ahead = np.array([math.cos(direction), math.sin(direction)])
    abeam = np.array([-ahead[1], ahead[0]])
    points = []
    for k in range(lines):
        ends = (-run_in, length + run_in)
        for along in ends if k % 2 == 0 else reversed(ends):
            points.append(np.array([north, east]) + along * ahead + k * spacing * abeam)
    return np.array(points)


class SurveyTable(Table):
    """Parallel survey lines, see `lawnmower`."""

    direction_deg: Number = 0.0
    """Direction of the first line, from true north."""
    length: Annotated[Positive, "m"]
    """Length of a line."""
    spacing: Annotated[Number, "m"]
    """Distance between lines; the next line lies to starboard of the first, to port if negative."""
    lines: Annotated[int, Field(strict=True, ge=1, le=1000)]
    """Number of lines."""
    run_in: Annotated[NotNegative, "m"] = 0.0
    """Extension of every line at both ends, so that the boat turns outside of the area."""

    def offsets(self) -> Floats:
        """Waypoints (2 · lines, 2), north and east from the beginning of the first line, m."""
        towards = math.radians(self.direction_deg)
        return lawnmower(0.0, 0.0, towards, self.length, self.spacing, self.lines, self.run_in)


Place = tuple[float, float]
"""Latitude and longitude, rad."""


class PlaceTable(Table):
    """A position, in m from the origin or as latitude and longitude."""

    north: Annotated[Number | None, "m"] = None
    """North of the position from the origin."""
    east: Annotated[Number | None, "m"] = None
    """East of the position from the origin."""
    latitude_deg: Latitude | None = Field(default=None, validation_alias=AliasChoices("latitude_deg", "lat_deg"))
    """Latitude (WGS 84), positive north."""
    longitude_deg: Longitude | None = Field(default=None, validation_alias=AliasChoices("longitude_deg", "lon_deg"))
    """Longitude (WGS 84), positive east."""

    def is_plane(self, name: str) -> bool:
        """Whether the position is in m. Raises InputError with the name unless exactly one pair is given."""
        return self._pair(name)[0]

    def _pair(self, name: str) -> tuple[bool, float, float]:
        """`is_plane`, and north and east (m) or latitude and longitude (rad)."""
        north, east, latitude, longitude = self.north, self.east, self.latitude_deg, self.longitude_deg
        if north is not None and east is not None and latitude is None and longitude is None:
            return True, north, east
        if latitude is not None and longitude is not None and north is None and east is None:
            return False, math.radians(latitude), math.radians(longitude)
        given = [key for key in _COORDINATES if getattr(self, key) is not None]
        found = " and ".join(given) or "no place"
        raise InputError(f"{name} gives {found}, expected north and east in m, or latitude_deg and longitude_deg")

    def plane(self, origin: Place, name: str) -> tuple[float, float]:
        """North and east of the origin, m; the name is for errors."""
        is_plane, first, second = self._pair(name)
        return (first, second) if is_plane else displacement(first, second, *origin)

    def globe(self, origin: Place | None, name: str) -> Place:
        """Latitude and longitude, rad; the name is for errors."""
        is_plane, first, second = self._pair(name)
        if not is_plane:
            return first, second
        if origin is None:
            raise InputError(f"{name} gives north and east, expected lat_deg and lon_deg, or a table [origin]")
        return _within_reach(displaced(*origin, first, second), name)

    def moved(self, north: float, east: float) -> dict[str, float]:
        """The keys of the position `north` and `east` m from this one, in the same kind of coordinates."""
        is_plane, first, second = self._pair("survey")
        if is_plane:
            return {"north": first + north, "east": second + east}
        place = _within_reach(displaced(first, second, north, east), "a waypoint of the survey")
        return dict(zip(("latitude_deg", "longitude_deg"), np.degrees(place).tolist(), strict=True))


_LARGEST_LATITUDE = math.radians(89.0)


def _within_reach(place: Place, name: str) -> Place:
    """The position itself. Raises InputError for a latitude or longitude beyond the limits of routes."""
    if abs(place[0]) <= _LARGEST_LATITUDE and abs(place[1]) <= math.pi:
        return place
    latitude, longitude = map(math.degrees, place)
    raise InputError(f"{name} is at latitude {latitude:g}° and longitude {longitude:g}°, expected at most 89° and 180°")


_COORDINATES = ("north", "east", "latitude_deg", "longitude_deg")


class WaypointTable(PlaceTable):
    """A waypoint, with keys that override those of the route on the leg to it."""

    speed: Annotated[Positive | None, "m/s"] = Field(default=None, validation_alias=AliasChoices("speed", "speed_mps"))
    """Speed over ground on the leg to this waypoint; by default that of the route."""
    acceptance: Annotated[Positive | None, "m"] = None
    """Radius within which this waypoint counts as reached; by default that of the route."""


class StayWaypointTable(WaypointTable):
    """A waypoint of a scenario."""

    stay: Annotated[NotNegative, "s"] = 0.0
    """Duration of station keeping at this waypoint."""


class SurveyRouteTable(SurveyTable, PlaceTable):
    """A survey; the position is the beginning of its first line."""

    def points(self) -> list[dict[str, float]]:
        """The keys of the positions of the lines' ends."""
        return [self.moved(*offset) for offset in self.offsets().tolist()]


class OriginTable(Table):
    """The origin, at which north = east = 0."""

    latitude_deg: Latitude = Field(default=63.44, validation_alias=AliasChoices("latitude_deg", "lat_deg"))
    """Latitude (WGS 84) of the point where north and east are 0."""
    longitude_deg: Longitude = Field(default=10.40, validation_alias=AliasChoices("longitude_deg", "lon_deg"))
    """Longitude (WGS 84) of the point where north and east are 0."""

    @property
    def place(self) -> Place:
        """Latitude and longitude, rad."""
        return math.radians(self.latitude_deg), math.radians(self.longitude_deg)


class RouteKeys(Table):
    """Keys of a route in addition to its waypoints: survey lines that follow them, and corners."""

    survey: SurveyRouteTable | None = None
    """Parallel survey lines, which follow the waypoints."""
    acceptance: Annotated[Positive | None, "m"] = None
    """Radius within which a waypoint counts as reached; by default the boat's."""
    corners: Literal[*CORNERS] = CORNERS[0]  # type: ignore[valid-type]
    """Whether the boat passes through its waypoints or cuts the corners by an arc or a clothoid."""
    corner_radius: Annotated[Positive | None, "m"] = None
    """Smallest radius of a cut corner; by default 1.5 times the radius of the tightest turn."""


class Turning(Protocol):
    """Parameters of a boat for its routes: `control.boats.Boat`."""

    @property
    def acceptance(self) -> float: ...

    @property
    def corner_radius(self) -> float: ...


def route_of(
    keys: RouteKeys, places: Sequence[tuple[float, float]], waypoints: Sequence[WaypointTable], boat: Turning
) -> Route:
    """The route through positions (north, east; m); acceptance and corner radius default to the boat's."""
    north, east = np.array(places, dtype=float).reshape(-1, 2).T
    acceptance, speed = (
        np.array([np.nan if getattr(each, name) is None else getattr(each, name) for each in waypoints])
        for name in ("acceptance", "speed")
    )
    radius = boat.corner_radius if keys.corner_radius is None else keys.corner_radius
    return Route(north, east, acceptance, speed, boat.acceptance, keys.corners, radius)
