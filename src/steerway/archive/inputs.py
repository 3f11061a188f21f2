"""Inputs of an archive: find the files, and sort their reports on disk by day and bucket of vessels.

Polars' streaming engine writes the reports of an input to files, so memory does not grow with the input. Rows that
are left out are counted by reason.
"""

import glob
import hashlib
import math
import re
import shutil
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import polars as pl

from steerway.archive.store import DAY, Store
from steerway.core.errors import InputError
from steerway.core.records import Fixes
from steerway.core.statistics import last_digit
from steerway.formats import ais, table
from steerway.formats.ais_tables import MOBILES, REASONS, SCHEMA, reports
from steerway.formats.reading import plain, read, survey

_LEFT_OUT = -1
_FIRST_NAMED = 1 << 52
"""First ID of vessels that have a name but no number: above all MMSI and serial numbers, and exact in JSON."""
_ROWS_A_BYTE = {".parquet": 1 / 25, ".gz": 1 / 20, ".zip": 1 / 20, ".zst": 1 / 20}
"""Estimated rows per byte of a compressed input, to choose the number of buckets; see `rows_in`."""
_TEXT_ROW = 110
"""Bytes per row of text: a short AIS row. An overestimate of the rows only makes more buckets."""

_FIRST = 10_000
"""Number of first reports from which the resolution of an input's positions is determined."""
_FEW = 10
_FINE, _COARSE = 1.5e-5, 2e-4
"""Finest and coarsest resolution that matter, °: 0.001′ (1.9 m), 4 decimals (11 m), 0.01′ (19 m). On generated ships, 5
decimals (1.1 m) gave the same SOG and COG as unrounded positions. A resolution that seems coarser can be chance."""


def found(paths: Iterable[str | Path]) -> list[Path]:
    """The files that paths, folders and patterns name, in order. Raises InputError for a path that matches no file."""
    files: dict[Path, None] = {}
    for path in paths:
        matches = sorted(glob.glob(str(path), recursive=True)) if glob.has_magic(str(path)) else [str(path)]
        named = [Path(each) for each in matches]
        named = [inner for each in named for inner in (sorted(each.rglob("*")) if each.is_dir() else [each])]
        named = [each for each in named if each.is_file()]
        if not named:
            raise InputError(f"{path}: no such file, expected files, folders or patterns of them")
        files |= dict.fromkeys(named)
    return list(files)


def rows_in(path: Path) -> float:
    """Approximate number of rows in an input, from its size."""
    return path.stat().st_size * _ROWS_A_BYTE.get(path.suffix.lower(), 1.0 / _TEXT_ROW)


def identity(path: Path, known: dict[str, Any] | None = None) -> dict[str, Any]:
    """Size, modification time and SHA-256 of a file; the hash is reused if size and time are those of `known`."""
    try:
        stat = path.stat()
        if known and known["size"] == stat.st_size and known["changed_ns"] == stat.st_mtime_ns:
            digest = known["sha256"]
        else:
            with open(path, "rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    return {"size": stat.st_size, "changed_ns": stat.st_mtime_ns, "sha256": digest}


def stage(
    path: Path, store: Store, key: str, buckets: int, vessel_column: str | None = None
) -> tuple[Path, dict[str, Any]]:
    """Write the reports of an input, by day and bucket, into a temporary directory beside their final one.

    Returns the directory and the input's entry in the manifest: number of rows, rows left out by reason, IDs of named
    vessels, and resolution of the positions (°, 0 where it is too fine to matter). Raises InputError for an input that
    cannot be read or lacks the column.
    """
    part = store.root / "staged" / f".{key}.part"
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    skipped: dict[str, int] = {}
    names: dict[str, int] = {}
    with nullcontext() if vessel_column else reports(path, store.root / "staged") as frame:
        if vessel_column:
            frame, skipped, names = _fleet(path, vessel_column)
        elif frame is None:
            frame, skipped, names = _log(path)
        bucket = pl.when(pl.col("reason") > 0).then(_LEFT_OUT).otherwise(bucket_of(pl.col("mmsi"), buckets))
        day = pl.when(pl.col("reason") > 0).then(0).otherwise((pl.col("time_s") // DAY).cast(pl.Int32))
        keyed = frame.with_columns(day=day.fill_null(0), bucket=bucket.cast(pl.Int16))
        into = pl.PartitionBy(part, key=["day", "bucket"], include_key=False)
        keyed.sink_parquet(into, mkdir=True, compression="lz4", statistics=False)
    dropped = part / "day=0" / f"bucket={_LEFT_OUT}"
    if dropped.is_dir():
        counts = pl.scan_parquet(dropped / "*.parquet").group_by("reason").len().collect()
        for reason, count in counts.iter_rows():
            skipped[REASONS[reason]] = skipped.get(REASONS[reason], 0) + count
        shutil.rmtree(dropped)
    kept = list(part.glob("day=*/bucket=*/*.parquet"))
    rows = pl.scan_parquet(kept, glob=False).select(pl.len()).collect().item() if kept else 0
    digit = _digit_of(kept) if rows >= _FEW else 0.0
    return part, {"rows": rows, "left_out": skipped, "vessels": names, "digit_deg": digit}


def _digit_of(kept: list[Path]) -> float:
    """Resolution (°) of an input's positions, from its first reports; the number of buckets does not change it."""
    first = pl.scan_parquet(kept, glob=False).bottom_k(_FIRST, by=["time_s", "mmsi", "lat_deg", "lon_deg"])
    places = first.select("lat_deg", "lon_deg").collect().to_numpy()
    digit = math.degrees(last_digit(np.radians(places.ravel())))
    return digit if _FINE < digit < _COARSE else 0.0


Numbers = TypeVar("Numbers", pl.Expr, pl.Series)


def bucket_of(mmsi: Numbers, buckets: int) -> Numbers:
    """Bucket of a vessel, by a stable hash of its MMSI or ID."""
    return (mmsi % 9_999_999_967 * 40_503 // 256) % buckets


def vessel_number(name: str) -> int:
    """ID of a named vessel: the name itself if it is a whole number, else a hash above all those numbers."""
    if re.fullmatch(r"[1-9][0-9]{0,14}", name):
        return int(name)
    return _FIRST_NAMED + int.from_bytes(hashlib.sha256(name.encode()).digest()[:6])


def _fleet(path: Path, vessel_column: str) -> tuple[pl.LazyFrame, dict[str, int], dict[str, int]]:
    """(reports, left out by reason, IDs by name) of a table with the vessel in a column."""
    data = plain(path)
    if not table.recognises(data):
        raise InputError(f"{path}: not a table, expected CSV or Parquet with the column {vessel_column!r}")
    try:
        recordings, skipped = table.read_vessels(data, vessel_column)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    names = {name: vessel_number(name) for name in recordings}
    frames = [pl.DataFrame(schema=SCHEMA)]
    for name, recording in recordings.items():
        for fixes in recording.sources.values():
            frames.append(_reports(fixes, np.full(len(fixes), names[name]), np.zeros(len(fixes), np.int64), skipped))
    return pl.concat(frames).lazy(), skipped, names


def _log(path: Path) -> tuple[pl.LazyFrame, dict[str, int], dict[str, int]]:
    """(reports, left out by reason, IDs by name) of a log: raw AIS, or one vessel with an ID from the file name."""
    names: dict[str, int] = {}
    recordings = [log.recording for log in survey(path)]
    recording = next((each for each in recordings if "AIS" in each.sources), None)
    if recording is not None and (mmsi := recording.sources["AIS"].mmsi) is not None:
        fixes, skipped = recording.sources["AIS"], dict(recording.skipped)
        in_class_b = np.isin(mmsi, list(ais.class_b(plain(path))))
        mobile = np.where(in_class_b, MOBILES.index("class B"), MOBILES.index("class A"))
    else:
        fixes, skipped = read(path), {}
        names[path.name] = vessel_number(path.name)
        mmsi = np.full(len(fixes), names[path.name])
        mobile = np.zeros(len(fixes), np.int64)
    return _reports(fixes, mmsi, mobile, skipped).lazy(), skipped, names


def _reports(fixes: Fixes, mmsi: np.ndarray, mobile: np.ndarray, skipped: dict[str, int]) -> pl.DataFrame:
    """The fixes that have a position, with SCHEMA; fixes without one are added to `skipped`."""
    placed = fixes.has_position
    if lacking := int((~placed).sum()):
        skipped["no position"] = skipped.get("no position", 0) + lacking
    frame = replace(fixes, mmsi=mmsi).to_frame().with_columns(mobile=mobile, hull=0, reason=0)
    whole = pl.concat([pl.DataFrame(schema=SCHEMA), frame], how="diagonal_relaxed")
    return whole.select(SCHEMA.names()).cast(SCHEMA).filter(placed)
