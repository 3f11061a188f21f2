"""The mission file: waypoints, speeds, fence, limits and the boat's response; TOML, GPX or GeoJSON.

TOML has `[[waypoint]]` with `lat_deg` and `lon_deg`, `[survey]`, and what the tables below list; a GPX route has its
`rtept`; in GeoJSON the first LineString is the route and the first Polygon the fence. Defaults are those of
`MissionTable`.
"""

import json
import math
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, ValidationError

from steerway.core.earth import displaced
from steerway.core.errors import InputError
from steerway.core.schema import Flag, Latitude, Longitude, NotNegative, Positive, Table
from steerway.core.toml import parse_toml
from steerway.core.validation import refusal
from steerway.guidance.corners import KINDS as CORNERS
from steerway.guidance.laws import COURSE_LAWS
from steerway.guidance.survey import SurveyTable
from steerway.live.autopilot.fence import Fence

LOOKAHEAD = 20.0
"""m, the default: some ten lengths of a small boat."""


class Place(Table):
    """A place."""

    lat_deg: Latitude = Field(description="degrees, + north")
    lon_deg: Longitude = Field(description="degrees, + east")

    @property
    def place(self) -> tuple[float, float]:
        """(latitude, longitude), rad."""
        return math.radians(self.lat_deg), math.radians(self.lon_deg)


class Waypoint(Place):
    """A waypoint, and what differs from the rest of the route on the leg that leads there."""

    speed_mps: Positive | None = None
    acceptance: Positive | None = None  # m


class Survey(SurveyTable, Place):
    """The lines of a survey; the place is where the first begins."""

    def waypoints(self) -> list[Waypoint]:
        """The waypoints of the lines."""
        places = [np.degrees(displaced(*self.place, *offset)).tolist() for offset in self.offsets()]
        return [Waypoint(lat_deg=latitude, lon_deg=longitude) for latitude, longitude in places]


class Limits(Table):
    """The autopilot stops beyond these. None: no limit."""

    min_sog_mps: Positive | None = None
    max_sog_mps: Positive | None = None
    cross_track: Positive | None = None  # m to either side of the leg


class BoatTable(Table):
    """How the boat responds to commands; see `steerway.live.autopilot.piloting`."""

    max_yaw_rate_dps: Positive = 20.0  # largest that is commanded
    yaw_time: NotNegative = 1.5  # s, time constant of the yaw rate with propellers
    rate_time: Positive = 1.3  # s, of the yaw rate with a loop of its own
    yaw_munk: NotNegative = 0.0  # s²/m², loss of damping with the speed squared
    yaw_quadratic: NotNegative = 0.0  # s/rad, damping that grows with the yaw rate
    full_yaw_rate_dps: Positive = 90.0  # with one propeller ahead, the other astern
    top_speed_mps: Positive = 3.0  # at full thrust
    surge_time: Positive = 1.5  # s, time constant of the speed
    reverse: Flag = False  # whether the propellers turn astern


class MissionTable(Table):
    """What a mission file may set beside its waypoints and fence."""

    name: str = ""
    lookahead: Positive = LOOKAHEAD  # m
    acceptance: Positive = 10.0  # m
    speed_mps: Positive = 1.0
    law: Literal[*COURSE_LAWS] = "line-of-sight"  # type: ignore[valid-type]
    corners: Literal[*CORNERS] = CORNERS[0]  # type: ignore[valid-type]
    corner_radius: Positive | None = None  # m, of arcs and clothoids
    at_end: Literal["stop", "hold"] = "stop"
    hold_radius: Positive = 5.0  # m
    safe: Literal["stop", "hand-back"] = "stop"
    limits: Limits = Limits()
    boat: BoatTable = BoatTable()


class MissionFile(MissionTable):
    waypoint: list[Waypoint] = Field([], description="[[waypoint]] tables with lat_deg and lon_deg")
    survey: Survey | None = None
    fence: list[Place] = Field([])


@dataclass(frozen=True, eq=False)
class GeodeticRoute:
    """Waypoints in latitude and longitude (n,), rad, in the order in which they are sailed.

    lookahead:  Δ of the line of sight, m.
    acceptance: radius within which a waypoint is reached, m, one or (n,).
    speed:      desired on the leg to each waypoint, m/s, one or (n,).
    fence:      the area that the boat must not leave.
    limits, boat, safe: see `Limits`, `BoatTable`; `safe` "stop" (zero thrust and yaw rate) or "hand-back" (no order).
    law:        guidance law, one of `laws.COURSE_LAWS`.
    at_end:     "stop", or "hold" the last waypoint; hold_radius: m within which the boat may drift about a position.
    corners:    one of `corners.KINDS`; corner_radius: of a curve, m, by default one and a half of the tightest turn.
    Raises InputError for a route that leaves its fence.
    """

    latitude: np.ndarray
    longitude: np.ndarray
    lookahead: float = LOOKAHEAD
    acceptance: np.ndarray | float = 10.0
    speed: np.ndarray | float = 1.0
    fence: Fence | None = None
    limits: Limits = field(default_factory=Limits)
    boat: BoatTable = field(default_factory=BoatTable)
    safe: str = "stop"
    law: str = "line-of-sight"
    corners: str = CORNERS[0]
    corner_radius: float | None = None
    at_end: str = "stop"
    hold_radius: float = 5.0

    def __post_init__(self):
        places = list(zip(self.latitude, self.longitude, strict=True))
        if self.fence is None:
            return
        for k, place in enumerate(places):
            if not self.fence.holds(*place):
                raise InputError(f"waypoint {k} lies outside of the fence, expected a route inside of it")
            if k and self.fence.leg_leaves(places[k - 1], place):
                raise InputError(f"the leg to waypoint {k} crosses the fence, expected a route inside of it")

    @classmethod
    def load(cls, path: str | Path) -> "GeodeticRoute":
        """A route from a file. Raises InputError that names the file and what is wrong with it."""
        readers = {
            ".toml": lambda text: parse_toml(text, f"route {path}"),
            ".gpx": _from_gpx,
            ".geojson": _from_geojson,
            ".json": _from_geojson,
        }
        reader = readers.get(Path(path).suffix.lower())
        if reader is None:
            raise InputError(f"route {path} has an unknown ending, expected one of {', '.join(readers)}")
        try:
            table = MissionFile(**reader(Path(path).read_text(encoding="utf-8")))
        except OSError as error:
            raise InputError(f"route {path} cannot be read: {error.strerror}") from None
        except ValidationError as error:
            raise refusal(f"route {path}", error, MissionFile) from None
        except InputError:
            raise
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError, ElementTree.ParseError) as error:
            raise InputError(f"route {path} is malformed ({error}), expected waypoints in degrees") from None
        try:
            waypoints = table.waypoint + ([] if table.survey is None else table.survey.waypoints())
        except ValidationError as error:
            raise refusal(f"route {path}: a waypoint of the survey", error, Waypoint) from None
        if len(waypoints) < 2:
            raise InputError(f"route {path} has {len(waypoints)} waypoints, expected at least 2, or a table [survey]")
        try:
            return cls.of(waypoints, table.fence, table)
        except InputError as error:
            raise InputError(f"route {path}: {error}") from None

    @classmethod
    def of(cls, waypoints: list[Waypoint], fence: list[Place] = (), settings: MissionTable | None = None):
        """A route from tables."""
        table = settings or MissionTable()
        latitude, longitude = np.array([each.place for each in waypoints]).T
        return cls(
            latitude,
            longitude,
            table.lookahead,
            np.array([each.acceptance or table.acceptance for each in waypoints]),
            np.array([each.speed_mps or table.speed_mps for each in waypoints]),
            Fence([each.place for each in fence]) if fence else None,
            table.limits,
            table.boat,
            table.safe,
            table.law,
            table.corners,
            table.corner_radius,
            table.at_end,
            table.hold_radius,
        )


def _from_gpx(text):
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("a document type is declared")
    points = [each for each in ElementTree.fromstring(text).iter() if each.tag.rpartition("}")[2] == "rtept"]
    return {"waypoint": [{f"{axis}_deg": float(each.attrib[axis]) for axis in ("lat", "lon")} for each in points]}


def _from_geojson(text):
    found = json.loads(text)
    shapes = [each.get("geometry", each) for each in found.get("features", [found])]
    lines = [each["coordinates"] for each in shapes if each["type"] == "LineString"]
    rings = [each["coordinates"][0] for each in shapes if each["type"] == "Polygon"]
    if any(len(each["coordinates"]) > 1 for each in shapes if each["type"] == "Polygon"):
        raise ValueError("the fence has holes")
    if not lines:
        raise ValueError("it holds no LineString")
    return {"waypoint": _places(lines[0]), "fence": _places(rings[0]) if rings else []}


def _places(coordinates):
    return [{"lat_deg": each[1], "lon_deg": each[0]} for each in coordinates]
