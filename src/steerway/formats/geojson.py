"""GeoJSON (RFC 7946) out: a line for each track and a point for each row, with its columns as properties."""

import json
import math


def text(record) -> str:
    """A FeatureCollection of the rows of `Fixes` or `Motion` that have a place.

    Coordinates are longitude and latitude in degrees; a track that crosses the antimeridian is a line in parts, as the
    RFC asks. Numbers stand in their shortest form that reads back the same.
    """
    collected = []
    for mmsi, track in record.tracks():
        collected += features(mmsi, track.rows(track.has_position).to_frame().to_dicts())
    return collection(collected)


def features(mmsi, rows) -> list[dict]:
    """Of a track's rows (dicts with lon_deg, lat_deg and time_s): its line, and the points."""
    return [_line(mmsi, rows), *(_point(row) for row in rows)] if rows else []


def collection(collected) -> str:
    """The text of a FeatureCollection."""
    whole = {"type": "FeatureCollection", "features": collected}
    return json.dumps(whole, allow_nan=False, separators=(",", ":")) + "\n"


def _line(mmsi, rows):
    """The track as a LineString, or a MultiLineString where it crosses the antimeridian."""
    parts = [[]]
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


def _point(row):
    place = [row["lon_deg"], row["lat_deg"]]
    properties = {name: value for name, value in row.items() if name not in ("lat_deg", "lon_deg")}
    return {"type": "Feature", "geometry": {"type": "Point", "coordinates": place}, "properties": properties}
