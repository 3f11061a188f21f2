"""Read logs of manoeuvres: rudder and the boat's response for `yaw`, speed and shaft speed for `surge`.

The rudder's column is found by its name (rudder_deg, rudder_command_deg, command_rudder_deg, yaw_moment_nm, yaw …). The
response is a heading, a course or positions. A log for `surge` has time_s, speed_mps and shaft_rps; in place of
shaft_rps, another column may hold a command in any unit, if thrust is quadratic in it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
import polars as pl

from steerway.core.errors import InputError
from steerway.core.records import Fixes
from steerway.core.timestamps import unix_times
from steerway.formats import table
from steerway.formats.cells import numbers, read_plain
from steerway.formats.columns import DEGREE, Column, plain_name, understood
from steerway.formats.units import in_seconds

_RUDDERS = ("rudder", "rudder_angle", "rudder_command", "command_rudder", "yaw_moment", "moment", "yaw")
_UNITS = {"_deg": DEGREE, "_rad": 1.0, "_nm": 1.0}
_ANGLES = ("heading", "cog")


@dataclass(frozen=True, eq=False)
class Steering:
    """A manoeuvre: time (n,) s, rudder (n,) rad or N·m, angle (n,) rad or None, fixes (may be empty); columns read."""

    time: np.ndarray
    rudder: np.ndarray
    angle: np.ndarray | None
    fixes: Fixes
    notes: tuple[str, ...]


def read_steering(path: str | PathLike[str], rudder: str | None = None, angle: str | None = None) -> Steering:
    """Read the manoeuvre in a CSV or Parquet table.

    Args:
        path: the file.
        rudder: the column of the rudder; None: found by its name. If its name has no unit, a rudder is in degrees
            and a moment in N·m; a column `yaw` is not converted.
        angle: the column of heading or course; None: the heading, else the course, if there is one.

    Raises InputError if the file cannot be read or a column that is needed is missing.
    """
    frame = read_plain(path, "for time, rudder, and heading or positions")
    columns = understood(frame.columns)
    name = _chosen(path, frame, rudder, "rudder") if rudder else _rudder(path, frame)
    if "time" not in columns:
        raise InputError(f"{path} has no column for time, found {', '.join(frame.columns)}, expected time_s")
    time = _times(frame, columns["time"])
    commanded = _numbers(frame, name) * _factor(name)
    notes = [f"rudder: {name}"]
    turned = _chosen(path, frame, angle, "angle") if angle else _first(columns)
    heading = None
    if turned is not None:
        heading = _numbers(frame, turned) * (1.0 if plain_name(turned).endswith("_rad") else DEGREE)
        notes.append(f"angle: {turned}")
    fixes = None
    if {"latitude", "longitude"} <= columns.keys():
        fixes = next(iter(table.read(Path(path).read_bytes()).sources.values()), None)
    if heading is None and fixes is None:
        raise InputError(
            f"{path} has neither heading, course nor positions, found {', '.join(frame.columns)}, "
            "expected heading_deg, cog_deg, or lat_deg and lon_deg"
        )
    known = np.isfinite(time) & np.isfinite(commanded)
    heading = None if heading is None else heading[known]
    placed = Fixes(*[np.empty(0)] * 3) if fixes is None else fixes
    return Steering(time[known], commanded[known], heading, placed, tuple(notes))


def _rudder(path: object, frame: pl.DataFrame) -> str:
    ranks: dict[int, str] = {}
    for name in frame.columns:
        stem = _stem(name)
        if stem in _RUDDERS:
            ranks[_RUDDERS.index(stem)] = name
    if not ranks:
        raise InputError(
            f"{path} has no column for the rudder, found {', '.join(frame.columns)}, expected rudder_deg, "
            "yaw_moment_nm or a column given by name"
        )
    return ranks[min(ranks)]


def _stem(name: str) -> str:
    plain = plain_name(name)
    for unit in _UNITS:
        plain = plain.removesuffix(unit)
    return plain


def _factor(name: str) -> float:
    plain = plain_name(name)
    for unit, factor in _UNITS.items():
        if plain.endswith(unit):
            return factor
    return DEGREE if "rudder" in plain else 1.0


def _first(columns: Mapping[str, Column]) -> str | None:
    return next((columns[meaning].name for meaning in _ANGLES if meaning in columns), None)


def _chosen(path: object, frame: pl.DataFrame, name: str, what: str) -> str:
    if name not in frame.columns:
        raise InputError(f"{path} has no column {name!r} for the {what}, found {', '.join(frame.columns)}")
    return name


def _times(frame: pl.DataFrame, column: Column) -> np.ndarray:
    series = frame[column.name]
    if series.dtype == pl.String:
        return unix_times(series)
    return in_seconds(_numbers(frame, column.name), column.factor)


def _numbers(frame: pl.DataFrame, name: str) -> np.ndarray:
    if (series := frame[name]).dtype == pl.String:
        raise InputError(f"column {name!r} holds text ({series.drop_nulls().head(1).to_list()}), expected numbers")
    return numbers(frame, name)


COLUMNS = ("time_s", "speed_mps", "shaft_rps")


def read_surge_log(path: str | Path, shaft: str | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) time s, speed m/s, shaft rev/s (or the column `shaft`, unconverted); NaN in place of cells without a number.

    Raises InputError for a file that is not a table and for missing columns.
    """
    names = (*COLUMNS[:2], shaft or COLUMNS[2])
    frame = read_plain(path, ", ".join(names))
    missing = [name for name in names if name not in frame.columns]
    if missing:
        raise InputError(f"{path} has no column {missing[0]}, expected {', '.join(names)}")
    time, speed, turns = (numbers(frame, name) for name in names)
    return time, speed, turns
