"""Find sentences in bytes: where each begins and ends, whether its checksum is valid, and its receive time.

A sentence that fails is counted under a reason, and the search continues one byte after its beginning. So damage costs
only the damaged sentence; noise, binary messages and spliced sentences need no special case.
"""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.interpreted import part_of_kernels
from steerway.formats.nmea0183.field import day_number, digits, is_digit, number
from steerway.formats.nmea0183.fields import (
    CHECKSUM,
    CUT,
    FORMATTERS,
    HEADER,
    NO_CHECKSUM,
    NO_FIX,
    READ,
    RECEIVED,
    TOD,
    read_fields,
)

TALKERS = 36 * 36
SHORTEST = 8  # bytes of the shortest sentence

_LONGEST = 256  # bytes; the standard allows 82, some receivers and converters write more
_PREFIX = 64  # bytes before the `$` that are searched for a receive time
_FIELDS = 40
_CODES = np.array([int.from_bytes(name.encode(), "big") for name in FORMATTERS])
_DOLLAR, _BANG, _STAR, _COMMA, _DOT, _LF, _CR = b"$!*,.\n\r"
_A, _P, _T, _Z, _LOWER_A, _LOWER_F, _ZERO = b"APTZaf0"
_DASH, _PLUS, _COLON, _SPACE = b"-+: "
_INCOMPLETE, _NOISE, _BAD_HEADER = -2, -3, -4
_EARLIEST = 5e8  # Unix s (1985): a smaller number of ten digits is a counter


@part_of_kernels
def _is_capital(c: int) -> bool:
    return _A <= c <= _Z


@part_of_kernels
def _talker(first: int, second: int) -> int:
    """Two header bytes as an index below TALKERS."""
    high = first - _ZERO if is_digit(first) else first - _A + 10
    low = second - _ZERO if is_digit(second) else second - _A + 10
    return 36 * high + low


def talker_name(index: int) -> str:
    """The two characters of a talker, from its index."""
    letters = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ"
    return letters[index // 36] + letters[index % 36]


@part_of_kernels
def _hexadecimal(c: int) -> int:
    """The value of a hexadecimal digit in either case, or −1."""
    if is_digit(c):
        return c - _ZERO
    if _A <= c <= _A + 5:
        return c - _A + 10
    return c - _LOWER_A + 10 if _LOWER_A <= c <= _LOWER_F else -1


@part_of_kernels
def _iso_time(buffer: bytes, first: int, last: int) -> float:
    """Unix time of YYYY-MM-DD, T or blank, hh:mm:ss[.sss][Z or ±hh:mm] at `first`; NaN for other text."""
    if last - first < 19 or buffer[first + 4] != _DASH or buffer[first + 7] != _DASH:
        return math.nan
    if buffer[first + 13] != _COLON or buffer[first + 16] != _COLON:
        return math.nan
    if buffer[first + 10] != _T and buffer[first + 10] != _SPACE:
        return math.nan
    day = day_number(digits(buffer, first, 4), digits(buffer, first + 5, 2), digits(buffer, first + 8, 2))
    hours, minutes = digits(buffer, first + 11, 2), digits(buffer, first + 14, 2)
    end = first + 17
    while end < last and (is_digit(buffer[end]) or buffer[end] == _DOT):
        end += 1
    seconds = number(buffer, first + 17, end)
    if math.isinf(day) or not (0 <= hours < 24 and 0 <= minutes < 60 and 0.0 <= seconds < 61.0):
        return math.nan
    time = 86400.0 * day + 3600.0 * hours + 60.0 * minutes + seconds
    if last - end >= 6 and (buffer[end] == _PLUS or buffer[end] == _DASH) and buffer[end + 3] == _COLON:
        ahead = 3600.0 * digits(buffer, end + 1, 2) + 60.0 * digits(buffer, end + 4, 2)
        time -= ahead if buffer[end] == _PLUS else -ahead
    return time


@part_of_kernels
def _received(buffer: bytes, first: int, last: int) -> float:
    """The receive time (Unix s) in a line's prefix: the first ISO time, or Unix s, ms or µs (10, 13, 16 digits)."""
    i = first
    while i < last:
        end = i
        while end < last and is_digit(buffer[end]):
            end += 1
        length = end - i
        if length == 4:
            time = _iso_time(buffer, i, last)
            if math.isfinite(time):
                return time
        elif length == 10:
            if end < last and buffer[end] == _DOT:
                end += 1
                while end < last and is_digit(buffer[end]):
                    end += 1
            whole = float(digits(buffer, i, 10))
            fraction = number(buffer, i + 10, end)
            if whole > _EARLIEST:
                return whole + fraction if math.isfinite(fraction) else whole
        elif length == 13 or length == 16:
            time = digits(buffer, i, length) / 10.0 ** (length - 10)
            if time > _EARLIEST:
                return time
        i = end + 1
    return math.nan


@part_of_kernels
def _header_end(buffer: bytes, start: int, stop: int) -> int:
    """Index of the comma after a header of 4 to 8 capitals and digits; else _INCOMPLETE, _NOISE or _BAD_HEADER.

    A talker can begin with a digit, because n2kd names a device on the bus by its address.
    """
    i = start + 1
    while i < stop and i <= start + 8 and (_is_capital(buffer[i]) or is_digit(buffer[i])):
        i += 1
    if i == stop and i <= start + 8:
        return _INCOMPLETE
    begins_well = _is_capital(buffer[start + 1]) or i - start == 6
    if 5 <= i - start <= 9 and buffer[i] == _COMMA and begins_well:
        return i
    return _BAD_HEADER if i - start > 3 else _NOISE


@part_of_kernels
def _sentence_end(
    buffer: bytes,
    start: int,
    stop: int,
    final: bool,
    talkers_with_checksum: NDArray[np.bool_],
    talker: int,
    header_end: int,
    fields: NDArray[np.int64],
) -> tuple[int, int, int]:
    """Fill `fields` with where the fields of a sentence begin, and check its checksum.

    Returns (outcome, number of fields, index after the sentence); outcome is READ, a reason or _INCOMPLETE.
    """
    sum_, n = 0, 1
    fields[0] = start + 1
    for i in range(start + 1, header_end):
        sum_ ^= buffer[i]
    i = header_end
    while i < stop:
        c = buffer[i]
        if c == _STAR:
            if stop - i < 3:
                return (CUT if final else _INCOMPLETE), n, i
            fields[n] = i + 1
            high, low = _hexadecimal(buffer[i + 1]), _hexadecimal(buffer[i + 2])
            holds = high >= 0 and low >= 0 and 16 * high + low == sum_
            if holds and talker >= 0:
                talkers_with_checksum[talker] = True
            return (READ if holds else CHECKSUM), n, i + 3
        if c == _LF or c == _CR:
            fields[n] = i + 1
            known = talker >= 0 and talkers_with_checksum[talker]
            return (NO_CHECKSUM if known else READ), n, i
        if c == _DOLLAR or c < 32 or c > 126 or i - start > _LONGEST:
            return CUT, n, i
        sum_ ^= c
        if c == _COMMA:
            if n < _FIELDS - 1:
                fields[n] = i + 1
            n = min(n + 1, _FIELDS - 1)
        i += 1
    return (CUT if final else _INCOMPLETE), n, i


@kernel
def scan(
    buffer: bytes,
    final: bool,
    arrived: float,
    carry: Floats,
    talkers_with_checksum: NDArray[np.bool_],
    headers: NDArray[np.int64],
    offsets: NDArray[np.int64],
    kinds: NDArray[np.int64],
    talkers: NDArray[np.int64],
    values: Floats,
    skipped: NDArray[np.int64],
) -> tuple[int, int, int]:
    """Find and read every sentence in a buffer.

    Parameters: `arrived`: receive time of lines without one of their own (NaN: unknown); `carry` (1,): receive time of
    the line in which the chunk begins. Filled: `headers` of all valid sentences (up to 8 bytes as an integer);
    `offsets`, `kinds`, `talkers` and `values` (n, VALUES) of those that are read; `skipped` (reasons,), counts of the
    others. Returns (number of valid sentences, number read, index from which the next chunk must repeat the bytes).
    """
    fields = np.empty(_FIELDS + 1, np.int64)
    stop = len(buffer)
    n_sound, n_read, i, line = 0, 0, 0, 0
    while i < stop:
        c = buffer[i]
        if c == _LF:
            line = i + 1
            carry[0] = math.nan
        if c != _DOLLAR and c != _BANG:
            i += 1
            continue
        prefix = max(line, i - _PREFIX)
        if prefix < i:
            received = _received(buffer, prefix, i)
            if math.isfinite(received):
                carry[0] = received
        header_end = _header_end(buffer, i, stop)
        if header_end == _INCOMPLETE and not final:
            return n_sound, n_read, prefix
        if header_end < 0:
            if header_end == _BAD_HEADER:
                skipped[HEADER] += 1
            i += 1
            line = i
            continue
        proprietary = buffer[i + 1] == _P
        talker = _talker(buffer[i + 1], buffer[i + 2]) if c == _DOLLAR and header_end == i + 6 else -1
        if proprietary:
            talker = -1
        outcome, n, end = _sentence_end(buffer, i, stop, final, talkers_with_checksum, talker, header_end, fields)
        if outcome == _INCOMPLETE:
            return n_sound, n_read, prefix
        if outcome != READ:
            skipped[outcome] += 1
            i += 1
            line = i
            continue
        code = 0
        for k in range(i + 1, header_end):
            code = (code << 8) | int(buffer[k])
        headers[n_sound] = code
        n_sound += 1
        if talker >= 0:
            formatter = code & 0xFFFFFF
            for kind in range(len(_CODES)):
                if formatter == _CODES[kind]:
                    row = values[n_read]
                    row[:] = math.nan
                    reason = read_fields(buffer, fields, n, kind, row)
                    if reason != READ:
                        skipped[reason] += 1
                    if reason == READ or (reason == NO_FIX and math.isfinite(row[TOD])):
                        row[RECEIVED] = carry[0] if math.isfinite(carry[0]) else arrived
                        kinds[n_read], talkers[n_read], offsets[n_read] = kind, talker, i
                        n_read += 1
                    break
        i = end
        line = end
    return n_sound, n_read, max(line, stop - _PREFIX)
