"""Read the fields of an NMEA 0183 sentence from bytes: numbers in a range, letters, angles, times and dates.

An empty field gives NaN; a field that does not match the format gives infinity.
"""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.core.interpreted import part_of_kernels

_E, _W = b"EW"
_DASH, _PLUS, _DOT, _ZERO, _NINE = b"-+.09"


@part_of_kernels
def is_digit(c: int) -> bool:
    """Whether a byte is 0 to 9."""
    return _ZERO <= c <= _NINE


@part_of_kernels
def digits(buffer: bytes, first: int, n: int) -> int:
    """The integer of n digits; −1 if one is not a digit."""
    value = 0
    for i in range(first, first + n):
        if not is_digit(buffer[i]):
            return -1
        value = 10 * value + (buffer[i] - _ZERO)
    return value


@part_of_kernels
def number(buffer: bytes, first: int, last: int) -> float:
    """The number in a field: NaN if empty, infinity if it is not a number. It is rounded once and so equals float()."""
    if first == last:
        return math.nan
    i = first
    sign = 1.0
    if buffer[i] == _DASH or buffer[i] == _PLUS:
        sign = -1.0 if buffer[i] == _DASH else 1.0
        i += 1
    mantissa, digits, scale, dotted = 0, 0, 1.0, False
    while i < last:
        c = buffer[i]
        if c == _DOT and not dotted:
            dotted = True
        elif is_digit(c) and digits < 15:
            mantissa = 10 * mantissa + (c - _ZERO)
            digits += 1
            if dotted:
                scale *= 10.0
        else:
            return math.inf
        i += 1
    return sign * mantissa / scale if digits > 0 else math.inf


@part_of_kernels
def day_number(year: int, month: int, day: int) -> float:
    """Days from 1970-01-01; infinity for a date that does not exist (Fliegel and Van Flandern 1968)."""
    if not (1 <= month <= 12 and 1 <= day and 1970 <= year < 2200):
        return math.inf
    leap = (year % 4 == 0 and year % 100 != 0) or year % 400 == 0
    longest = 30 + (month + month // 8) % 2 if month != 2 else (29 if leap else 28)
    if day > longest:
        return math.inf
    shift = (14 - month) // 12
    y, m = year + 4800 - shift, month + 12 * shift - 3
    return float(day + (153 * m + 2) // 5 + 365 * y + y // 4 - y // 100 + y // 400 - 32045 - 2440588)


@part_of_kernels
def within(buffer: bytes, fields: NDArray[np.int64], k: int, low: float, high: float) -> float:
    """Field k as a number in [low, high]; NaN if empty, infinity if it is not such a number."""
    value = number(buffer, fields[k], fields[k + 1] - 1)
    return math.inf if value < low or value > high else value


@part_of_kernels
def letter_of(buffer: bytes, fields: NDArray[np.int64], k: int) -> int:
    """The single character of field k; 0 if empty, −1 if there are more."""
    length = fields[k + 1] - 1 - fields[k]
    if length == 0:
        return 0
    return int(buffer[fields[k]]) if length == 1 else -1


@part_of_kernels
def angle_of(
    buffer: bytes, fields: NDArray[np.int64], k: int, degree_digits: int, limit: float, positive: int, negative: int
) -> tuple[float, float]:
    """Latitude or longitude in fields k, k + 1 (ddmm.mmm and its letter), and its last digit; rad.

    The angle is NaN if both fields are empty, infinity if they do not match the format.
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
    """hhmmss[.sss] as s; NaN if empty, infinity if impossible. A leap second gives 86400."""
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
    """The year (1980 to 2079) of a two-digit year: GPS time begins in 1980."""
    return year + (1900 if year >= 80 else 2000)


@part_of_kernels
def signed(buffer: bytes, fields: NDArray[np.int64], k: int, limit: float) -> float:
    """Angle in fields k, k + 1 (degrees, E or W), rad, east positive; NaN if either is empty, infinity if malformed."""
    size = within(buffer, fields, k, 0.0, limit)
    mark = letter_of(buffer, fields, k + 1)
    if mark != 0 and mark != _E and mark != _W:
        return math.inf
    if mark == 0:
        return math.inf if math.isinf(size) else math.nan
    return math.radians(size if mark == _E else -size)
