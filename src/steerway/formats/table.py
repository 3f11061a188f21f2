"""Read tables with named columns: CSV (comma, semicolon, tab or bar), Parquet and DataFrames.

A row needs a time and either a position or another measurement. The notes list the meaning of each column. An invalid
time, position or MMSI rejects its row; any other invalid cell counts as empty.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.earth import KNOT
from steerway.core.errors import InputError
from steerway.core.records import REPORTED, Fixes
from steerway.core.timestamps import dated, unix_times
from steerway.formats.cells import csv, header_of, parquet
from steerway.formats.columns import DEGREE, EXPECTED, Column, no_fix, spelled, understood, unit_in
from steerway.formats.places import degrees, places
from steerway.formats.recording import Recording
from steerway.formats.units import by_positions, from_fit, in_seconds, places_by_size, refuse_radians, time_by_motion

_MISSING = ("", "nan", "na", "n/a", "null", "none", "-", "--", "unknown")
_NEEDED = ("time", "latitude", "longitude", "north_south", "east_west", "mmsi")
_WITH_UNIT = r"^([+-]?[0-9][0-9.]*)\s*([^0-9\s.].*)$"
_CLOCK = r"^[0-9]{5,6}(\.[0-9]*)?$"  # hhmmss; written as a number, a first zero is missing
_VESSEL = "/vessel"  # a name that no column has
_SHOWN = 3  # number of bad cells per column that are listed with their line


def recognises(head: bytes) -> bool:
    """Whether the first bytes are those of Parquet, or of text with a header that contains a known column."""
    return head.startswith(b"PAR1") or header_of(head) is not None


def read(data: bytes) -> Recording:
    """The only source of a table: "AIS" if it has an MMSI column, else "table".

    Raises InputError if a column for time, latitude or longitude is missing, or a Parquet file is damaged.
    """
    skipped = Counter[str]()
    return _recording(_table_in(data, skipped), skipped)


def read_frame(frame: Any) -> Recording:
    """The source of a polars or pandas DataFrame, as `read` gives it; an index of times counts as a column.

    Raises InputError if a column for time, latitude or longitude is missing.
    """
    if not isinstance(frame, pl.DataFrame):
        indexed = frame.reset_index(names="time") if frame.index.dtype.kind == "M" else frame
        frame = pl.DataFrame({str(name): _of_pandas(indexed[name]) for name in indexed.columns})
    return _recording(_demanded(_Table("frame", frame, frame.columns)), Counter[str]())


def _of_pandas(series: Any) -> np.ndarray:
    """A pandas column as an array; times with a zone are converted to UTC."""
    zone = getattr(series.dtype, "tz", None)
    return series.to_numpy() if zone is None else series.dt.tz_convert("UTC").dt.tz_localize(None).to_numpy()


def read_vessels(data: bytes, vessel_column: str) -> tuple[dict[str, Recording], dict[str, int]]:
    """The recordings of a table of several vessels, by vessel (values of a column), and the rows left out by reason.

    The recordings have no notes, because line numbers would be wrong. Raises InputError as `read`, and if the column is
    missing.
    """
    skipped = Counter[str]()
    table = _table_in(data, skipped, vessel_column)
    frame, names = table.frame, table.names
    if vessel_column not in names:
        found = ", ".join(map(repr, names))
        raise InputError(f"the table has no column {vessel_column!r}, expected one of its columns: {found}")
    values = frame[vessel_column if table.kind == "Parquet" else f"{names.index(vessel_column)}"]
    if values.dtype.is_float() and (values == values.floor()).all():
        values = values.fill_nan(None).cast(pl.Int64, strict=False)
    vessel = values.cast(pl.String).str.strip_chars(' \t\r"').replace("", None)
    named = vessel.is_not_null()
    if lacking := int((~named.to_numpy() & ~_blank(frame)).sum()):
        skipped["no vessel"] += lacking
    recordings: dict[str, Recording] = {}
    parts = (
        frame.with_columns(vessel.alias(_VESSEL)).filter(named).partition_by(_VESSEL, as_dict=True, include_key=False)
    )
    for (name,), rows in parts.items():
        of_vessel = Counter[str]()
        recordings[name] = replace(_recording(table._replace(frame=rows), of_vessel), notes=())
        skipped.update(of_vessel)
    return recordings, dict(skipped)


class _Table(NamedTuple):
    """A frame with its column names, the line number of its first row and its delimiter."""

    kind: str
    frame: pl.DataFrame
    names: Sequence[str]
    first_line: int = 1
    delimiter: str = ","


def _table_in(data: bytes, skipped: Counter[str], vessel_column: str | None = None) -> _Table:
    if data.startswith(b"PAR1"):
        frame = parquet(data)
        return _demanded(_Table("Parquet", frame, frame.columns))
    return _demanded(_Table("CSV", *csv(data, skipped, vessel_column)))


def _demanded(table: _Table) -> _Table:
    """The table unchanged. Raises InputError if a column for time, latitude or longitude is missing."""
    columns = understood(table.names)
    missing = [meaning for meaning in ("time", "latitude", "longitude") if meaning not in columns]
    if missing:
        found = ", ".join(map(repr, table.names))
        raise InputError(f"the table has no column for {' and '.join(missing)}: found {found}, expected {EXPECTED}")
    return table


class _Reader:
    """Reads columns of a frame as arrays and counts invalid cells."""

    def __init__(self, table: _Table, skipped: Counter[str]) -> None:
        self.frame, self.first_line, self.skipped = table.frame, table.first_line, skipped
        self.notes: list[tuple[int, str]] = []  # line number and note
        self.decimal_comma = table.delimiter != ","
        self.blank = _blank(table.frame)
        self.bad = np.zeros(len(table.frame), dtype=bool)

    def numbers(self, column: Column, hemispheres: str = "") -> np.ndarray:
        """The column in its own unit, (n,) float, NaN where empty or bad. hemispheres: read degrees and minutes."""
        series = self._series(column)
        if series.dtype != pl.String:
            return _floats(series)
        text = self._text(series)
        values = _floats(self._plain(text).cast(pl.Float64, strict=False))
        lacking = (np.isnan(values) & text.is_not_null().to_numpy()).any()
        if lacking and hemispheres and column.factor != 1.0:
            values = np.where(np.isnan(values), degrees(self._plain(text), hemispheres), values)
        elif lacking and column.factor is not None:
            values = np.where(np.isnan(values), self._with_units(self._plain(text), column), values)
        self._account(column, text, np.isnan(values) & text.is_not_null().to_numpy())
        return np.where(np.isfinite(values), values, np.nan)

    def stated(self, column: Column) -> Column:
        """The column, with the unit stated in its first filled cell if its name states none."""
        series = self._series(column)
        if not column.assumed or series.dtype != pl.String:
            return column
        first = self._plain(self._text(series).drop_nulls().head(1)).str.extract_groups(_WITH_UNIT).struct.unnest()["2"]
        factor = unit_in(column.meaning, first.item() or "") if len(first) else None
        return column if factor is None else replace(column, factor=factor, basis="")

    def with_side(self, values: np.ndarray, column: Column | None, letters: str) -> np.ndarray:
        """Degrees (n,) of latitude or longitude with the signs from a column of hemispheres; letters: "NS" or "EW"."""
        if column is None:
            return values
        text = self._text(self._series(column).cast(pl.String))
        side = text.str.to_uppercase().str.slice(0, 1).fill_null("").to_numpy()
        with np.errstate(invalid="ignore"):
            bad = np.isfinite(values) & (~np.isin(side, tuple(letters)) | ((side == letters[0]) & (values < 0.0)))
        self._account(column, text.fill_null(""), bad)
        return np.where(side == letters[1], -np.abs(values), values)

    def lacks_fix(self, column: Column | None) -> np.ndarray:
        """(n,) bool: whether a column marks the row as having no fix."""
        if column is None:
            return np.zeros(len(self.frame), bool)
        text = self._series(column).cast(pl.String).str.strip_chars(' \t\r"').str.strip_suffix(".0").str.to_lowercase()
        return text.is_in(no_fix(column.name)).fill_null(False).to_numpy()

    def times(self, column: Column, date: Column | None = None, offset: Column | None = None) -> np.ndarray:
        """The time column as Unix s, from dates or numbers. The name states their unit, or their size shows it.

        date, offset: columns with the date and the offset from UTC, which complete a time of day.
        """
        series = self._series(column)
        if series.dtype.is_temporal():
            if series.dtype == pl.Time:
                raise InputError(f"column {column.name!r} of the table holds times without a date, expected {EXPECTED}")
            return _floats(series.cast(pl.Datetime("us")).to_physical()) / 1e6
        if series.dtype != pl.String:
            return dated(in_seconds(_floats(series), column.factor))
        text = self._text(series)
        numbers = _floats(self._plain(text).cast(pl.Float64, strict=False))
        if date is not None and (np.isnan(numbers).all() or text.drop_nulls().str.contains(_CLOCK).all()):
            return dated(unix_times(self._on_day(text, date, offset)))
        values = in_seconds(np.where(np.isfinite(numbers), numbers, np.nan), column.factor)
        if np.isnan(numbers).any():
            values = np.where(np.isnan(numbers), unix_times(text), values)
        return dated(values)

    def check_times(self, column: Column, values: np.ndarray) -> None:
        """Count the cells of a time column that are not a time."""
        if (series := self._series(column)).dtype == pl.String:
            text = self._text(series)
            self._account(column, text, np.isnan(values) & text.is_not_null().to_numpy())

    def _on_day(self, text: pl.Series, date: Column, offset: Column | None) -> pl.Series:
        """Dates with times of day, as text. Dates of six digits are yymmdd if that gives more dates than ddmmyy."""
        of_clock = text.str.contains(_CLOCK).fill_null(False)
        padded = pl.Series("padded", np.where(text.str.find(r"[0-9]{6}").is_null(), "0", ""), dtype=pl.String) + text
        text = text.zip_with(~of_clock, padded)
        day = self._text(self._series(date))
        if day.drop_nulls().str.contains(r"^[0-9]{6}$").all():
            orders = ((0, 2, 4), (4, 2, 0))
            days = ["20" + day.str.slice(y, 2) + day.str.slice(m, 2) + day.str.slice(d, 2) for y, m, d in orders]
            day = max(days, key=lambda each: np.isfinite(unix_times(each + " 00:00:00")).sum())
        whole = day + " " + text
        return whole if offset is None else whole + self._text(self._series(offset)).fill_null("")

    def _with_units(self, text: pl.Series, column: Column) -> Floats:
        """Numbers (n,) of cells with a unit after the number, converted to the column's unit; NaN for other cells."""
        groups = text.str.extract_groups(_WITH_UNIT).struct.unnest()
        factors = {unit: unit_in(column.meaning, unit) for unit in groups["2"].drop_nulls().unique()}
        beside = groups["2"].replace_strict(factors, default=None, return_dtype=pl.Float64)
        own = 1.0 if column.meaning == "position_std" else column.factor  # position_std: the factor is no unit
        return _floats(groups["1"].cast(pl.Float64, strict=False) * beside / own)

    def _series(self, column: Column) -> pl.Series:
        return self.frame[column.name] if column.name in self.frame.columns else self.frame[f"{column.index}"]

    def _text(self, series: pl.Series) -> pl.Series:
        stripped = series.str.strip_chars(' \t\r"')
        return stripped.set(stripped.str.to_lowercase().is_in(_MISSING).fill_null(False), None)

    def _plain(self, text: pl.Series) -> pl.Series:
        return text.str.replace(",", ".", literal=True) if self.decimal_comma else text

    def _account(self, column: Column, text: pl.Series, bad: NDArray[np.bool_]) -> None:
        bad = bad & ~self.blank
        if not bad.any():
            return
        self.skipped[f"{column.name} not understood"] += int(bad.sum())
        for row in np.flatnonzero(bad)[:_SHOWN]:
            line = self.first_line + int(row)
            self.notes.append((line, f"line {line}: {text[int(row)][:40]!r} is not a valid {column.meaning}"))
        if column.meaning in _NEEDED:
            self.bad |= bad


def _blank(frame: pl.DataFrame) -> NDArray[np.bool_]:
    """(n,) bool: whether the row is empty or a comment."""
    if frame.width == 0:
        return np.zeros(len(frame), dtype=bool)
    empty = frame.select(pl.all_horizontal(pl.all().is_null())).to_series().to_numpy()
    first = frame.to_series(0)
    return empty | first.str.starts_with("#").fill_null(False).to_numpy() if first.dtype == pl.String else empty


def _floats(series: pl.Series) -> Floats:
    return series.cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy()


def _recording(table: _Table, skipped: Counter[str]) -> Recording:
    columns, names, reader = understood(table.names), table.names, _Reader(table, skipped)
    is_ais = "mmsi" in columns
    place = [reader.numbers(columns["latitude"], "NS"), reader.numbers(columns["longitude"], "EW")]
    refuse_radians(columns, *place)
    columns |= places_by_size(columns, *place)
    place[0] = reader.with_side(place[0], columns.get("north_south"), "NS")
    place[1] = reader.with_side(place[1], columns.get("east_west"), "EW")
    place = [_degrees(numbers, columns[name]) for numbers, name in zip(place, ("latitude", "longitude"), strict=True)]
    if not is_ais:  # in AIS, 181° means no position
        with np.errstate(invalid="ignore"):  # altered bits can be a signalling NaN
            place[1] = np.where((place[1] > 180.0) & (place[1] <= 360.0), place[1] - 360.0, place[1])
    latitude, longitude = places(*place)
    columns |= {name: reader.stated(columns[name]) for name in REPORTED if name in columns}
    numbers = {name: reader.numbers(columns[name]) for name in REPORTED if name in columns}
    time = _time(reader, columns, names, latitude, longitude, numbers.get("sog"))
    without_fix = reader.lacks_fix(None if is_ais else columns.get("fix"))
    mmsi = reader.numbers(columns["mmsi"]) if is_ais else np.zeros(len(time))
    reported = {}
    for name, values in numbers.items():
        columns[name] = by_positions(columns[name], values, time, latitude, longitude)
        reported[name] = _in_si(name, values, columns[name], is_ais)
    empty = np.isnan(place[0]) & np.isnan(place[1])
    useful = np.isfinite(latitude) | (empty & np.any([np.isfinite(values) for values in reported.values()], axis=0))
    useful = np.broadcast_to(useful, len(time))
    out_of_range = ~useful & np.isfinite(place[0]) & np.isfinite(place[1]) & (not is_ais)
    keep = ~reader.blank & ~reader.bad
    for reason, good in (
        ("no fix", ~without_fix),
        ("no time", np.isfinite(time)),
        ("latitude or longitude out of range", ~out_of_range),
        ("no position", useful),
        ("no MMSI", (mmsi >= 0) & (mmsi < 1e10)),
    ):
        if lost := int((keep & ~good).sum()):
            skipped[reason] += lost
        keep &= good
    name = "AIS" if is_ais else "table"
    vessels = mmsi[keep].astype(np.int64) if is_ais else None
    known: dict[str, Any] = {name: values[keep] for name, values in reported.items()}
    fixes = Fixes(time[keep], latitude[keep], longitude[keep], **known, mmsi=vessels, source=name).in_order()
    counts = {"rows": int((~reader.blank).sum())}
    meanings = [f"columns: {', '.join(str(column) for column in columns.values())}"]
    if unused := [name for index, name in enumerate(names) if all(index != each.index for each in columns.values())]:
        meanings.append(f"columns not used: {', '.join(unused)}")
    lines = [note for _, note in sorted(reader.notes, key=lambda each: each[0])]
    return Recording.of(table.kind, (fixes,), counts, skipped, (*meanings, *lines))


def _time(
    reader: _Reader,
    columns: dict[str, Column],
    names: Sequence[str],
    latitude: Floats,
    longitude: Floats,
    sog: Floats | None,
) -> Floats:
    """Unix s (n,) of the first time column with plausible times, which `columns` then contains."""
    beside = columns.get("date"), columns.get("utc_offset")
    known = [each for each in spelled(names) if each.meaning == "time"]
    if "mmsi" in columns:
        time = reader.times(known[0], *beside)
    else:
        speed = np.full(len(latitude), np.nan) if sog is None else sog * columns["sog"].to_si
        columns["time"], time = time_by_motion(
            known, lambda column: reader.times(column, *beside), latitude, longitude, speed
        )
    time = from_fit(time, columns["latitude"])
    reader.check_times(columns["time"], time)
    return time


def _degrees(numbers: Floats, column: Column) -> Floats:
    if column.factor == 1.0:
        return np.degrees(numbers)
    return numbers if column.factor == DEGREE else numbers * (column.to_si / DEGREE)


def _in_si(name: str, numbers: Floats, column: Column, is_ais: bool) -> Floats:
    """A column in SI; NaN where the number means "unknown" (AIS: 102.3 kn, course 360°, heading 511°)."""
    values = numbers * column.to_si
    with np.errstate(invalid="ignore"):
        if name in ("cog", "heading"):
            limit = 2.0 * np.pi - 1e-9 if is_ais else 2.0 * np.pi + 1e-9
            return np.where((values > limit) | (values < -limit), np.nan, values)
        if name == "sog" and is_ais:
            values = np.where(values > 102.25 * KNOT, np.nan, values)
        if name in ("sog", "position_std"):
            values = np.where(values < 0.0, np.nan, values)
    return values
