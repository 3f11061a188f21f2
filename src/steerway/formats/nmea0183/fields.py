"""Read the fields of one NMEA 0183 sentence as SI values, or give the reason for its rejection.

A multiplexer can recompute a checksum after damage, so a valid checksum is not enough: every field that is used must
match its format and range. Formatters and fields: NMEA 0183 version 4.11, as receiver manuals reprint them.
"""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.earth import KNOT
from steerway.core.interpreted import part_of_kernels
from steerway.formats import dilution
from steerway.formats.nmea0183.field import (
    angle_of,
    century,
    day_number,
    digits,
    letter_of,
    signed,
    time_of_day,
    within,
)

FORMATTERS = ("GGA", "RMC", "GLL", "GNS", "VTG", "ZDA", "HDT", "HDG", "HDM", "THS", "VHW", "ROT", "GST", "VBW", "RPM")
GGA, RMC, GLL, GNS, VTG, ZDA, HDT, HDG, HDM, THS, VHW, ROT, GST, VBW, RPM = range(len(FORMATTERS))
LAST_POSITION = GNS  # formatters up to this one contain a position
_FIELDS = (
    (15,), (12, 13, 14), (5, 7, 8), (13, 14), (9, 10), (5, 6, 7, 8), (3,), (6,), (3,), (3,), (9,), (3,),
    (9,), (7, 11), (6,),
)  # fmt: skip
_COUNTS = np.array([sum(1 << n for n in each) for each in _FIELDS])
"""Allowed numbers of fields by kind of sentence: bit n is set if n fields, with the header, occur in practice."""

REASONS = (
    "checksum wrong",
    "checksum missing, unlike the talker's other sentences",
    "cut short or spliced",
    "header malformed",
    "wrong number of fields",
    "a field is malformed or out of range",
    "position not in the format",
    "time or date impossible",
    "no fix: status V, mode N or quality 0",
)
CHECKSUM, NO_CHECKSUM, CUT, HEADER, COUNT, FIELD, POSITION, TIME, NO_FIX = range(len(REASONS))
READ = -1

# Columns of a sentence's values in SI, NaN for unknown. TOD: s since midnight; DAY: days since 1970-01-01; QUANTUM:
# last digit of the position, rad; RECEIVED: receive time before the sentence, Unix s.
VALUES = 16
TOD, DAY, LAT, LON, QUANTUM, SOG, COG, HEADING, MAGNETIC, VARIATION, WATER, YAW, STD, BOTTOM, SHAFT, RECEIVED = range(
    VALUES
)

_FASTEST = 1000.0 * KNOT
_A, _E, _K, _M, _N, _S, _T, _V, _W, _Z = b"AEKMNSTVWZ"
_MODES = (ord("N"), *b"ADPRFE")  # mode indicators by GGA quality


@part_of_kernels
def _position(buffer: bytes, fields: NDArray[np.int64], k: int, row: Floats) -> int:
    """Read fields k to k + 3 into LAT, LON, QUANTUM; returns the reason for rejection or READ."""
    latitude, quantum = angle_of(buffer, fields, k, 2, 90.0, _N, _S)
    longitude, quantum_lon = angle_of(buffer, fields, k + 2, 3, 180.0, _E, _W)
    if math.isinf(latitude) or math.isinf(longitude):
        return POSITION
    if math.isnan(latitude) or math.isnan(longitude):
        return POSITION if math.isfinite(latitude) or math.isfinite(longitude) else NO_FIX
    row[LAT] = latitude
    row[LON] = longitude if longitude < math.pi else -math.pi
    row[QUANTUM] = max(quantum, quantum_lon)
    return READ


@part_of_kernels
def _speed_and_course(
    buffer: bytes, fields: NDArray[np.int64], speed_field: int, unit: float, course_field: int, row: Floats
) -> int:
    """Read SOG, in units of `unit` (m/s), and true COG, if present; returns the reason for rejection or READ."""
    speed = within(buffer, fields, speed_field, 0.0, _FASTEST / unit)
    course = within(buffer, fields, course_field, 0.0, 360.0)
    if math.isinf(speed) or math.isinf(course):
        return FIELD
    row[SOG] = speed * unit
    row[COG] = math.radians(course)
    return READ


@part_of_kernels
def _gga(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    quality = within(buffer, fields, 6, 0.0, 8.0)
    hdop = within(buffer, fields, 8, 0.0, 1e4)
    if math.isinf(quality) or math.isinf(hdop):
        return FIELD
    row[STD] = dilution.deviation(hdop, quality)
    return _position(buffer, fields, 2, row) if quality > 0.0 else NO_FIX


@part_of_kernels
def _rmc(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    status = letter_of(buffer, fields, 2)
    mode = letter_of(buffer, fields, 12) if n > 12 else _A
    if status == _V or status == 0 or mode == _N:
        return NO_FIX
    if status != _A or mode < 0:
        return FIELD
    first = fields[9]
    if fields[10] - 1 != first:
        if fields[10] - 1 - first != 6:
            return TIME
        year = digits(buffer, first + 4, 2)
        row[DAY] = day_number(
            century(year) if year >= 0 else -1, digits(buffer, first + 2, 2), digits(buffer, first, 2)
        )
        if math.isinf(row[DAY]):
            return TIME
    row[VARIATION] = signed(buffer, fields, 10, 180.0)
    if math.isinf(row[VARIATION]):
        return FIELD
    reason = _speed_and_course(buffer, fields, 7, KNOT, 8, row)
    return _position(buffer, fields, 3, row) if reason == READ else reason


@part_of_kernels
def _gll(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    if n >= 7:
        status = letter_of(buffer, fields, 6)
        mode = letter_of(buffer, fields, 7) if n > 7 else _A
        if status == _V or status == 0 or mode == _N:
            return NO_FIX
        if status != _A or mode < 0:
            return FIELD
    return _position(buffer, fields, 1, row)


@part_of_kernels
def _gns(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    fixed, least = False, math.inf
    hdop = within(buffer, fields, 8, 0.0, 1e4)
    for i in range(fields[6], fields[7] - 1):
        if not _A <= buffer[i] <= _Z:
            return FIELD
        fixed = fixed or buffer[i] != _N
        std = dilution.deviation(hdop, _quality(buffer[i]))
        least = min(least, std) if math.isfinite(std) else least
    if math.isfinite(least):
        row[STD] = least
    return _position(buffer, fields, 2, row) if fixed else NO_FIX


@part_of_kernels
def _quality(mode: int) -> int:
    """The GGA quality that corresponds to a mode indicator; 0 for an unknown one."""
    for quality, letter in enumerate(_MODES):
        if mode == letter:
            return quality
    return 0


@part_of_kernels
def _vtg(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    if n > 9 and letter_of(buffer, fields, 9) == _N:
        return NO_FIX
    for k, unit in ((2, _T), (4, _M), (6, _N), (8, _K)):
        if letter_of(buffer, fields, k) != 0 and letter_of(buffer, fields, k) != unit:
            return FIELD
    if fields[6] - 1 == fields[5]:
        return _speed_and_course(buffer, fields, 7, 1.0 / 3.6, 1, row)
    return _speed_and_course(buffer, fields, 5, KNOT, 1, row)


@part_of_kernels
def _zda(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    day = within(buffer, fields, 2, 1.0, 31.0)
    month = within(buffer, fields, 3, 1.0, 12.0)
    year = within(buffer, fields, 4, 0.0, 2199.0)
    if math.isinf(day) or math.isinf(month) or math.isinf(year):
        return TIME
    if day > 0.0 and month > 0.0 and year >= 0.0:
        row[DAY] = day_number(century(int(year)) if year < 100.0 else int(year), int(month), int(day))
    return TIME if math.isinf(row[DAY]) else READ


@part_of_kernels
def _heading(buffer: bytes, fields: NDArray[np.int64], kind: int, row: Floats) -> int:
    """Read HDT or THS (true), HDM or HDG (magnetic; deviation is applied, variation stored)."""
    angle = math.radians(within(buffer, fields, 1, 0.0, 360.0))
    if math.isinf(angle):
        return FIELD
    letter = letter_of(buffer, fields, 2)
    if kind == THS and (letter == _V or letter == 0):
        return NO_FIX
    if (kind == HDT and letter != _T) or (kind == HDM and letter != _M) or (kind == THS and letter < 0):
        return FIELD
    if kind == HDT or kind == THS:
        row[HEADING] = angle
        return READ
    row[MAGNETIC] = angle
    if kind == HDG:
        deviation, variation = signed(buffer, fields, 2, 180.0), signed(buffer, fields, 4, 180.0)
        if math.isinf(deviation) or math.isinf(variation):
            return FIELD
        if math.isfinite(deviation):
            row[MAGNETIC] = angle + deviation
        row[VARIATION] = variation
    return READ


@part_of_kernels
def _vhw(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    for k, unit in ((2, _T), (4, _M), (6, _N), (8, _K)):
        if letter_of(buffer, fields, k) != 0 and letter_of(buffer, fields, k) != unit:
            return FIELD
    angle = within(buffer, fields, 1, 0.0, 360.0)
    knots = within(buffer, fields, 5, -100.0, 100.0)
    kilometres = within(buffer, fields, 7, -200.0, 200.0)
    if math.isinf(angle) or math.isinf(knots) or math.isinf(kilometres):
        return FIELD
    row[HEADING] = math.radians(angle)
    row[WATER] = kilometres / 3.6 if math.isnan(knots) else knots * KNOT
    return READ


@part_of_kernels
def _rot(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    if letter_of(buffer, fields, 2) == _V:
        return NO_FIX
    rate = within(buffer, fields, 1, -5400.0, 5400.0)
    if math.isinf(rate) or letter_of(buffer, fields, 2) != _A:
        return FIELD
    row[YAW] = math.radians(rate) / 60.0
    return READ


@part_of_kernels
def _vbw(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    """Read the longitudinal speeds through the water and over ground, each with a status."""
    for speed, status, column in ((1, 3, WATER), (4, 6, BOTTOM)):
        knots = within(buffer, fields, speed, -100.0, 100.0)
        letter = letter_of(buffer, fields, status)
        if math.isinf(knots) or (letter != _A and letter != _V and letter != 0):
            return FIELD
        if letter == _A:
            row[column] = knots * KNOT
    return READ if math.isfinite(row[WATER]) or math.isfinite(row[BOTTOM]) else NO_FIX


@part_of_kernels
def _rpm(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    """Read the speed of a shaft or engine, negative astern."""
    source, status = letter_of(buffer, fields, 1), letter_of(buffer, fields, 5)
    turns = within(buffer, fields, 3, -1e5, 1e5)
    if (source != _S and source != _E) or math.isinf(turns) or (status != _A and status != _V):
        return FIELD
    if status == _V:
        return NO_FIX
    row[SHAFT] = turns / 60.0
    return READ


@part_of_kernels
def _gst(buffer: bytes, fields: NDArray[np.int64], n: int, row: Floats) -> int:
    north, east = within(buffer, fields, 6, 0.0, 1e6), within(buffer, fields, 7, 0.0, 1e6)
    if math.isinf(north) or math.isinf(east):
        return FIELD
    if north + east > 0.0:
        row[STD] = math.sqrt(0.5 * (north * north + east * east))
    return READ


@part_of_kernels
def _time_field(kind: int, n: int) -> int:
    """Index of the time field; 0 for a sentence without time."""
    if kind == GLL:
        return 5 if n >= 7 else 0
    return 1 if kind <= GNS or kind == ZDA or kind == GST else 0


@part_of_kernels
def _read_kind(buffer: bytes, fields: NDArray[np.int64], n: int, kind: int, row: Floats) -> int:
    """Read the fields of a sentence except its time; returns the reason for rejection or READ."""
    if kind == GGA:
        return _gga(buffer, fields, n, row)
    if kind == RMC:
        return _rmc(buffer, fields, n, row)
    if kind == GLL:
        return _gll(buffer, fields, n, row)
    if kind == GNS:
        return _gns(buffer, fields, n, row)
    if kind == VTG:
        return _vtg(buffer, fields, n, row)
    if kind == ZDA:
        return _zda(buffer, fields, n, row)
    if kind == VHW:
        return _vhw(buffer, fields, n, row)
    if kind == ROT:
        return _rot(buffer, fields, n, row)
    if kind == GST:
        return _gst(buffer, fields, n, row)
    if kind == VBW:
        return _vbw(buffer, fields, n, row)
    if kind == RPM:
        return _rpm(buffer, fields, n, row)
    return _heading(buffer, fields, kind, row)


@part_of_kernels
def read_fields(buffer: bytes, fields: NDArray[np.int64], n: int, kind: int, row: Floats) -> int:
    """Read one sentence into its row; returns the reason for rejection or READ. Without a fix only the time is kept."""
    if not _COUNTS[kind] >> n & 1:
        return COUNT
    k = _time_field(kind, n)
    if k > 0:
        row[TOD] = time_of_day(buffer, fields[k], fields[k + 1] - 1)
        if math.isinf(row[TOD]):
            return TIME
    reason = _read_kind(buffer, fields, n, kind, row)
    if reason == NO_FIX:
        time = row[TOD]
        row[:] = math.nan
        row[TOD] = time
    return reason
