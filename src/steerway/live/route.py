"""The route under way, aboard: which leg, how far off it, and the course that leads back to it.

Waypoints come as TOML (`[[waypoint]]` with `lat_deg` and `lon_deg`, `lookahead` and `acceptance` in m beside them), as
a GPX route (`rtept`) or as a GeoJSON LineString.
"""

import json
import math
import tomllib
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from steerway.angles import wrap
from steerway.earth import displaced, displacement
from steerway.errors import InputError
from steerway.formats.nmea0183.writing import Leg
from steerway.guidance.line_of_sight import LineOfSight
from steerway.guidance.route import Route
from steerway.guidance.waypoints import Mission, Phase
from steerway.live.heard import Row

LOOKAHEAD = 20.0
"""m, where a file says nothing: some ten lengths of a small boat."""
UNKNOWN_LEG = Leg(*[math.nan] * 8)
_KEYS = ("waypoint", "lookahead", "acceptance", "name")


@dataclass(frozen=True)
class GeodeticRoute:
    """Waypoints in latitude and longitude (n,), rad, in the order in which they are sailed."""

    latitude: np.ndarray
    longitude: np.ndarray
    lookahead: float = LOOKAHEAD
    acceptance: float = 10.0

    @classmethod
    def load(cls, path: str | Path) -> "GeodeticRoute":
        """A route from a file. Raises InputError that names the file and what is wrong with it."""
        readers = {".toml": _from_toml, ".gpx": _from_gpx, ".geojson": _from_geojson, ".json": _from_geojson}
        reader = readers.get(Path(path).suffix.lower())
        if reader is None:
            raise InputError(f"route {path} has an unknown ending, expected one of {', '.join(readers)}")
        try:
            points, settings = reader(Path(path).read_text(encoding="utf-8"))
            degrees = np.array([[float(a) for a in point] for point in points]).reshape(-1, 2)
            settings = {name: float(value) for name, value in settings.items()}
        except OSError as error:
            raise InputError(f"route {path} cannot be read: {error.strerror}") from None
        except (ValueError, KeyError, TypeError, ElementTree.ParseError) as error:
            raise InputError(f"route {path} is malformed ({error}), expected waypoints in degrees") from None
        if len(degrees) < 2:
            raise InputError(f"route {path} has {len(degrees)} waypoints, expected at least 2")
        wrong = ~((np.abs(degrees[:, 0]) <= 89.0) & (np.abs(degrees[:, 1]) <= 180.0))
        if wrong.any():
            raise InputError(
                f"route {path}: waypoint {int(np.argmax(wrong))} lies at {degrees[wrong][0].tolist()}, expected "
                "latitude within ±89° and longitude within ±180°"
            )
        return cls(*np.radians(degrees).T, **settings)


def _from_toml(text):
    table = tomllib.loads(text)
    for name in table:
        if name not in _KEYS:
            raise KeyError(f"unknown key {name}")
    settings = {name: table[name] for name in ("lookahead", "acceptance") if name in table}
    return [(point["lat_deg"], point["lon_deg"]) for point in table["waypoint"]], settings


def _from_gpx(text):
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("a document type is declared")
    points = [each for each in ElementTree.fromstring(text).iter() if each.tag.rpartition("}")[2] == "rtept"]
    return [(point.attrib["lat"], point.attrib["lon"]) for point in points], {}


def _from_geojson(text):
    found = json.loads(text)
    features = found.get("features", [found])
    lines = [each.get("geometry", each) for each in features]
    line = next(each for each in [*lines, {"type": None}] if each["type"] in ("LineString", None))
    return [(point[1], point[0]) for point in line["coordinates"]], {}


class Guide:
    """Follows a route by what is said of the boat; one step a row.

    Shapes and units as in GeodeticRoute. Raises InputError for a route that cannot be sailed.
    """

    def __init__(self, line: GeodeticRoute):
        self._line = line
        self._origin = float(line.latitude[0]), float(line.longitude[0])
        places = [displacement(*place, *self._origin) for place in zip(line.latitude, line.longitude, strict=True)]
        north, east = np.array(places).T
        self.route = Route(north, east, acceptance=line.acceptance)
        self.mission = Mission(self.route)
        self._law = LineOfSight(line.lookahead)
        self._time = math.nan

    @property
    def finished(self) -> bool:
        """Whether the last waypoint is behind."""
        return self.mission.phase is not Phase.UNDER_WAY

    def step(self, row: Row) -> Leg | None:
        """The leg as seen at a row, all of it unknown without a position; None when the route is done."""
        if self.finished:
            return None
        if not row.valid:
            return UNKNOWN_LEG
        dt = max(row.time - self._time, 0.0) if math.isfinite(self._time) else 0.0
        self._time = row.time
        place = displacement(row.latitude, row.longitude, *self._origin)
        seen = self.mission.step(*place, dt)
        target = seen.target
        steer = self._law.step(seen, row.cog, row.sog, dt).angle
        closing = row.sog * math.cos(wrap(seen.bearing - row.cog))
        destination = displaced(*self._origin, self.route.north[target], self.route.east[target])
        return Leg(
            seen.cross_track,
            seen.direction,
            seen.bearing,
            seen.distance,
            steer,
            closing,
            *destination,
            f"WP{max(target - 1, 0)}",
            f"WP{target}",
            seen.distance <= self.route.acceptance[target],
            seen.remaining <= 0.0,
        )
