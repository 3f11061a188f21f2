"""GeoJSON (RFC 7946), read and written.

Written: a line per track, and a point per row with its other columns as properties. Read: points whose properties have
the names of a table's columns, and lines with a time for each point (`coordTimes`, or `times` in
`coordinateProperties`).
"""

import io
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import polars as pl

from steerway.core.errors import InputError
from steerway.core.records import Record
from steerway.formats import table
from steerway.formats.recording import Recording


def recognises(head: bytes) -> bool:
    """Whether the first bytes begin a feature or a collection of features."""
    return head.lstrip()[:1] == b"{" and b'"Feature' in head and b'"coordinates"' in head


def read(data: bytes) -> Recording:
    """The points of a file, with properties read by `table.read`. InputError for damaged JSON or lacking columns."""
    try:
        whole = json.loads(data)
        found = whole["features"] if whole["type"] == "FeatureCollection" else [whole]
        rows = [row for feature in found for row in _rows(feature)]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"the GeoJSON is malformed: {str(error).splitlines()[0][:80]}") from None
    if not rows:
        return Recording("GeoJSON", {}, {"points": 0})
    file = io.BytesIO()
    pl.DataFrame(rows, infer_schema_length=None, strict=False).write_parquet(file)
    return replace(table.read(file.getvalue()), format="GeoJSON")


def _rows(feature: dict[str, Any]) -> list[dict[str, Any]]:
    """A feature's points with their properties; empty for a line without times."""
    geometry, properties = feature["geometry"] or {}, feature.get("properties") or {}
    plain = {name: value for name, value in properties.items() if isinstance(value, int | float | str)}
    places = geometry.get("coordinates", ())
    if geometry.get("type") == "Point":
        return [plain | {"lon_deg": float(places[0]), "lat_deg": float(places[1])}]
    inner = properties.get("coordinateProperties")
    named = [each for each in (inner, properties) if isinstance(each, dict)]
    times = next((each[name] for each in named for name in ("coordTimes", "times") if each.get(name)), ())
    if geometry.get("type") != "LineString" or len(times) != len(places):
        return []
    return [
        {"time": time, "lon_deg": float(place[0]), "lat_deg": float(place[1])}
        for time, place in zip(times, places, strict=True)
    ]


def text(record: Record) -> str:
    """A FeatureCollection of the rows of `Fixes` or `Motion` that have a position.

    Coordinates are longitude and latitude in degrees. A track that crosses the antimeridian is split there, as the RFC
    requires. Numbers have the fewest digits that read back the same.
    """
    collected = []
    for mmsi, track in record.tracks():
        collected += features(mmsi, track.rows(track.has_position).to_frame().to_dicts())
    return collection(collected)


def features(mmsi: int | None, rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The line and the points of a track, from its rows (dicts with lon_deg, lat_deg and time_s)."""
    return [_line(mmsi, rows), *(_point(row) for row in rows)] if rows else []


def collection(collected: Sequence[dict[str, Any]]) -> str:
    """The text of a FeatureCollection."""
    whole = {"type": "FeatureCollection", "features": collected}
    return json.dumps(whole, allow_nan=False, separators=(",", ":")) + "\n"


def _line(mmsi: int | None, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The track as a LineString, or a MultiLineString where it crosses the antimeridian."""
    parts: list[list[list[float]]] = [[]]
    for row in rows:
        place = [row["lon_deg"], row["lat_deg"]]
        if parts[-1] and abs(place[0] - parts[-1][-1][0]) > 180.0:
            before = parts[-1][-1]
            edge = math.copysign(180.0, before[0])
            beyond = place[0] + 2.0 * edge
            share = (edge - before[0]) / (beyond - before[0]) if beyond != before[0] else 0.0
            latitude = before[1] + share * (place[1] - before[1])
            parts[-1].append([edge, latitude])
            parts.append([[-edge, latitude]])
        parts[-1].append(place)
    lines = [part if len(part) > 1 else part * 2 for part in parts]
    kind, coordinates = ("LineString", lines[0]) if len(lines) == 1 else ("MultiLineString", lines)
    properties = {"from_s": rows[0]["time_s"], "until_s": rows[-1]["time_s"]}
    if mmsi is not None:
        properties["mmsi"] = mmsi
    return {"type": "Feature", "geometry": {"type": kind, "coordinates": coordinates}, "properties": properties}


def _point(row: dict[str, Any]) -> dict[str, Any]:
    place = [row["lon_deg"], row["lat_deg"]]
    properties = {name: value for name, value in row.items() if name not in ("lat_deg", "lon_deg")}
    return {"type": "Feature", "geometry": {"type": "Point", "coordinates": place}, "properties": properties}
