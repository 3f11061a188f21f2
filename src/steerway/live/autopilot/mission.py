"""The mission file: waypoints, speeds, fence, limits and the boat's response; TOML, GPX or GeoJSON.

TOML: `[[waypoint]]` with `lat_deg` and `lon_deg`, or with `north` and `east` (m) from an `[origin]`; `[survey]`; and
the keys of the tables below. GPX: the `rtept` of a route. GeoJSON: the first LineString is the route, the first Polygon
the fence. Defaults are those of `MissionTable`.
"""

import json
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.core.settings import Flag, NotNegative, Positive, Table, parse_toml
from steerway.guidance.laws import LAWS, GuidanceTable
from steerway.guidance.route_table import PlaceTable, RouteKeys, WaypointTable
from steerway.live.autopilot.fence import Fence, NoGo
from steerway.live.autopilot.mission_items import MissionItem, mission_of, read_plan, read_waypoints

LOOKAHEAD = 20.0
"""Default lookahead distance, m: some ten lengths of a small boat."""


class Limits(Table):
    """Limits at which the autopilot stops; without a key there is no limit."""

    min_sog_mps: Positive | None = None
    """SOG below which the autopilot stops."""
    max_sog_mps: Positive | None = None
    """SOG above which the autopilot stops."""
    cross_track: Annotated[Positive | None, "m"] = None
    """Largest cross-track error; by default three look-ahead distances, once the boat has been on its leg."""
    operator_lost: Annotated[Positive | None, "s"] = None
    """Longest time without a helm page, a control client or a ground station."""


Instead = Literal["stop", "hand-back", "hold", "return"]
"""Actions, in order: the safe output; no orders; hold the present position; return to the rally place and hold it."""


class OnStop(Table):
    """Actions in place of a stop, for reasons that leave the boat able to steer."""

    operator: Instead = "stop"
    """Action when no operator was heard for `operator_lost`."""
    off_route: Instead = "stop"
    """Action beyond the cross-track limit."""


class BoatTable(Table):
    """How the boat responds to commands; see `steerway.live.autopilot.piloting`."""

    max_yaw_rate_dps: Positive | None = None
    """Largest ordered yaw rate; by default the vehicle's limit, else 20."""
    yaw_time: Annotated[NotNegative, "s"] = 1.5
    """Time constant of the yaw rate, for a boat steered by its propellers."""
    rate_time: Annotated[Positive, "s"] = 1.3
    """Time constant of the yaw rate, for a vehicle with a yaw-rate loop of its own."""
    yaw_munk: Annotated[NotNegative, "s²/m²"] = 0.0
    """Loss of yaw damping per speed squared."""
    yaw_quadratic: Annotated[NotNegative, "s/rad"] = 0.0
    """Quadratic yaw damping: increase of the damping with the yaw rate."""
    full_yaw_rate_dps: Positive = 90.0
    """Yaw rate with one propeller full ahead, the other full astern."""
    top_speed_mps: Positive = 3.0
    """Speed through the water at full thrust."""
    surge_time: Annotated[Positive, "s"] = 1.5
    """Time constant of the speed."""
    slip_time: Annotated[NotNegative, "s"] = 0.2
    """Time constant with which the motion through the water follows the bow."""
    reverse: Flag = False
    """Whether the propellers can turn astern."""
    pivot_angle_deg: Positive | None = None
    """Smallest corner at which the boat stops and turns on the spot; by default none."""


class MissionTable(RouteKeys):
    """What a mission file may set beside its waypoints and fence."""

    name: str = ""
    """Name of the mission."""
    origin: PlaceTable | None = None
    """Position where north and east are 0."""
    law: Literal[*LAWS] | None = None  # type: ignore[valid-type]
    """Short for `guidance.law`."""
    lookahead: Annotated[Positive | None, "m"] = None
    """Short for `guidance.lookahead`; 20 m if both are missing."""
    guidance: GuidanceTable = GuidanceTable()
    """Guidance law and its gains, as in scenarios."""
    acceptance: Annotated[Positive, "m"] = 10.0
    """Radius within which a waypoint counts as reached."""
    speed_mps: Positive = 1.0
    """Speed over ground where a waypoint gives none."""
    at_end: Literal["stop", "hold"] = "stop"
    """After the last waypoint, stop or hold the position."""
    hold_radius: Annotated[Positive, "m"] = 5.0
    """Radius within which the boat may drift about a position that it holds."""
    safe: Literal["stop", "hand-back"] = "stop"
    """Orders when stopped: zero thrust and yaw rate, or none."""
    on_stop: OnStop = OnStop()
    """Actions in place of a stop."""
    rally: PlaceTable | None = None
    """Position for the action "return"; by default the first waypoint."""
    limits: Limits = Limits()
    """Limits at which the autopilot stops."""
    boat: BoatTable = BoatTable()
    """Response of the boat to its orders."""

    @property
    def lookahead_m(self) -> float:
        """Lookahead distance, m."""
        return self.lookahead or self.guidance.lookahead or LOOKAHEAD

    @property
    def guided(self) -> GuidanceTable:
        """The table [guidance], with the keys `_SHORT` of the mission and the default lookahead filled in."""
        short = {name: getattr(self, name) for name in _SHORT if getattr(self, name) is not None}
        return self.guidance.model_copy(update=short | {"lookahead": self.lookahead_m})


_SHORT = ("law", "lookahead")
"""Keys of a mission that are short for the same keys of its table [guidance]."""


class MissionFile(MissionTable):
    waypoint: tuple[WaypointTable, ...] = ()
    """Waypoints in the order in which they are sailed."""
    fence: tuple[PlaceTable, ...] = ()
    """Corners of the area that the boat must not leave."""
    no_go: tuple[tuple[PlaceTable, ...], ...] = ()
    """Polygons that the boat must not enter."""


@dataclass(frozen=True, eq=False)
class GeodeticRoute:
    """Waypoints in latitude and longitude (n,), rad, in the order in which they are sailed.

    settings: the keys of the mission file. waypoints: tables with the keys that differ on the leg to each waypoint.
    fence: the area that the boat must not leave. no_go: areas that the boat must not enter. rally: the place to return
    to; None for the route's beginning.
    Raises InputError for a route that leaves its fence or enters a no-go area, and a rally place outside of the fence.
    """

    latitude: np.ndarray
    longitude: np.ndarray
    settings: MissionTable = field(default_factory=MissionTable)
    waypoints: Sequence[WaypointTable] = ()
    fence: Fence | None = None
    rally: tuple[float, float] | None = None
    no_go: tuple[NoGo, ...] = ()

    def __post_init__(self) -> None:
        for area in self.no_go:
            for k, place in enumerate(self.places):
                if area.holds(*place) or (k and area.is_crossed_by(self.places[k - 1], place)):
                    raise InputError(
                        f"the leg to waypoint {max(k, 1)} enters {area.name}, expected a route outside of it"
                    )
        if self.fence is None:
            return
        if self.rally is not None and not self.fence.holds(*self.rally):
            raise InputError("the rally place lies outside of the fence, expected one inside of it")
        for k, place in enumerate(self.places):
            if not self.fence.holds(*place):
                raise InputError(f"waypoint {k} lies outside of the fence, expected a route inside of it")
            if k and self.fence.is_crossed_by(self.places[k - 1], place):
                raise InputError(f"the leg to waypoint {k} crosses the fence, expected a route inside of it")

    @cached_property
    def places(self) -> list[tuple[float, float]]:
        """Latitude and longitude of the waypoints, rad."""
        return list(zip(self.latitude.tolist(), self.longitude.tolist(), strict=True))

    @cached_property
    def speed(self) -> np.ndarray:
        """(n,) desired speed on the leg to each waypoint, m/s."""
        return self._column("speed", self.settings.speed_mps)

    @cached_property
    def acceptance(self) -> np.ndarray:
        """(n,) radius within which each waypoint is reached, m."""
        return self._column("acceptance", self.settings.acceptance)

    @property
    def tables(self) -> Sequence[WaypointTable]:
        """For each waypoint the table with the keys that differ on the leg to it."""
        return self.waypoints or [WaypointTable()] * len(self.latitude)

    def _column(self, name: str, otherwise: float) -> Floats:
        return np.array([getattr(each, name) or otherwise for each in self.tables])

    def with_items(self, items: Sequence[MissionItem]) -> "GeodeticRoute":
        """A route of mission items (the first is the home position) with the settings, fence and areas of this route.

        Raises InputError if it cannot be sailed.
        """
        home = (items[0].latitude, items[0].longitude) if items and items[0].latitude else None
        keys = mission_of(items[1:], home)
        waypoints = [WaypointTable(**each) for each in keys["waypoint"]]
        if len(waypoints) < 2:
            raise InputError(f"the mission has {len(waypoints)} waypoints, expected at least 2")
        latitude, longitude = np.array([each.globe(None, f"waypoint[{k}]") for k, each in enumerate(waypoints)]).T
        settings = self.settings.model_copy(update={"survey": None, "at_end": keys.get("at_end", "stop")})
        return GeodeticRoute(latitude, longitude, settings, waypoints, self.fence, self.rally, self.no_go)

    @classmethod
    def load(cls, path: str | Path) -> "GeodeticRoute":
        """A route from a file. Raises InputError that names the file and what is wrong with it."""
        readers = {
            ".toml": lambda text: parse_toml(text, f"route {path}"),
            ".gpx": _from_gpx,
            ".geojson": _from_geojson,
            ".json": _from_geojson,
            ".plan": read_plan,
            ".waypoints": read_waypoints,
        }
        reader = readers.get(Path(path).suffix.lower())
        if reader is None:
            raise InputError(f"route {path} has an unknown ending, expected one of {', '.join(readers)}")
        try:
            keys = reader(Path(path).read_text(encoding="utf-8"))
        except InputError as error:
            raise error if str(error).startswith("route ") else InputError(f"route {path}: {error}") from None
        except OSError as error:
            raise InputError(f"route {path} cannot be read: {error.strerror}") from None
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError, ElementTree.ParseError) as error:
            raise InputError(f"route {path} is malformed ({error}), expected waypoints in degrees") from None
        table = MissionFile.made_of(keys, f"route {path}")
        twice = next((name for name in _SHORT if name in keys and name in table.guidance.model_fields_set), None)
        if twice is not None:
            raise InputError(f"route {path}: {twice} and guidance.{twice} are both given, expected one of them")
        if len(table.waypoint) < 2 and table.survey is None:
            found = len(table.waypoint)
            raise InputError(f"route {path} has {found} waypoints, expected at least 2, or a table [survey]")
        try:
            lines = [] if table.survey is None else table.survey.points()
            waypoints = [*table.waypoint, *(WaypointTable(**each) for each in lines)]
            return cls.of(waypoints, table.fence, table, table.no_go)
        except InputError as error:
            raise InputError(f"route {path}: {error}") from None

    @classmethod
    def of(
        cls,
        waypoints: Sequence[WaypointTable],
        fence: Sequence[PlaceTable] = (),
        settings: MissionTable | None = None,
        no_go: Sequence[Sequence[PlaceTable]] = (),
    ) -> "GeodeticRoute":
        """A route from tables. Raises InputError for an incomplete position, and for a fence as `Fence` does."""
        table = settings or MissionTable()
        origin = None if table.origin is None else table.origin.globe(None, "origin")
        latitude, longitude = np.array([each.globe(origin, f"waypoint[{k}]") for k, each in enumerate(waypoints)]).T
        corners = [each.globe(origin, f"fence[{k}]") for k, each in enumerate(fence)]
        areas = tuple(
            NoGo([each.globe(origin, f"no_go[{j}][{k}]") for k, each in enumerate(area)], f"no_go[{j}]")
            for j, area in enumerate(no_go)
        )
        rally = None if table.rally is None else table.rally.globe(origin, "rally")
        return cls(latitude, longitude, table, waypoints, Fence(corners) if corners else None, rally, areas)


def _from_gpx(text: str) -> dict[str, Any]:
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("a document type is declared")
    points = [each for each in ElementTree.fromstring(text).iter() if each.tag.rpartition("}")[2] == "rtept"]
    return {"waypoint": [{f"{axis}_deg": float(each.attrib[axis]) for axis in ("lat", "lon")} for each in points]}


def _from_geojson(text: str) -> dict[str, Any]:
    found = json.loads(text)
    shapes = [each.get("geometry", each) for each in found.get("features", [found])]
    lines = [each["coordinates"] for each in shapes if each["type"] == "LineString"]
    rings = [each["coordinates"][0] for each in shapes if each["type"] == "Polygon"]
    if any(len(each["coordinates"]) > 1 for each in shapes if each["type"] == "Polygon"):
        raise ValueError("the fence has holes")
    if not lines:
        raise ValueError("it holds no LineString")
    return {"waypoint": _places(lines[0]), "fence": _places(rings[0]) if rings else []}


def _places(coordinates: Sequence[Sequence[float]]) -> list[dict[str, float]]:
    return [{"lat_deg": each[1], "lon_deg": each[0]} for each in coordinates]
