"""Tracks to compare: tables that `estimate` and `simulate` wrote, and logs with the receiver's own values."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import polars as pl

from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.formats.plain_table import numbers, read_plain

_COLUMNS = {
    "latitude": "lat_deg",
    "longitude": "lon_deg",
    "sog": "sog_mps",
    "cog": "cog_deg",
    "course_rate": "course_rate_dps",
    "sog_std": "sog_std_mps",
    "cog_std": "cog_std_deg",
    "course_rate_std": "course_rate_std_dps",
    "position_std": "position_std_m",
}
_NEEDED = ("lat_deg", "lon_deg", "sog_mps", "cog_deg")


@dataclass(frozen=True, eq=False)
class NamedTrack:
    """Position and motion over time of one vessel by one source; (n,) each, SI and radians, NaN for unknown."""

    name: str
    time: np.ndarray
    latitude: np.ndarray
    longitude: np.ndarray
    sog: np.ndarray
    cog: np.ndarray
    course_rate: np.ndarray
    sog_std: np.ndarray
    cog_std: np.ndarray
    course_rate_std: np.ndarray
    position_std: np.ndarray

    @classmethod
    def of(cls, name: str, table: Fixes | Motion) -> "NamedTrack":
        """The track of an estimate, or of a receiver's own values, whose deviations are unknown."""
        columns = {field.name: getattr(table, field.name, None) for field in fields(cls)[1:]}
        if isinstance(table, Fixes):
            columns |= {each: None for each in columns if each.endswith("_std")}
        unknown = np.full(len(table), np.nan)
        return cls(name, **{each: unknown if values is None else values for each, values in columns.items()})


def read_tracks(path: str | Path) -> list[NamedTrack]:
    """The tracks in a file: of a table one, of a run of `simulate` true and estimated, of a log its best source.

    Raises InputError for a file that cannot be read, or with reports of several vessels.
    """
    frame = _table(path)
    name = Path(path).name
    if frame is not None:
        prefixes = [each for each in ("true_", "estimated_", "") if all(each + c in frame.columns for c in _NEEDED)]
        if prefixes and "mmsi" not in frame.columns:
            return [_of_frame(f"{name} {prefix.removesuffix('_')}".strip(), frame, prefix) for prefix in prefixes[:2]]
    from steerway.formats.reading import read

    fixes = read(path)
    if fixes.mmsi is not None:
        raise InputError(f"{path} has reports of several vessels, expected the log or the estimate of one")
    placed = fixes.rows(fixes.has_position)
    return [NamedTrack.of(name, placed)]


def _table(path: str | Path) -> pl.DataFrame | None:
    """The file as a table whose first column is time_s or mmsi, None for any other file."""
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


def _of_frame(name: str, frame: pl.DataFrame, prefix: str) -> NamedTrack:
    def column(outward: str) -> Floats:
        if outward not in frame.columns:
            return np.full(len(frame), np.nan)
        return numbers(frame, outward)

    values = {field: column(prefix + outward) for field, outward in _COLUMNS.items()}
    values = {
        field: np.radians(each) if _COLUMNS[field].endswith(("_deg", "_dps")) else each
        for field, each in values.items()
    }
    return NamedTrack(name, column("time_s"), **values)
