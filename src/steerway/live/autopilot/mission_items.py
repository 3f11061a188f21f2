"""Converts mission items of MAVLink (waypoints, speeds, loiter, return), and QGroundControl's files, to a mission.

A `.plan` is JSON with items, fences and rally points. A `.waypoints` file has one line per item; the first is the home
position. Sources: mavlink.io, mission protocol and MAV_CMD; docs.qgroundcontrol.com, plan file format.
"""

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from steerway.core.errors import InputError

WAYPOINT, LOITER, RETURN, SPEED = 16, 17, 20, 178
"""MAV_CMD_NAV_WAYPOINT, _NAV_LOITER_UNLIM, _NAV_RETURN_TO_LAUNCH, _DO_CHANGE_SPEED."""
_GLOBAL_FRAMES = (0, 3, 5, 6, 10, 11)
_HEADER = "QGC WPL 110"
_COLUMNS = 12


class MissionItem(NamedTuple):
    """One item: MAV_CMD, MAV_FRAME, four parameters; latitude and longitude in degrees, altitude."""

    command: int
    frame: int
    parameters: tuple[float, ...]
    latitude: float
    longitude: float
    altitude: float = 0.0


def mission_of(items: Sequence[MissionItem], home: tuple[float, float] | None = None) -> dict[str, Any]:
    """The keys of a mission file for items in order; home (latitude, longitude; degrees) is the goal of RETURN.

    Raises InputError that names the first item that cannot be sailed.
    """
    waypoints: list[dict[str, float]] = []
    speed, keys = math.nan, dict[str, str]()
    for index, item in enumerate(items):
        if keys.get("at_end") == "hold":
            raise InputError(f"item {index} follows one that loiters without end, expected no further item")
        if item.command == SPEED:
            speed = item.parameters[1] if item.parameters[1] > 0.0 else speed
            continue
        place = home if item.command == RETURN else (item.latitude, item.longitude)
        if place is None:
            raise InputError(f"item {index} returns, and there is no home position to return to")
        if item.command not in (WAYPOINT, LOITER, RETURN):
            commands = f"waypoint ({WAYPOINT}), loiter ({LOITER}), return ({RETURN}) or speed ({SPEED})"
            raise InputError(f"item {index} has command {item.command}, expected {commands}")
        if item.command != RETURN and item.frame not in _GLOBAL_FRAMES:
            raise InputError(f"item {index} has frame {item.frame}, expected a global frame: any of {_GLOBAL_FRAMES}")
        if item.command == WAYPOINT and item.parameters[0] > 0.0:
            raise InputError(f"item {index} stays for {item.parameters[0]:g} s, expected 0 s")
        waypoint = dict(zip(("lat_deg", "lon_deg"), place, strict=True))
        if item.command == WAYPOINT and item.parameters[1] > 0.0:
            waypoint["acceptance"] = item.parameters[1]
        if math.isfinite(speed):
            waypoint["speed_mps"] = speed
        waypoints.append(waypoint)
        if item.command == LOITER:
            keys["at_end"] = "hold"
    return {"waypoint": waypoints} | keys


def read_plan(text: str) -> dict[str, Any]:
    """The keys of a mission file for the text of a `.plan`."""
    found = json.loads(text)
    if found.get("fileType") != "Plan":
        raise ValueError("its fileType is not Plan")
    mission = found["mission"]
    home = tuple(mission["plannedHomePosition"][:2]) if mission.get("plannedHomePosition") else None
    keys = mission_of(list(_plan_items(mission["items"])), home)
    fences = found.get("geoFence", {})
    if fences.get("circles"):
        raise InputError("the fence has circles, expected polygons")
    inside = [each["polygon"] for each in fences.get("polygons", []) if each.get("inclusion", True)]
    if len(inside) > 1:
        raise InputError(f"the fence has {len(inside)} polygons that the boat must not leave, expected one")
    if inside:
        keys["fence"] = [_place(each) for each in inside[0]]
    outside = [each["polygon"] for each in fences.get("polygons", []) if not each.get("inclusion", True)]
    if outside:
        keys["no_go"] = [[_place(each) for each in polygon] for polygon in outside]
    rally = found.get("rallyPoints", {}).get("points", [])
    return keys | ({"rally": _place(rally[0])} if rally else {})


def _plan_items(items: list[dict[str, Any]]) -> Iterator[MissionItem]:
    """The simple items, including those of surveys and corridors."""
    for item in items:
        if item.get("type") == "ComplexItem":
            yield from _plan_items(item["TransectStyleComplexItem"]["Items"])
            continue
        *parameters, latitude, longitude, altitude = (0.0 if each is None else float(each) for each in item["params"])
        yield MissionItem(item["command"], item["frame"], tuple(parameters), latitude, longitude, altitude)


def _place(pair: Sequence[float]) -> dict[str, float]:
    return {"lat_deg": float(pair[0]), "lon_deg": float(pair[1])}


def read_waypoints(text: str) -> dict[str, Any]:
    """The keys of a mission file for the text of a `.waypoints` file."""
    lines = [each.split() for each in text.splitlines() if each.strip()]
    if not lines or " ".join(lines[0]) != _HEADER:
        raise ValueError(f"its first line is not {_HEADER}")
    items = []
    for number, line in enumerate(lines[1:], start=2):
        if len(line) != _COLUMNS:
            raise ValueError(f"line {number} has {len(line)} columns and not {_COLUMNS}")
        _, _, frame, command, *numbers = line
        *parameters, latitude, longitude, altitude = map(float, numbers[:-1])
        items.append(MissionItem(int(command), int(frame), tuple(parameters), latitude, longitude, altitude))
    home = (items[0].latitude, items[0].longitude) if items and items[0].latitude else None
    return mission_of(items[1:], home)


def items_of(places: Sequence[tuple[float, float]], speeds: Sequence[float], at_end: str) -> list[MissionItem]:
    """The items, home first, of a route through places (latitude, longitude; rad) at speeds (m/s)."""
    degrees = [tuple(map(math.degrees, each)) for each in places]
    items = [MissionItem(WAYPOINT, 0, (0.0,) * 4, *degrees[0])]
    last = math.nan
    for index, (place, speed) in enumerate(zip(degrees, speeds, strict=True)):
        if speed != last:
            items.append(MissionItem(SPEED, 2, (1.0, speed, -1.0, 0.0), 0.0, 0.0))
            last = speed
        command = LOITER if at_end == "hold" and index == len(degrees) - 1 else WAYPOINT
        items.append(MissionItem(command, 0, (0.0,) * 4, *place))
    return items
