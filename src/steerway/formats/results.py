"""Tracks to compare: from tables of `estimate` and `simulate`, and from logs, with the receiver's SOG and COG."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from steerway.core.errors import InputError
from steerway.core.records import MOTION_COLUMNS, Fixes, Motion
from steerway.formats.cells import numbers, read_plain

_NEEDED = ("lat_deg", "lon_deg", "sog_mps", "cog_deg")


@dataclass(frozen=True, eq=False)
class NamedTrack(Motion):
    """Position and motion of one vessel over time, from one source; columns that the source lacks are NaN, status 0."""

    name: str = ""

    @classmethod
    def of(cls, name: str, table: Fixes | Motion) -> "NamedTrack":
        """The track of an estimate, or of fixes with the receiver's own values; these have no standard deviations."""
        known = table.columns()
        if isinstance(table, Fixes):
            known = {each: values for each, values in known.items() if not each.endswith("_std")}
        return cls._of(name, known)

    @classmethod
    def _of(cls, name: str, known: Mapping[str, np.ndarray]) -> "NamedTrack":
        n = len(known["time"])
        columns = {field: known.get(field, np.full(n, np.nan)) for field, _ in MOTION_COLUMNS.values()}
        return cls(**columns, status=np.zeros(n, np.uint8), name=name)

    @classmethod
    def of_frame(cls, name: str, frame: pl.DataFrame, prefix: str) -> "NamedTrack":
        """The track in the columns of a table whose names begin with a prefix, such as `true_`."""
        known = {}
        for outward, (field, _) in MOTION_COLUMNS.items():
            column = outward if field == "time" else prefix + outward
            if column in frame.columns:
                values = numbers(frame, column)
                known[field] = np.radians(values) if outward.endswith(("_deg", "_dps")) else values
        return cls._of(name, known)


def read_tracks(path: str | Path) -> list[NamedTrack]:
    """The tracks in a file: a table, the true and the estimated track of `simulate`, or the best source of a log.

    Raises InputError for a file that cannot be read, or that contains reports of several vessels.
    """
    frame = _table(path)
    name = Path(path).name
    if frame is not None:
        prefixes = [each for each in ("true_", "estimated_", "") if all(each + c in frame.columns for c in _NEEDED)]
        if prefixes and "mmsi" not in frame.columns:
            return [
                NamedTrack.of_frame(f"{name} {prefix.removesuffix('_')}".strip(), frame, prefix)
                for prefix in prefixes[:2]
            ]
    from steerway.formats.reading import read

    fixes = read(path)
    if fixes.mmsi is not None:
        raise InputError(f"{path} has reports of several vessels, expected the log or the estimate of one")
    placed = fixes.rows(fixes.has_position)
    return [NamedTrack.of(name, placed)]


def _table(path: str | Path) -> pl.DataFrame | None:
    """The file as a table, if it is Parquet or CSV of this project's columns with time_s; None for any other file."""
    try:
        with Path(path).open("rb") as file:
            head = file.read(16)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({(error.strerror or 'not readable').lower()})") from None
    if not head.startswith((b"PAR1", b"time_s,", b"mmsi,time_s,")):
        return None
    try:
        frame = read_plain(path)
    except InputError:
        return None
    return frame if "time_s" in frame.columns else None
