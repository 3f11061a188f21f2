"""Units of columns whose names state none, from the data: positions say how fast and where to the vessel moves."""

from dataclasses import replace

import numpy as np

from steerway.core.angles import wrap_array
from steerway.core.earth import KNOT, radii
from steerway.core.errors import InputError
from steerway.formats.columns import DEGREE, Column

_WINDOW = 15.0  # s over which the positions are differenced: their noise is then some 0.1 m/s
_LEAST_SPEED = 0.35  # m/s, several times that
_FEWEST = 10
_NEAR = 0.25  # of the logarithm of a ratio; units differ by 0.6 and more
_COURSE_NEAR = 0.35  # rad, median
_COARSE = 1e-6  # rad, 6 m: no position is written in radians with fewer decimals
_SPEEDS = (1.0, KNOT, 1.0 / 3.6)
_ANGLES = (DEGREE, 1.0)


def refuse_radians(columns: dict[str, Column], latitude: np.ndarray, longitude: np.ndarray) -> None:
    """InputError for positions (as they stand, (n,)) that may be radians where the columns' names state no unit."""
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


def by_positions(column: Column, values: np.ndarray, time: np.ndarray, latitude: np.ndarray, longitude: np.ndarray):
    """The column with the unit that fits the positions (rad) best, itself where none does or its name states it.

    Shapes: values, time, latitude, longitude (n,).
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
    best = min(misfit, key=misfit.get)
    return replace(column, factor=best, basis="by the positions") if misfit[best] < 1.0 else column


def _differenced(time, latitude, longitude, values):
    """Speed and course from a position to a later one, the mean of the values between, and the middle one."""
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
