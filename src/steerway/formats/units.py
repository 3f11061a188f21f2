"""Infer units that column names do not state: the units in which time, speed and course agree with the positions."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import chain

import numpy as np

from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats
from steerway.core.earth import KNOT, radii
from steerway.core.errors import InputError
from steerway.formats.columns import DEGREE, SEMICIRCLE, Column
from steerway.formats.fit import EPOCH

_WINDOW = 15.0  # s between differenced positions, which makes the noise of the speed about 0.1 m/s
_LEAST_SPEED = 0.35  # m/s, several times that noise
_FEWEST = 10  # rows
_NEAR = 0.25  # largest logarithm of the ratio of speeds; logarithms of units differ by 0.6 or more
_COURSE_NEAR = 0.35  # rad, largest median difference of the courses
_COARSE = 1e-6  # rad (6 m): positions in radians have at least this resolution
_SPEEDS = (1.0, KNOT, 1.0 / 3.6)
_ANGLES = (DEGREE, 1.0)
_TIMES = (1.0, 1e-3, 1e-6, 1e-9)
_DATED = 315_532_800.0, 4_102_444_800.0  # Unix s: 1980 to 2100
_SHORTEST_STEP, _LONGEST_STEP = 2e-3, 3600.0  # s, plausible median step of times that are not dates
_SLOWEST, _FASTEST = 0.01, 150.0  # m/s, plausible median speed of a vessel that moves
_AWAY = 20.0  # m from the first position to the last, above which the vessel moves
_OFF = 10.0  # largest factor between the speed by positions and the reported speed, either way
_LARGE = 1e4  # larger numbers are not degrees
_BEFORE_FIT = 1.2e9  # Unix s, 2008-01-10: no FIT file is older
_RADIUS = 6.37e6  # m, of the earth


def refuse_radians(columns: dict[str, Column], latitude: np.ndarray, longitude: np.ndarray) -> None:
    """Raises InputError if the column names state no unit and the positions (n,), as written, may be radians."""
    if not columns["latitude"].assumed:
        return
    known = np.isfinite(latitude) & np.isfinite(longitude)
    near = (np.abs(latitude[known]) <= 0.5 * np.pi) & (np.abs(longitude[known]) <= np.pi)
    decimals = latitude[known] / _COARSE if near.all() else latitude[known]
    if near.any() and near.all() and np.mean(np.abs(decimals - np.round(decimals)) > 1e-3) > 0.5:
        names = " and ".join(repr(columns[each].name) for each in ("latitude", "longitude"))
        raise InputError(
            f"the columns {names} lie within ±π/2 and ±π and may be radians, expected names that state the unit: "
            f"lat_rad and lon_rad, or lat_deg and lon_deg"
        )


def in_seconds(numbers: np.ndarray, factor: float | None) -> np.ndarray:
    """Times (n,) in s, converted by a factor. None: their size shows the unit, which is s, ms, µs or ns since 1970."""
    if factor is None:
        known = np.abs(numbers[np.isfinite(numbers)])
        factor = unit_by_size(float(np.median(known)) if len(known) else 0.0)
    with np.errstate(all="ignore"):  # altered bits can be a signalling NaN
        return numbers * factor if factor >= 1.0 else numbers / round(1.0 / factor)


def from_fit(time: Floats, latitude: Column) -> Floats:
    """Unix s of times (n,). If latitude is in semicircles, as in FIT, times before 2008 count from the epoch of FIT."""
    is_fit = latitude.factor == SEMICIRCLE and bool((time[np.isfinite(time)] < _BEFORE_FIT).any())
    return time + EPOCH if is_fit else time


def unit_by_size(size: float) -> float:
    """The factor that converts Unix times of this magnitude to s."""
    return next((unit for limit, unit in ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3)) if size > limit), 1.0)


def time_by_motion(
    columns: Iterable[Column],
    seconds: Callable[[Column], np.ndarray],
    latitude: np.ndarray,
    longitude: np.ndarray,
    sog: np.ndarray,
) -> tuple[Column, np.ndarray]:
    """The first time column with plausible dates, steps and speeds, and its times in Unix s (n,).

    The columns are tried in their own unit, then in others. If none is plausible, the first one is returned in its own
    unit. seconds: reads a column with its factor. latitude, longitude (rad), sog (m/s, correct within `_OFF`): (n,).
    """
    columns = list(columns)
    others = (replace(each, factor=factor, basis="by the steps and speeds") for each in columns for factor in _TIMES)
    first = seconds(columns[0])
    for column in chain(columns, others):
        time = first if column is columns[0] else seconds(column)
        if _is_possible(time, latitude, longitude, sog):
            return column, time
    return columns[0], first


def _is_possible(time: Floats, latitude: Floats, longitude: Floats, sog: Floats) -> bool:
    known = np.isfinite(time) & np.isfinite(latitude) & np.isfinite(longitude)
    if np.isfinite(time).any() and _DATED[0] <= np.nanmedian(time) < _DATED[1]:
        return True
    if known.sum() < _FEWEST:
        return bool(np.isfinite(time).any())
    time, latitude, longitude, sog = (each[known] for each in (time, latitude, longitude, sog))
    steps = np.diff(np.unique(time))
    if not len(steps) or not _SHORTEST_STEP <= np.median(steps) <= _LONGEST_STEP:
        return False
    speeds, _, means, _ = _differenced(time, latitude, longitude, np.nan_to_num(sog))
    speed, reported = (float(np.median(each)) if len(each) else 0.0 for each in (speeds, means))
    east = (longitude[-1] - longitude[0]) * np.cos(latitude[0])
    away = float(np.hypot(latitude[-1] - latitude[0], east)) * _RADIUS
    if speed > _FASTEST or (speed < _SLOWEST and away > _AWAY):
        return False
    return not (reported > _LEAST_SPEED and away > _AWAY) or reported / _OFF <= speed <= reported * _OFF


def places_by_size(columns: dict[str, Column], latitude: np.ndarray, longitude: np.ndarray) -> dict[str, Column]:
    """The position columns, with the unit of whole numbers if the values (n,) are too large for degrees."""
    axes = {name: columns[name] for name in ("latitude", "longitude")}
    size = np.hypot(latitude, longitude)
    if not axes["latitude"].assumed or not np.isfinite(size).any() or np.nanmedian(size) < _LARGE:
        return axes
    is_fit = axes["latitude"].name.lower().startswith("position")
    factor = SEMICIRCLE if is_fit else 1e-7 * DEGREE
    return {name: replace(column, factor=factor, basis="by their size") for name, column in axes.items()}


def by_positions(
    column: Column, values: np.ndarray, time: np.ndarray, latitude: np.ndarray, longitude: np.ndarray
) -> Column:
    """The column with the unit that fits the positions best; unchanged if none fits or its name states the unit.

    values (n,), in the unit of the column; time (n,), s; latitude, longitude (n,), rad.
    """
    if not column.assumed or column.meaning not in ("sog", "cog"):
        return column
    known = np.isfinite(time) & np.isfinite(latitude) & np.isfinite(longitude) & np.isfinite(values)
    if known.sum() < _FEWEST:
        return column
    speed, course, mean, middle = _differenced(*(each[known] for each in (time, latitude, longitude, values)))
    fast = speed > _LEAST_SPEED
    if fast.sum() < _FEWEST:
        return column
    if column.meaning == "sog":
        ratio = float(np.median(mean[fast] / speed[fast]))
        misfit = {unit: abs(np.log(max(ratio, 1e-9) * unit)) / _NEAR for unit in _SPEEDS}
    else:
        apart = {unit: np.abs(wrap_array(middle[fast] * unit - course[fast])) for unit in _ANGLES}
        misfit = {unit: float(np.median(each)) / _COURSE_NEAR for unit, each in apart.items()}
    best = min(misfit, key=lambda each: misfit[each])
    return replace(column, factor=best, basis="by the positions") if misfit[best] < 1.0 else column


def _differenced(
    time: Floats, latitude: Floats, longitude: Floats, values: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Speed (m/s) and course (rad) between positions `_WINDOW` apart; mean and middle value in between."""
    order = np.argsort(time, kind="stable")
    time, latitude, longitude, values = time[order], latitude[order], np.unwrap(longitude[order]), values[order]
    first = np.arange(len(time) - 1)
    last = np.minimum(np.maximum(np.searchsorted(time, time[:-1] + _WINDOW), first + 1), len(time) - 1)
    elapsed = time[last] - time[first]
    useful = (elapsed > 0.0) & (elapsed < 12.0 * _WINDOW)
    first, last, elapsed = first[useful], last[useful], elapsed[useful]
    meridian, prime_vertical = radii(float(latitude[0]))
    north = (latitude[last] - latitude[first]) * meridian
    east = (longitude[last] - longitude[first]) * prime_vertical * np.cos(latitude[first])
    total = np.concatenate([[0.0], np.cumsum(values)])
    mean = (total[last + 1] - total[first]) / (last + 1 - first)
    return np.hypot(north, east) / elapsed, np.arctan2(east, north), mean, values[(first + last) // 2]
