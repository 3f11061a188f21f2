"""The two tables that all packages exchange: Fixes (measurements of receivers) and Motion (estimates).

Both are frozen and hold one-dimensional NumPy arrays of equal length, SI and radians, NaN for unknown. Degrees occur
only in the frames of `to_frame`, whose column names state their units.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.core.on_demand import from_above

if TYPE_CHECKING:
    import polars as pl

OK, PREDICTED, REJECTED, NO_COURSE, STARTING, LOST = range(6)
STATUSES = ("ok", "predicted", "rejected", "no_course", "starting", "lost")
"""Status of a row of Motion. "lost" occurs live only: no measurement for so long that there is no estimate."""

INSTRUMENT_COLUMNS = ("heading", "water_speed", "yaw_rate", "bottom_speed", "acceleration", "shaft")
REPORTED = ("position_std", "sog", "cog", *INSTRUMENT_COLUMNS)
"""Columns that may be reported beside time and position. `INSTRUMENT_COLUMNS` never come from a receiver."""
AID_COLUMNS = ("sog", "cog", "heading", "water_speed", "yaw_rate")
"""Columns that the filter of the course can use, in the order of its kernels' aiding table."""

_ROUNDING = 1e-9
_OF_EVERY_TABLE = ("time", "latitude", "longitude", "mmsi", "status")
_SHOWN_ROWS = 5

Rows = slice | NDArray[np.bool_] | NDArray[np.integer]
"""A selection of rows of a table: a slice, a mask or indices."""


def rows_of(values: np.ndarray, chosen: Rows) -> np.ndarray:
    """The rows of a slice, mask or index array. Raises InputError for rows outside the table."""
    try:
        return values[chosen]
    except IndexError as error:
        raise InputError(f"rows {chosen!r:.60} are not all within a table of {len(values)} rows ({error})") from None


@dataclass(frozen=True, eq=False, repr=False)
class Record(ABC):
    """Equal-length columns, selected and sorted by row."""

    time: np.ndarray  # Unix UTC
    latitude: np.ndarray  # rad
    longitude: np.ndarray  # rad, [−π, π)

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        known = [name for name in self.columns() if name not in _OF_EVERY_TABLE and self._has(name)]
        return f"{type(self).__name__}: {self._extent()}" + (f"; {', '.join(known)}" if known else "")

    def _repr_html_(self) -> str:
        """The extent and the first rows, for notebooks, with dates for Unix times."""
        import polars as pl

        first = self.rows(slice(_SHOWN_ROWS)).to_frame()
        moments = pl.from_epoch((first["time_s"] * 1e3).round().cast(pl.Int64), "ms").alias("time (UTC)")
        first = first.insert_column(first.columns.index("time_s"), moments).drop("time_s")
        return f"<p>{type(self).__name__}: {self._extent()}</p>{first._repr_html_()}"

    def to_pandas(self) -> Any:
        """A pandas DataFrame of the columns of `to_frame`, with dates (UTC) as its index; pyarrow is not needed."""
        import pandas as pd

        frame = self.to_frame()
        moments = pd.to_datetime(self.time, unit="s", utc=True).rename("time")
        return pd.DataFrame({name: frame[name].to_numpy() for name in frame.columns}, index=moments)

    @abstractmethod
    def to_frame(self) -> "pl.DataFrame":
        """A polars DataFrame of the columns, named with their units."""

    def _has(self, name: str) -> bool:
        column = getattr(self, name)
        return column.dtype.kind != "f" or bool(np.isfinite(column).any())

    def _extent(self) -> str:
        """Number of rows, vessels, time span and rate."""
        from steerway.core.timestamps import iso

        if len(self) == 0:
            return "no rows"
        vessels = self.columns().get("mmsi")
        of = "" if vessels is None else f" of {len(np.unique(vessels))} vessels"
        time = self.time[np.isfinite(self.time)]
        if len(time) == 0:
            return f"{len(self)} rows{of} without a time"
        steps = np.diff(np.unique(time)) if vessels is None else np.empty(0)
        rate = f", {1.0 / np.median(steps):.3g} Hz" if len(steps) else ""
        ends = [iso(round(float(end), 3)) for end in (time.min(), time.max())]
        return f"{len(self)} rows{of}, {ends[0]} to {ends[1]}{rate}"

    def columns(self) -> dict[str, np.ndarray]:
        """The arrays of this table by field name."""
        pairs = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: value for name, value in pairs if isinstance(value, np.ndarray)}

    @property
    def has_position(self) -> np.ndarray:
        """(n,) bool: the rows with a position."""
        return np.isfinite(self.latitude) & np.isfinite(self.longitude)

    def rows(self, chosen: Rows) -> Self:
        """The same table with the rows of a slice, mask or index array."""
        return replace(self, **{name: rows_of(column, chosen) for name, column in self.columns().items()})

    def between(self, start: float | None = None, stop: float | None = None) -> Self:
        """The rows with start ≤ time < stop (Unix s); None leaves an end open."""
        low = -np.inf if start is None else start
        high = np.inf if stop is None else stop
        return self.rows((self.time >= low) & (self.time < high))

    def tracks(self) -> Iterator[tuple[int | None, Self]]:
        """Each vessel's rows as (mmsi, table); a table without mmsi is one track. Rows of a vessel must be adjacent.

        Raises InputError if mmsi and time differ in length.
        """
        mmsi = self.columns().get("mmsi")
        if mmsi is None or len(self) == 0:
            yield None, self
            return
        if len(mmsi) != len(self):
            raise InputError(f"mmsi has {len(mmsi)} rows, expected {len(self)}, as many as the times")
        edges = np.flatnonzero(np.diff(mmsi)) + 1
        bounds = [0, *edges.tolist(), len(self)]
        for first, last in pairwise(bounds):
            yield int(mmsi[first]), self.rows(slice(first, last))


_UNKNOWN = np.array(np.nan)


def _unknown() -> Floats:
    """Placeholder for a column that is not given, until the number of rows is known."""
    return _UNKNOWN


@dataclass(frozen=True, eq=False, repr=False)
class Fixes(Record):
    """Measurements of receivers: one row per epoch, in time order (by vessel, then time, if `mmsi` is given).

    A row may have no position (a compass reading between two fixes): it aids the estimate, but Motion has no row for
    it.

    Shapes: every array (n,). Raises InputError when lengths differ, and for angles in degrees: latitudes beyond ±π/2.
    """

    _: KW_ONLY
    position_std: Floats = field(default_factory=_unknown)  # the receiver's own 1σ of north and of east
    sog: Floats = field(default_factory=_unknown)
    cog: Floats = field(default_factory=_unknown)  # true, rad
    heading: Floats = field(default_factory=_unknown)  # true, rad
    water_speed: Floats = field(default_factory=_unknown)  # along the hull
    yaw_rate: Floats = field(default_factory=_unknown)  # + starboard, rad/s
    bottom_speed: Floats = field(default_factory=_unknown)  # along the hull over ground, by a Doppler log
    acceleration: Floats = field(default_factory=_unknown)  # along the hull, m/s²; includes gravity when it pitches
    shaft: Floats = field(default_factory=_unknown)  # of the propeller, rev/s
    mmsi: np.ndarray | None = None  # int64
    source: str = ""
    notes: tuple[str, ...] = ()  # rows left out or corrected by the reader, one sentence each

    def __post_init__(self) -> None:
        n = len(self.time)
        for name in ("time", "latitude", "longitude", *REPORTED):
            given = getattr(self, name)
            column = (
                np.full(n, np.nan)
                if given is None or given is _UNKNOWN
                else np.ascontiguousarray(given, dtype=np.float64)
            )
            if column.shape != (n,):
                raise InputError(f"Fixes.{name} has shape {column.shape}, expected ({n},) as time has")
            object.__setattr__(self, name, column)
        for name, limit in (("latitude", 0.5 * np.pi), ("longitude", 2.0 * np.pi)):
            largest = np.fmax.reduce(np.abs(getattr(self, name)), initial=0.0)
            if largest > limit + _ROUNDING:
                raise InputError(f"Fixes.{name} has {largest:g} rad, expected at most {limit:.4f} rad (not degrees)")
        if self.mmsi is not None:
            object.__setattr__(self, "mmsi", np.ascontiguousarray(self.mmsi, dtype=np.int64))

    def in_order(self) -> Self:
        """The same rows sorted by vessel and time; rows of equal time keep their order."""
        keys = (self.time,) if self.mmsi is None else (self.time, self.mmsi)
        return self.rows(np.lexsort(keys))

    @classmethod
    def from_frame(cls, frame: Any) -> "Fixes":
        """Fixes from a polars or pandas DataFrame with columns named as in table files; the same as `steerway.read`.

        Raises InputError if it finds no columns for time, latitude and longitude.
        """
        return from_above["read"](frame)

    def to_frame(self) -> "pl.DataFrame":
        """A polars DataFrame: time_s, lat_deg, lon_deg, then the columns that were reported; unknown is null."""
        return _frame(self, _FIXES_COLUMNS, optional=True)


@dataclass(frozen=True, eq=False, repr=False)
class Motion(Record):
    """Estimates: position, SOG, COG and course rate with their standard deviations, one row per fix or output time.

    Shapes: every array (n,). `cog`, `course_rate` and their deviations are NaN where course is undefined.
    """

    _: KW_ONLY
    sog: np.ndarray
    cog: np.ndarray  # rad, [−π, π)
    course_rate: np.ndarray  # + starboard, rad/s
    sog_std: np.ndarray
    cog_std: np.ndarray
    course_rate_std: np.ndarray
    nis: np.ndarray  # normalised innovation squared of the position, 2 degrees of freedom
    status: np.ndarray  # uint8 index into STATUSES
    position_std: np.ndarray  # √((σ_N² + σ_E²)/2), the receiver's slow error included, see `core.slow_error`
    position_relative_std: np.ndarray | None = None  # without the slow error; None: as `position_std`
    mmsi: np.ndarray | None = None

    def __post_init__(self) -> None:
        if self.position_relative_std is None:
            object.__setattr__(self, "position_relative_std", self.position_std)

    def summary(self) -> dict[str, float | str | None]:
        """Statistics of the estimate over rows with known values, NaN without such rows; start, stop in ISO 8601."""
        from steerway.core.timestamps import iso

        status = np.bincount(self.status, minlength=len(STATUSES))
        return {
            "start": iso(round(self.time.min(), 3)) if len(self) else None,
            "stop": iso(round(self.time.max(), 3)) if len(self) else None,
            "duration_s": float(np.ptp(self.time)) if len(self) else 0.0,
            "rows": len(self),
            **{f"rows_{name}": int(status[k]) for k, name in enumerate(STATUSES)},
            "sog_median_mps": _quantile(self.sog, 0.5),
            "sog_max_mps": _quantile(self.sog, 1.0),
            "sog_std_median_mps": _quantile(self.sog_std, 0.5),
            "cog_std_median_deg": math.degrees(_quantile(self.cog_std, 0.5)),
            "course_rate_p95_dps": math.degrees(_quantile(np.abs(self.course_rate), 0.95)),
            "position_std_median_m": _quantile(self.position_std, 0.5),
            "course_defined_pct": 100.0 * float(np.isfinite(self.cog).mean()) if len(self) else 0.0,
        }

    def to_frame(self) -> "pl.DataFrame":
        """A polars DataFrame of the output columns, degrees where a name says so, null where unknown."""
        import polars as pl

        return _frame(self, MOTION_COLUMNS).with_columns(pl.Series("status", np.array(STATUSES)[self.status]))


def _quantile(values: Floats, q: float) -> float:
    known = values[np.isfinite(values)]
    return float(np.quantile(known, q)) if len(known) else math.nan


def _compass_degrees(radians: Floats) -> Floats:
    """Degrees in [0, 360)."""
    turned = np.mod(np.degrees(radians), 360.0)
    return np.where(turned >= 360.0, 0.0, turned)


Columns = dict[str, tuple[str, Callable[[Floats], Floats]]]
"""Name of a column of `to_frame` → the field, and the conversion to the unit in the name."""
_POSITION_COLUMNS: Columns = {
    "time_s": ("time", np.positive),
    "lat_deg": ("latitude", np.degrees),
    "lon_deg": ("longitude", np.degrees),
}
_FIXES_COLUMNS: Columns = _POSITION_COLUMNS | {
    "position_std_m": ("position_std", np.positive),
    "sog_mps": ("sog", np.positive),
    "cog_deg": ("cog", _compass_degrees),
    "heading_deg": ("heading", _compass_degrees),
    "water_speed_mps": ("water_speed", np.positive),
    "yaw_rate_dps": ("yaw_rate", np.degrees),
    "bottom_speed_mps": ("bottom_speed", np.positive),
    "acceleration_mps2": ("acceleration", np.positive),
    "shaft_rps": ("shaft", np.positive),
}
MOTION_COLUMNS: Columns = _POSITION_COLUMNS | {
    "sog_mps": ("sog", np.positive),
    "cog_deg": ("cog", _compass_degrees),
    "course_rate_dps": ("course_rate", np.degrees),
    "sog_std_mps": ("sog_std", np.positive),
    "cog_std_deg": ("cog_std", np.degrees),
    "course_rate_std_dps": ("course_rate_std", np.degrees),
    "position_std_m": ("position_std", np.positive),
    "position_relative_std_m": ("position_relative_std", np.positive),
    "nis": ("nis", np.positive),
}


def _frame(table: "Fixes | Motion", columns: Columns, optional: bool = False) -> "pl.DataFrame":
    """The table with these columns; with `optional`, columns without any value are left out."""
    import polars as pl

    series = [] if table.mmsi is None else [pl.Series("mmsi", table.mmsi)]
    for name, (attribute, convert) in columns.items():
        values = convert(getattr(table, attribute))
        if not optional or name in _POSITION_COLUMNS or np.isfinite(values).any():
            series.append(pl.Series(name, values, nan_to_null=True))
    return pl.DataFrame(series)
