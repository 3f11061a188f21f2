"""Numbers and dates out of ASCII bytes, compiled."""

import math

from steerway.core.interpreted import part_of_kernels

_DASH, _PLUS, _DOT, _ZERO, _NINE = b"-+.09"


@part_of_kernels
def is_digit(c: int) -> bool:
    """Whether a byte is 0 to 9."""
    return _ZERO <= c <= _NINE


@part_of_kernels
def digits(buffer: bytes, first: int, n: int) -> int:
    """The integer that n digits spell, or −1."""
    value = 0
    for i in range(first, first + n):
        if not is_digit(buffer[i]):
            return -1
        value = 10 * value + (buffer[i] - _ZERO)
    return value


@part_of_kernels
def number(buffer: bytes, first: int, last: int) -> float:
    """The number of a field; NaN when empty, infinity when it is none. Rounded once, so equal to Python's float()."""
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
    """Days from 1970-01-01, infinity for no day of the calendar (Fliegel and Van Flandern 1968)."""
    if not (1 <= month <= 12 and 1 <= day and 1970 <= year < 2200):
        return math.inf
    leap = (year % 4 == 0 and year % 100 != 0) or year % 400 == 0
    longest = 30 + (month + month // 8) % 2 if month != 2 else (29 if leap else 28)
    if day > longest:
        return math.inf
    shift = (14 - month) // 12
    y, m = year + 4800 - shift, month + 12 * shift - 3
    return float(day + (153 * m + 2) // 5 + 365 * y + y // 4 - y // 100 + y // 400 - 32045 - 2440588)
