"""Assemble sentences into epochs: a clock gives each sentence its time, and sentences of one time share a row.

All talkers set one clock for the whole log. Only RMC and ZDA have a date. Other sentences get the day on which their
time of day is nearest to the clock, or to the receive time; so the date also changes at midnight.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.interpreted import part_of_kernels, without_compiling
from steerway.formats.nmea0183 import fields as field
from steerway.formats.nmea0183.fields import GST, HDT, LAST_POSITION, RMC, THS
from steerway.formats.nmea0183.scan import TALKERS

# Columns of a row. UNDATED is 1 if no date was known, GIVEN 1 once its position has been output.
COLUMNS = 16
TIME, LAT, LON, STD, SOG, COG, HEADING, WATER, YAW, BOTTOM, SHAFT, MAGNETIC, QUANTUM, RECEIVED, UNDATED, GIVEN = range(
    COLUMNS
)

# The state of the assembler between calls. NOW: arrival time of the current bytes on a link, s. CAME: arrival time of
# the last epoch. DATED: time of the last sentence with a date; LATITUDE, LONGITUDE: the position at that time. AHEAD: s
# by which sentences without a date were ahead of UTC; LOCAL: their number.
MEMORY = 16
CLOCK, EPOCH, IS_UNDATED, SHIFT, LAST_VARIATION, FIRST_VARIATION, ROLLOVERS, OWN_VARIATION, RMC_VARIATION, NOW, CAME = (
    range(MEMORY - 5)
)
DATED, LATITUDE, LONGITUDE, AHEAD, LOCAL = range(MEMORY - 5, MEMORY)

REPEATED, UNTIMED = 0, 1
LOST = ("without a time field and repeated within an epoch", "before the first time in the log")

DAY = 86400.0
ROLLOVER = 1024.0 * 7.0 * DAY
LATEST = 3
OPEN = 4  # newest rows of a talker, to which sentences can still be added

_SAME_TIME = 1e-3
_QUARTER = 900.0  # s; time zones differ from UTC by whole quarters of an hour
_ONE_EPOCH = 2.0  # s, longest time between a sentence with a date and one in local time that are compared
_ONE_PLACE = 5e-5  # rad (300 m), largest difference of their positions
_BURST = 0.5  # s within which one device sends the sentences of one epoch
_FRESH = 5.0  # s for which an epoch stays current
NEAR = 30.0 * DAY
_LATENCY = 0.1
"""Assumed delay of a sentence without a time on a link, s: the sentence is dated this long before its arrival. This
covers an instrument's own delay, and exceeds the variation in the delay of fixes, so that the next fix does not appear
to be late."""

_VALUE_OF = np.array(
    [field.STD, field.SOG, field.COG, field.HEADING, field.WATER, field.YAW, field.BOTTOM, field.SHAFT]
)
_COLUMN_OF = np.array([STD, SOG, COG, HEADING, WATER, YAW, BOTTOM, SHAFT])


_wrap = part_of_kernels(without_compiling(wrap))


class Assembly(NamedTuple):
    """The arrays that the assembler fills, and those that it keeps from call to call.

    memory (MEMORY,). latest (TALKERS, LATEST): last time of each talker, its receive time, and 1 if it sends GST.
    newest (TALKERS, OPEN): indices of a talker's newest rows, newest first, −1 for none. rows (most, COLUMNS), with
    seen (most,), a bit per kind of sentence, and owners (most,), the talkers. lost: counts by LOST.
    """

    memory: np.ndarray
    latest: np.ndarray
    newest: np.ndarray
    rows: np.ndarray
    seen: np.ndarray
    owners: np.ndarray
    lost: np.ndarray


def new_assembly() -> Assembly:
    """An assembler without rows."""
    memory = np.full(MEMORY, np.nan)
    memory[[IS_UNDATED, SHIFT, ROLLOVERS, OWN_VARIATION, RMC_VARIATION, AHEAD, LOCAL]] = 0.0
    latest, newest = np.full((TALKERS, LATEST), np.nan), np.full((TALKERS, OPEN), -1, np.int64)
    none = np.empty(0, np.int64)
    return Assembly(memory, latest, newest, np.empty((0, COLUMNS)), none, none, np.zeros(len(LOST), np.int64))


@part_of_kernels
def _dated_time(value: Floats, memory: Floats, reference: float) -> float:
    """The time of a sentence with a date; GPS week rollovers (1024 weeks) before the reference time are corrected."""
    time = DAY * value[field.DAY] + value[field.TOD]
    weeks = round((reference - time) / ROLLOVER) if math.isfinite(reference) else 0.0
    if weeks >= 1.0 and abs(reference - time - weeks * ROLLOVER) < NEAR:
        time += weeks * ROLLOVER
        memory[ROLLOVERS] += 1.0
    return time


@part_of_kernels
def _nearest_day(time_of_day: float, reference: float) -> float:
    """The Unix time with this time of day that is nearest to a reference time."""
    return time_of_day + DAY * round((reference - time_of_day) / DAY)


@part_of_kernels
def _ahead(latitude: float, longitude: float, time: float, utc: float, memory: Floats) -> float:
    """How far a time without a date is ahead of UTC, s: whole quarters of an hour if it is local time, else 0.

    A sentence is in local time only if its position is that of the last dated one. Without a position, the offset must
    be known from other sentences.
    """
    if math.isnan(time) or math.isnan(utc):
        return 0.0
    ahead = _QUARTER * round((time - utc) / _QUARTER)
    if ahead == 0.0 or not abs(time - utc - ahead) < _ONE_EPOCH:
        return 0.0
    if math.isnan(latitude) and ahead != memory[AHEAD]:
        return 0.0
    if abs(latitude - memory[LATITUDE]) > _ONE_PLACE or abs(_wrap(longitude - memory[LONGITUDE])) > _ONE_PLACE:
        return 0.0
    memory[AHEAD] = ahead
    memory[LOCAL] += 1.0
    return ahead


@part_of_kernels
def _is_same_place(value: Floats, memory: Floats) -> bool:
    tolerance = 1.01 * value[field.QUANTUM]
    north, east = value[field.LAT] - memory[LATITUDE], value[field.LON] - memory[LONGITUDE]
    return abs(north) <= tolerance and abs(_wrap(east)) <= tolerance


@part_of_kernels
def _timed(value: Floats, memory: Floats) -> float:
    """Unix time of a sentence with a time of day; sets the clock. Dated sentences reveal local time in the others."""
    received, clock, time_of_day = value[field.RECEIVED], memory[CLOCK], value[field.TOD]
    undated, dated = memory[IS_UNDATED] == 1.0, math.isfinite(value[field.DAY])
    by_clock = _nearest_day(time_of_day, clock) if math.isfinite(clock) else time_of_day
    if dated:
        time = _dated_time(value, memory, clock if math.isnan(received) and not undated else received)
        memory[DATED] = time
    elif math.isfinite(received):
        time = _nearest_day(time_of_day, received)
    else:
        time = by_clock
        if math.isnan(clock):
            memory[IS_UNDATED] = 1.0
    if undated and (dated or math.isfinite(received)):
        memory[SHIFT] = time - by_clock
        memory[IS_UNDATED] = 0.0
    if not dated:
        ahead = _ahead(value[field.LAT], value[field.LON], time, memory[DATED], memory)
        time -= ahead
        if ahead != 0.0 and abs(time - memory[DATED]) < _BURST and _is_same_place(value, memory):
            time = memory[DATED]
    if math.isfinite(value[field.LAT]) and abs(time - memory[DATED]) < _ONE_EPOCH:
        memory[LATITUDE], memory[LONGITUDE] = value[field.LAT], value[field.LON]
    memory[CLOCK] = time
    return time


@part_of_kernels
def _meets(row: Floats, value: Floats, kind: int, seen: int, time: float) -> bool:
    """Whether a sentence belongs to a row: same time, no sentence of its kind yet, no different position."""
    if abs(row[TIME] - time) > _SAME_TIME or seen & (1 << kind):
        return False
    if math.isnan(value[field.LAT]) or math.isnan(row[LAT]):
        return True
    tolerance = 1.01 * max(row[QUANTUM], value[field.QUANTUM])
    return abs(row[LAT] - value[field.LAT]) <= tolerance and abs(_wrap(row[LON] - value[field.LON])) <= tolerance


@part_of_kernels
def _open_row(a: Assembly, n: int, talker: int, time: float, received: float, undated: float) -> int:
    """Add a row as the newest of a talker; returns its index."""
    row, newest = a.rows[n], a.newest[talker]
    row[:] = math.nan
    row[TIME], row[RECEIVED], row[UNDATED] = time, received, undated
    for k in range(OPEN - 1, 0, -1):
        newest[k] = newest[k - 1]
    newest[0] = n
    return n


@part_of_kernels
def _put(row: Floats, value: Floats, overrule: bool) -> None:
    """Write a sentence into its row. The position of finer resolution stays; other values stay unless `overrule`."""
    if math.isfinite(value[field.LAT]) and not row[QUANTUM] <= value[field.QUANTUM]:
        row[LAT], row[LON], row[QUANTUM] = value[field.LAT], value[field.LON], value[field.QUANTUM]
    for k in range(len(_VALUE_OF)):
        new = value[_VALUE_OF[k]]
        if math.isfinite(new) and (overrule or math.isnan(row[_COLUMN_OF[k]])):
            row[_COLUMN_OF[k]] = new
    if math.isfinite(value[field.MAGNETIC]) and math.isnan(row[HEADING]):
        row[MAGNETIC] = value[field.MAGNETIC]


@part_of_kernels
def _make_true(value: Floats, memory: Floats) -> None:
    """Make a magnetic heading true by the variation in its sentence, else in the last RMC; else it stays magnetic."""
    variation, source = value[field.VARIATION], OWN_VARIATION
    if math.isnan(variation):
        variation, source = memory[LAST_VARIATION], RMC_VARIATION
    if math.isfinite(variation):
        value[field.HEADING] = _wrap(value[field.MAGNETIC] + variation)
        value[field.MAGNETIC] = math.nan
        memory[source] += 1.0


@part_of_kernels
def _is_empty(value: Floats) -> bool:
    """Whether a sentence has no values besides time and variation."""
    for k in range(field.LAT, field.RECEIVED):
        if k != field.VARIATION and math.isfinite(value[k]):
            return False
    return True


@part_of_kernels
def _row_of_timed(a: Assembly, n: int, talker: int, value: Floats, kind: int, time: float) -> int:
    """Index of the row for a sentence with a time: an open row, else a new one."""
    for k in range(OPEN):
        at = a.newest[talker, k]
        if at >= 0 and _meets(a.rows[at], value, kind, a.seen[at], time):
            return at
    return _open_row(a, n, talker, time, value[field.RECEIVED], a.memory[IS_UNDATED])


@part_of_kernels
def _row_of_received(a: Assembly, n: int, talker: int, value: Floats, kind: int) -> int:
    """Index of the row for a sentence with only a receive time: the talker's row in the same burst, else a new one."""
    received, at, latest = value[field.RECEIVED], a.newest[talker, 0], a.latest[talker]
    if at >= 0 and abs(received - a.rows[at, RECEIVED]) < _BURST:
        if _meets(a.rows[at], value, kind, a.seen[at], a.rows[at, TIME]):
            return at
    time = latest[0] if 0.0 <= received - latest[1] < _BURST and math.isfinite(value[field.LAT]) else received
    return _open_row(a, n, talker, time, received, 0.0)


@part_of_kernels
def _row_of_untimed(a: Assembly, n: int, talker: int, value: Floats, kind: int) -> int:
    """Index of the row for a sentence without a time: in its talker's epoch, else the log's epoch; −1 − reason if lost.

    On a live link, a sentence repeated within an epoch or long after it gets a new row, dated by the elapsed time.
    """
    memory = a.memory
    passed = memory[NOW] - memory[CAME]
    since = memory[EPOCH] + max(passed - _LATENCY, 0.0)
    if passed >= _BURST and math.isnan(value[field.LAT]):
        return _open_row(a, n, talker, since, math.nan, memory[IS_UNDATED])
    time = memory[CLOCK]
    if time - a.latest[talker, 0] < _FRESH:
        time = a.latest[talker, 0]
    elif time - memory[EPOCH] < _FRESH:
        time = memory[EPOCH]
    if math.isnan(time):
        return -1 - UNTIMED
    for k in range(OPEN):
        at = a.newest[talker, k]
        if at >= 0 and _meets(a.rows[at], value, kind, a.seen[at], time):
            return at
        if at >= 0 and abs(a.rows[at, TIME] - time) <= _SAME_TIME and math.isnan(value[field.LAT]):
            if passed > _LATENCY:
                return _open_row(a, n, talker, since, math.nan, memory[IS_UNDATED])
            return -1 - REPEATED
    return _open_row(a, n, talker, time, math.nan, memory[IS_UNDATED])


@part_of_kernels
def _date_all(a: Assembly, n: int) -> None:
    """At the first date: shift the times that were counted from 1970, and convert local times to UTC."""
    memory = a.memory
    for k in range(n):
        row = a.rows[k]
        if row[UNDATED] == 1.0:
            row[TIME] += memory[SHIFT]
            row[TIME] -= _ahead(row[LAT], row[LON], row[TIME], memory[DATED], memory)
            row[UNDATED] = 0.0
    memory[EPOCH] += memory[SHIFT]
    for talker in range(TALKERS):
        a.latest[talker, 0] += memory[SHIFT]


@kernel
def assemble(kinds: NDArray[np.int64], talkers: NDArray[np.int64], values: Floats, a: Assembly, n: int) -> int:
    """Assemble sentences into rows; returns the number of rows, which was `n` before.

    Parameters: `kinds`, `talkers`, `values` as `scan` fills them; `a` must have room for one more row per sentence.
    """
    memory = a.memory
    for i in range(len(kinds)):
        kind, talker, value = kinds[i], talkers[i], values[i]
        latest = a.latest[talker]
        is_timed = math.isfinite(value[field.TOD])
        if is_timed:
            was_undated = memory[IS_UNDATED] == 1.0
            time = _timed(value, memory)
            if was_undated and memory[IS_UNDATED] == 0.0:
                _date_all(a, n)
            if kind <= LAST_POSITION:
                if time != memory[EPOCH]:
                    memory[CAME] = memory[NOW]
                memory[EPOCH] = time
            if kind <= LAST_POSITION or not abs(time - latest[0]) < _FRESH:
                latest[0], latest[1] = time, value[field.RECEIVED]
        if kind == RMC and math.isfinite(value[field.VARIATION]):
            memory[LAST_VARIATION] = value[field.VARIATION]
            if math.isnan(memory[FIRST_VARIATION]):
                memory[FIRST_VARIATION] = value[field.VARIATION]
        if math.isfinite(value[field.MAGNETIC]):
            _make_true(value, memory)
        if kind == GST:
            latest[2] = 1.0
        elif latest[2] == 1.0:
            value[field.STD] = math.nan
        if _is_empty(value):
            continue
        if is_timed:
            at = _row_of_timed(a, n, talker, value, kind, time)
        elif math.isfinite(value[field.RECEIVED]):
            at = _row_of_received(a, n, talker, value, kind)
        else:
            at = _row_of_untimed(a, n, talker, value, kind)
        if at < 0:
            a.lost[-1 - at] += 1
            continue
        if at == n:
            a.seen[n], a.owners[n] = 0, talker
            n += 1
        a.seen[at] |= 1 << kind
        _put(a.rows[at], value, is_timed or kind == HDT or kind == THS)
    return n
