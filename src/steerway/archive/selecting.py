"""Read rows of an archive: `scan` returns a lazy frame, `export` writes files."""

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl

from steerway.archive.inputs import bucket_of
from steerway.archive.store import DAY, TABLES, Store, day_of
from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent
from steerway.formats import geojson

ENDINGS = (".parquet", ".geojson", ".csv")
_GEO = {
    "version": "1.1.0",
    "primary_column": "geometry",
    "columns": {"geometry": {"encoding": "WKB", "geometry_types": ["Point"]}},
}


def scan(directory: str | Path, table: str = "estimate") -> pl.LazyFrame:
    """The rows of an archive's table "estimate", "events" or "trips" (including trips unfinished at its end).

    Only finished units are included; within a unit, rows are sorted by vessel, track and time. Raises InputError for
    another table, if there is no archive, or if no unit is done.
    """
    store = Store.opened(directory)
    if table not in TABLES:
        raise InputError(f"table is {table!r}, expected 'estimate', 'events' or 'trips'")
    files = store.files(table)
    if table == "trips" and (unfinished := store.root / "trips" / "unfinished.parquet").is_file():
        files.append(unfinished)
    if not files:
        raise InputError(f"{directory}: no unit is done yet, expected `steerway archive run` to have ended")
    return pl.scan_parquet(files, glob=False)


def export(
    directory: str | Path,
    path: str | Path,
    mmsi: Sequence[int] = (),
    box: tuple[float, float, float, float] | None = None,
    start: float | None = None,
    stop: float | None = None,
) -> int:
    """Write rows of the estimate to a file (.parquet: GeoParquet, .geojson, .csv); returns the number of rows.

    Args:
        mmsi: of the vessels; empty: all. box: west, south, east, north (degrees), west > east across the antimeridian.
            start, stop: Unix s, start ≤ time < stop.

    Raises InputError for another ending, a box out of range, a path that cannot be written, no archive or no such rows.
    """
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise InputError(f"{str(path)!r} has an unknown ending, expected one of {', '.join(ENDINGS)}")
    rows = _chosen(directory, mmsi, box, start, stop).collect(engine="streaming")
    rows = rows.sort("mmsi", "track", "time_s", maintain_order=True)
    with complete_or_absent(path) as file:
        if ending == ".csv":
            rows.write_csv(file)
        elif ending == ".geojson":
            collected = []
            for (vessel, _), track in rows.group_by("mmsi", "track", maintain_order=True):
                placed = track.filter(pl.col("lat_deg").is_not_null()).cast({"status": pl.String})
                collected += geojson.features(vessel, placed.to_dicts())
            file.write(geojson.collection(collected).encode())
        else:
            placed = rows.filter(pl.col("lat_deg").is_not_null())
            placed = placed.with_columns(geometry=_points(placed))
            placed.write_parquet(file, metadata={"geo": json.dumps(_GEO)})
    return len(rows)


def _chosen(
    directory: str | Path,
    mmsi: Sequence[int],
    box: tuple[float, float, float, float] | None,
    start: float | None,
    stop: float | None,
) -> pl.LazyFrame:
    store = Store.opened(directory)
    buckets = None
    if mmsi:
        buckets = set(bucket_of(pl.Series(mmsi, dtype=pl.Int64), store.manifest()["buckets"]).to_list())
    first = -1 if start is None else (start - 3600.0) // DAY
    last = math.inf if stop is None else stop // DAY + 1
    files = [each for each in store.files("estimate", buckets) if first <= day_of(each.parent.name[4:]) <= last]
    if not files:
        raise InputError(f"{directory}: no finished unit contains such rows, expected a vessel and days of the archive")
    frame = pl.scan_parquet(files, glob=False)
    if mmsi:
        frame = frame.filter(pl.col("mmsi").is_in(list(mmsi)))
    if box is not None:
        west, south, east, north = box
        if not (-90.0 <= south < north <= 90.0 and -180.0 <= west <= 180.0 and -180.0 <= east <= 180.0):
            raise InputError(f"box is {box}, expected west, south, east, north in degrees")
        frame = frame.filter(pl.col("lat_deg").is_between(south, north))
        inside = [pl.col("lon_deg") >= west, pl.col("lon_deg") <= east]
        frame = frame.filter(inside[0] & inside[1] if west <= east else inside[0] | inside[1])
    if start is not None:
        frame = frame.filter(pl.col("time_s") >= start)
    return frame if stop is None else frame.filter(pl.col("time_s") < stop)


def _points(frame: pl.DataFrame) -> pl.Series:
    """The positions as points in well-known binary: byte order, type, longitude, latitude."""
    packed = np.zeros(len(frame), dtype=[("order", "u1"), ("type", "<u4"), ("x", "<f8"), ("y", "<f8")])
    packed["order"], packed["type"] = 1, 1
    packed["x"], packed["y"] = frame["lon_deg"].to_numpy(), frame["lat_deg"].to_numpy()
    data, size = packed.tobytes(), packed.dtype.itemsize
    return pl.Series([data[i : i + size] for i in range(0, len(data), size)], dtype=pl.Binary)
