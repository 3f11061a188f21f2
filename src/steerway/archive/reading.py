"""Read an archive: its rows as a lazy frame or in files, its status, and a digest of its results."""

import hashlib
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from steerway.archive.inputs import bucket_of
from steerway.archive.levels import profile_names
from steerway.archive.running import chains
from steerway.archive.store import DAY, TABLES, Store, date_of, day_of
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


def status(directory: str | Path) -> dict[str, Any]:
    """Settings, inputs and progress, as text and numbers. Raises InputError if there is no archive."""
    store = Store.opened(directory)
    manifest = store.manifest()
    done, todo = sorted(store.done()), sum(map(len, chains(store, manifest)))
    numbers = [store.numbers(*unit) for unit in done]
    days = sorted({day for day, _ in store.staged_units()})
    settings = [f"{manifest['buckets']} bucket{'' if manifest['buckets'] == 1 else 's'}", profile_names(manifest)]
    settings += ["smoothed"] if manifest["smooth"] else []
    settings += [f"{manifest['rate']:g} Hz"] if manifest["rate"] else []
    settings += [f"aided by {', '.join(manifest['aid'])}"] if manifest["aid"] else []
    return {
        "settings": ", ".join(settings),
        "inputs": len(manifest["inputs"]),
        "days": f"{date_of(days[0])} to {date_of(days[-1])}, {len(days)}" if days else "none",
        "units": f"{len(done)} done, {todo} to be done",
        "done": len(done),
        "to_do": todo,
        "rows": sum(each["rows"] for each in numbers),
        "reports": sum(each["reports"] for each in numbers),
        "files": [
            {"input": path} | {name: each[name] for name in ("rows", "digit_deg", "left_out", "vessels")}
            for path, each in manifest["inputs"].items()
        ],
    }


def digest(directory: str | Path, progress: Callable[[float], None] | None = None) -> tuple[str, int]:
    """(SHA-256 of all tables, number of rows in the estimate) of an archive.

    The rows of each track are hashed in order of time, over all days; the digest is the hash of these hashes, sorted by
    track. Raises InputError if there is no archive, or one of its files is damaged or missing.
    """
    store = Store.opened(directory)
    units = sorted(store.done(), key=lambda unit: (unit[1], unit[0]))
    hashes: dict[tuple[str, int, int], hashlib._Hash] = {}
    rows = 0
    for i, unit in enumerate(units):
        for table in TABLES:
            path = store.path(table, *unit)
            try:
                frame = pl.read_parquet(path, glob=False)
            except (pl.exceptions.PolarsError, OSError) as error:
                raise InputError(
                    f"{path}: cannot be read ({str(error).splitlines()[0]}), expected a complete file"
                ) from None
            rows += len(frame) if table == "estimate" else 0
            _update(hashes, table, frame)
        if progress:
            progress((i + 1) / len(units))
    whole = hashlib.sha256()
    for key in sorted(hashes):
        whole.update(repr(key).encode() + hashes[key].digest())
    return whole.hexdigest(), rows


def _update(hashes: dict[tuple[str, int, int], "hashlib._Hash"], table: str, frame: pl.DataFrame) -> None:
    time = "time_s" if table == "estimate" else "start_s"
    frame = frame.sort("mmsi", "track", time, maintain_order=True)
    mmsi, track = frame["mmsi"].to_numpy(), frame["track"].to_numpy()
    if len(frame) == 0:
        return
    packed = np.concatenate([_bytes(frame[name]) for name in frame.columns], axis=1)
    edges = np.flatnonzero((np.diff(mmsi) != 0) | (np.diff(track) != 0)) + 1
    for first, last in zip([0, *edges], [*edges, len(frame)], strict=True):
        key = (table, int(mmsi[first]), int(track[first]))
        hashes.setdefault(key, hashlib.sha256()).update(packed[first:last].tobytes())


def _bytes(series: pl.Series) -> np.ndarray:
    """The values of a column as bytes (n, size) uint8; unknown values are NaN."""
    if series.dtype.is_float():
        values = series.fill_null(float("nan")).to_numpy().copy()
        values[np.isnan(values)] = np.nan
        values += 0.0  # −0 is 0
    elif series.dtype == pl.Enum:
        values = series.to_physical().to_numpy()
    else:
        values = series.to_numpy()
    values = np.ascontiguousarray(values)
    return values.view(np.uint8).reshape(len(values), values.dtype.itemsize)
