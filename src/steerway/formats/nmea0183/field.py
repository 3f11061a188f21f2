"""One field of an NMEA 0183 sentence: a number in its range, a letter, an angle, a time of day.

Unknown is NaN where the field is empty; what is not in the format is infinity.
"""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.core.interpreted import part_of_kernels
from steerway.formats.nmea0183.text import digits, is_digit, number

_DOT = ord(".")
_E, _W = b"EW"


@part_of_kernels
def within(buffer: bytes, fields: NDArray[np.int64], k: int, low: float, high: float) -> float:
    """Field k as a number in [low, high]; NaN when empty, infinity when it is not such a number."""
    value = number(buffer, fields[k], fields[k + 1] - 1)
    return math.inf if value < low or value > high else value


@part_of_kernels
def letter_of(buffer: bytes, fields: NDArray[np.int64], k: int) -> int:
    """The one character of field k; 0 when empty, −1 when it holds more."""
    length = fields[k + 1] - 1 - fields[k]
    if length == 0:
        return 0
    return int(buffer[fields[k]]) if length == 1 else -1


@part_of_kernels
def angle_of(
    buffer: bytes, fields: NDArray[np.int64], k: int, degree_digits: int, limit: float, positive: int, negative: int
) -> tuple[float, float]:
    """Latitude or longitude of fields k, k + 1 (ddmm.mmm and its letter) and its last digit, rad.

    NaN when both are empty, infinity when they are not in the format.
    """
    first, last = fields[k], fields[k + 1] - 1
    mark = letter_of(buffer, fields, k + 1)
    if first == last and mark == 0:
        return math.nan, math.nan
    whole = degree_digits + 2
    if last - first < whole or (mark != positive and mark != negative):
        return math.inf, math.nan
    degrees = digits(buffer, first, degree_digits)
    if degrees < 0 or not is_digit(buffer[first + degree_digits]):
        return math.inf, math.nan
    if last - first > whole and buffer[first + whole] != _DOT:
        return math.inf, math.nan
    minutes = number(buffer, first + degree_digits, last)
    size = degrees + minutes / 60.0
    if not minutes < 60.0 or size > limit:
        return math.inf, math.nan
    decimals = max(0, last - first - whole - 1)
    quantum = math.radians(0.1**decimals / 60.0)
    return math.radians(size if mark == positive else -size), quantum


@part_of_kernels
def time_of_day(buffer: bytes, first: int, last: int) -> float:
    """hhmmss[.sss] as s; NaN when empty, infinity when impossible. A leap second reads 86400."""
    if first == last:
        return math.nan
    if last - first < 6 or (last - first > 6 and buffer[first + 6] != _DOT):
        return math.inf
    hours, minutes = digits(buffer, first, 2), digits(buffer, first + 2, 2)
    if not (0 <= hours < 24 and 0 <= minutes < 60 and is_digit(buffer[first + 4])):
        return math.inf
    seconds = number(buffer, first + 4, last)
    return 3600.0 * hours + 60.0 * minutes + seconds if 0.0 <= seconds < 61.0 else math.inf


@part_of_kernels
def century(year: int) -> int:
    """A year of two digits: GPS knows none before 1980."""
    return year + (1900 if year >= 80 else 2000)


@part_of_kernels
def signed(buffer: bytes, fields: NDArray[np.int64], k: int, limit: float) -> float:
    """An angle and its E or W, east positive, rad; NaN when either is empty, infinity when malformed."""
    size = within(buffer, fields, k, 0.0, limit)
    mark = letter_of(buffer, fields, k + 1)
    if mark != 0 and mark != _E and mark != _W:
        return math.inf
    if mark == 0:
        return math.inf if math.isinf(size) else math.nan
    return math.radians(size if mark == _E else -size)
