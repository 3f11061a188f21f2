"""Status of an archive (settings, inputs, progress), and a digest of its results, whatever files they are in."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from steerway.archive.levels import profile_names
from steerway.archive.running import chains
from steerway.archive.store import TABLES, Store, date_of
from steerway.core.errors import InputError


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
