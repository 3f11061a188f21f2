"""Deltas of Signal K, as its server logs them: one JSON object per line, with or without a prefix of time and letter.

Paths and units: Signal K specification 1.7. Live links use `values_of` too.
"""

import json
import math
import re
from collections import Counter, defaultdict
from collections.abc import Mapping
from typing import Any

from steerway.core.records import Fixes
from steerway.core.timestamps import unix_times
from steerway.formats.dilution import deviation
from steerway.formats.places import on_earth
from steerway.formats.recording import Recording, fixes_at

PATHS = {
    "navigation.speedOverGround": "sog",
    "navigation.courseOverGroundTrue": "cog",
    "navigation.headingTrue": "heading",
    "navigation.speedThroughWater": "water_speed",
    "navigation.rateOfTurn": "yaw_rate",
}
DILUTION = "navigation.gnss.horizontalDilution"
_LINE = re.compile(rb'^(?:\d+;[^;\r\n]*;)?(\{.*"updates"\s*:.*\})\s*$', re.M)
_ANGLES = ("navigation.courseOverGroundTrue", "navigation.headingTrue")


def source_of(update: Mapping[str, Any]) -> str:
    """Name of the source of an update in a delta."""
    return str(update.get("$source") or update.get("source", {}).get("label", "signalk"))


def values_of(update: Mapping[str, Any]) -> dict[str, float]:
    """SI values of an update in a delta, by field of `Fixes`; null values are left out."""
    values: dict[str, float] = {}
    for pair in update.get("values", ()):
        path, value = pair["path"], pair["value"]
        if value is None:
            continue
        if path == "navigation.position":
            place = math.radians(value["latitude"]), math.radians(math.remainder(value["longitude"], 360.0))
            values |= dict(zip(("latitude", "longitude"), place, strict=True))
        elif path == DILUTION:
            values["position_std"] = deviation(float(value))
        elif path in _ANGLES:
            values[PATHS[path]] = math.remainder(value, 2.0 * math.pi)
        elif path in PATHS:
            values[PATHS[path]] = float(value)
    return values


def recognises(head: bytes) -> bool:
    """Whether the first bytes of a log contain a delta."""
    return _LINE.search(head) is not None


def read(data: bytes) -> Recording:
    """The sources of the own vessel by name, with a row per time."""
    rows: dict[str, dict[str, dict[str, float]]] = defaultdict(lambda: defaultdict(dict))
    counts, skipped = Counter[str](), Counter[str]()
    for text in _LINE.findall(data):
        try:
            delta = json.loads(text)
            if not str(delta.get("context", "vessels.self")).startswith("vessels.self"):
                skipped["delta of another vessel"] += 1
                continue
            for update in delta["updates"]:
                rows[source_of(update)][str(update["timestamp"])] |= values_of(update)
                counts["delta"] += 1
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            skipped["line not understood"] += 1
    return Recording.of("Signal K", [_fixes(name, own) for name, own in rows.items()], counts, skipped)


def _fixes(name: str, rows: Mapping[str, Mapping[str, float]]) -> Fixes:
    of_time: dict[float, dict[str, float]] = defaultdict(dict)
    for time, row in zip(unix_times(list(rows)).tolist(), rows.values(), strict=True):
        place = on_earth(row.get("latitude", math.nan), row.get("longitude", math.nan))
        of_time[time] |= row
        of_time[time] |= dict(zip(("latitude", "longitude"), place, strict=True))
    return fixes_at(name, of_time)
