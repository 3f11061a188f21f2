"""Convert columns of dates in logs and tables to Unix time, and write dates in one format."""

import datetime
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from steerway.core.arrays import Floats

if TYPE_CHECKING:
    import polars as pl

_CLOCK = (
    r"[T\s_Z-]*([0-9]{1,2}):?([0-9]{2})(?::?([0-9]{2}(?:[.,][0-9]+)?))?\s*([AaPp][Mm])?"
    r"\s*(Z|UTC|[+-][0-9]{2}(?::?[0-9]{2})?)?\s*$"
)
_YEAR_1, _YEAR_10000 = -62_135_596_800.0, 253_402_300_800.0
_YEAR_FIRST = r"^\s*([0-9]{4})[-/.]?([0-9]{2})[-/.]?([0-9]{2})" + _CLOCK
_YEAR_LAST = r"^\s*([0-9]{1,2})[/.-]([0-9]{1,2})[/.-]([0-9]{4})" + _CLOCK


def unix_times(texts: "Sequence[str | None] | pl.Series") -> np.ndarray:
    """Unix seconds (n,) of n dates: ISO 8601 and similar, or day and month before the year; NaN for other texts.

    Times have 24 hours, or am or pm. Without an offset a time is UTC. If the year comes last, the day comes first,
    unless more texts are valid dates with the month first.
    """
    import polars as pl  # a live run needs it only where dates are text

    column = pl.Series("text", texts, dtype=pl.String)
    parts = _parts(column, _YEAR_FIRST)
    seconds = _seconds(*parts)
    if np.isnan(seconds).any():
        first, second, year, *clock = _parts(column, _YEAR_LAST)
        day_first, month_first = (_seconds(year, second, first, *clock), _seconds(year, first, second, *clock))
        better = np.isfinite(month_first).sum() > np.isfinite(day_first).sum()
        seconds = np.where(np.isnan(seconds), month_first if better else day_first, seconds)
    return seconds


def dated(seconds: Floats) -> Floats:
    """Unix seconds (n,) with NaN in place of those outside the years 1 to 9999, which have no date."""
    with np.errstate(invalid="ignore"):
        return np.where((seconds >= _YEAR_1) & (seconds < _YEAR_10000), seconds, np.nan)


def iso(time: float) -> str:
    """ISO 8601 of a Unix time, UTC, with the fewest decimals that `unix_times` reads back as the same number."""
    whole = int(time // 1.0)
    date = (datetime.datetime(1970, 1, 1) + datetime.timedelta(seconds=whole)).isoformat()
    for digits in range(10):
        fraction = f"{time - whole:.{digits}f}"
        if whole + float(fraction) == time and not fraction.startswith("1"):
            return f"{date}{fraction[1:]}Z"
    return f"{date}{fraction[1:]}Z"


def _parts(column: "pl.Series", pattern: str) -> tuple[Floats, ...]:
    """Three numbers of the date, three of the clock, and the offset from UTC in seconds; NaN where no match."""
    import polars as pl

    groups = column.str.extract_groups(pattern).struct.unnest()
    numbers = [
        groups[f"{index}"].str.replace(",", ".", literal=True).cast(pl.Float64, strict=False).to_numpy()
        for index in range(1, 7)
    ]
    matched = groups["1"].is_not_null().to_numpy()
    numbers[5] = np.where(np.isnan(numbers[5]) & matched, 0.0, numbers[5])
    numbers[3] = _of_day(numbers[3], groups["7"].str.to_lowercase())
    return *numbers, _offset(groups["8"])


def _of_day(hours: Floats, halves: "pl.Series") -> Floats:
    """Hours of the day from hours with am or pm; NaN for hours that a 12-hour clock does not have."""
    if halves.null_count() == len(halves):
        return hours
    twelve = halves.is_not_null().to_numpy()
    with np.errstate(invalid="ignore"):
        shown = (hours >= 1.0) & (hours <= 12.0)
    later = (halves == "pm").fill_null(False).to_numpy()
    return np.where(twelve, np.where(shown, hours % 12.0 + 12.0 * later, np.nan), hours)


def _offset(zones: "pl.Series") -> Floats:
    """Seconds east of UTC of Z, ±hh, ±hhmm and ±hh:mm."""
    if zones.null_count() == len(zones) or not zones.str.contains("[+-]").any():
        return np.zeros(len(zones))
    import polars as pl

    digits = zones.str.extract_groups(r"([+-])([0-9]{2}):?([0-9]{2})?").struct.unnest()
    hours, minutes = (digits[name].cast(pl.Float64).fill_null(0.0).to_numpy() for name in ("2", "3"))
    sign = np.where((digits["1"] == "-").fill_null(False).to_numpy(), -1.0, 1.0)
    return sign * (hours * 3600.0 + minutes * 60.0)


def _seconds(
    year: Floats, month: Floats, day: Floats, hour: Floats, minute: Floats, second: Floats, offset: Floats
) -> Floats:
    """Unix seconds of a civil date; NaN where there is no such date."""
    with np.errstate(invalid="ignore"):
        valid = (year >= 1) & (month >= 1) & (month <= 12) & (day >= 1) & (hour < 24) & (minute < 60) & (second < 61)
    whole = [np.where(valid, part, 1.0).astype(np.int64) for part in (year, month, day, hour, minute)]
    first_of_month = (whole[0] - 1970).astype("M8[Y]").astype("M8[M]") + (whole[1] - 1)
    date = first_of_month.astype("M8[D]") + (whole[2] - 1)
    valid &= date.astype("M8[M]") == first_of_month
    minutes = date.astype(np.int64) * 1440 + whole[3] * 60 + whole[4]
    return np.where(valid, minutes * 60.0 + second - offset, np.nan)
