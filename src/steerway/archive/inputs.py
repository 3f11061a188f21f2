"""Inputs of an archive: which they are, and their reports by day and bucket of vessels on the disk.

The reports of one input are shuffled through files by polars' streaming engine, so that memory does not grow with them;
rows that are left out are counted by reason.
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
"""Numbers of vessels that have a name and no number: above all MMSI and serial numbers, exact in JSON."""
_ROWS_A_BYTE = {".parquet": 1 / 25, ".gz": 1 / 20, ".zip": 1 / 20, ".zst": 1 / 20}
"""Rows that a packed input holds for each byte, to choose the number of buckets; see `rows_in`."""
_TEXT_ROW = 110
"""Bytes of a row of text. Chosen: a short row of AIS; rows that are overestimated only make more buckets."""

_FIRST = 10_000
"""Reports of an input by which it is known in how many digits positions are written there."""
_FEW = 10
_FINE, _COARSE = 1.5e-5, 2e-4
"""° of a last digit that matters: 0.001′ (1.9 m), 4 decimals (11 m), 0.01′ (19 m). Chosen by generated ships: with 5
decimals (1.1 m) SOG and COG under way are as without rounding, and a coarser digit may be chance."""


def found(paths: Iterable[str | Path]) -> list[Path]:
    """The files that paths and patterns name, in order. Raises InputError for one that names none."""
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
    """About how many rows an input holds, by its size."""
    return path.stat().st_size * _ROWS_A_BYTE.get(path.suffix.lower(), 1.0 / _TEXT_ROW)


def identity(path: Path, known: dict[str, Any] | None = None) -> dict[str, Any]:
    """Size, time of change and hash of a file; the hash of one that has not changed since `known` is not taken anew."""
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
    """Write the reports of an input by day and bucket into a directory beside their place.

    Returns the directory, and what the manifest says of the input: the rows kept, those left out by reason, the numbers
    of vessels that have names, and the last digit (°) of positions, 0 where it is too fine to matter.
    Raises InputError for an input that cannot be read, or has no such column.
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
    """The last digit (°) in which an input's positions are written, by its first reports, however they are divided."""
    first = pl.scan_parquet(kept, glob=False).bottom_k(_FIRST, by=["time_s", "mmsi", "lat_deg", "lon_deg"])
    places = first.select("lat_deg", "lon_deg").collect().to_numpy()
    digit = math.degrees(last_digit(np.radians(places.ravel())))
    return digit if _FINE < digit < _COARSE else 0.0


Numbers = TypeVar("Numbers", pl.Expr, pl.Series)


def bucket_of(mmsi: Numbers, buckets: int) -> Numbers:
    """A stable hash of a vessel's number."""
    return (mmsi % 9_999_999_967 * 40_503 // 256) % buckets


def vessel_number(name: str) -> int:
    """The number of a vessel that is named: a whole number is its own, a text has one above all those."""
    if re.fullmatch(r"[1-9][0-9]{0,14}", name):
        return int(name)
    return _FIRST_NAMED + int.from_bytes(hashlib.sha256(name.encode()).digest()[:6])


def _fleet(path: Path, vessel_column: str) -> tuple[pl.LazyFrame, dict[str, int], dict[str, int]]:
    """A table of several vessels, numbered by the values of a column, and their numbers by name."""
    data = plain(path)
    if not table.recognises(data):
        raise InputError(f"{path}: is no table, expected CSV or Parquet with the column {vessel_column!r}")
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
    """A log of any format that `steerway.read` knows: raw AIS, or one vessel, numbered by the name of its file."""
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
    """The positions among fixes, with SCHEMA; those that have none are counted."""
    placed = fixes.has_position
    if lacking := int((~placed).sum()):
        skipped["no position"] = skipped.get("no position", 0) + lacking
    frame = replace(fixes, mmsi=mmsi).to_frame().with_columns(mobile=mobile, hull=0, reason=0)
    whole = pl.concat([pl.DataFrame(schema=SCHEMA), frame], how="diagonal_relaxed")
    return whole.select(SCHEMA.names()).cast(SCHEMA).filter(placed)


def staged_units(directory: Path) -> set[tuple[int, int]]:
    """(day, bucket) of the reports of an input."""
    return {(int(each.parent.name[4:]), int(each.name[7:])) for each in directory.glob("day=*/bucket=*")}
