"""Epochs out of sentences: the clock that gives each sentence its time, and the rows that join those of one time.

One clock serves the whole log, whichever talker set it. Only RMC and ZDA have a date. Other sentences get the day that
brings their time of day nearest to the clock, or to the receive time; so the date also changes at midnight.
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
from steerway.formats.nmea0183.fields import GST, HDT, LAST_POSITION, RMC, THS, VALUES
from steerway.formats.nmea0183.scan import TALKERS

# Columns of a row. UNDATED is 1 while no date was known, GIVEN 1 once its position has been handed out.
COLUMNS = 16
TIME, LAT, LON, STD, SOG, COG, HEADING, WATER, YAW, BOTTOM, SHAFT, MAGNETIC, QUANTUM, RECEIVED, UNDATED, GIVEN = range(
    COLUMNS
)

# The state of the assembler between calls. NOW and CAME: when these and the last epoch came over a link, s. DATED: the
# time of the last sentence with a date. LATITUDE, LONGITUDE: the position then. AHEAD: s by which
# LOCAL sentences without a date were ahead of UTC.
MEMORY = 16
CLOCK, EPOCH, IS_UNDATED, SHIFT, LAST_VARIATION, FIRST_VARIATION, ROLLOVERS, OWN_VARIATION, RMC_VARIATION, NOW, CAME = (
    range(MEMORY - 5)
)
DATED, LATITUDE, LONGITUDE, AHEAD, LOCAL = range(MEMORY - 5, MEMORY)

REPEATED, UNTIMED = 0, 1
LOST = ("repeated within an epoch, without a time of its own", "before any time was known")

DAY = 86400.0
ROLLOVER = 1024.0 * 7.0 * DAY
LATEST = 3
OPEN = 4  # rows of a talker that still take in sentences: the newest ones

_SAME_TIME = 1e-3
_QUARTER = 900.0  # s; time zones are whole quarters of an hour from UTC
_ONE_EPOCH = 2.0  # s within which a device sends a sentence with a date and those without
_ONE_PLACE = 5e-5  # rad (300 m) by which their positions differ at most
_BURST = 0.5  # s within which one device sends the sentences of one epoch
_FRESH = 5.0  # s for which an epoch is the current one
NEAR = 30.0 * DAY
_LATENCY = 0.1
"""s by which what a link reports beside its fixes is taken to be older than they are when they come: an instrument's
own delay, and more than fixes vary by, so that none seems to come late."""

_VALUE_OF = np.array(
    [field.STD, field.SOG, field.COG, field.HEADING, field.WATER, field.YAW, field.BOTTOM, field.SHAFT]
)
_COLUMN_OF = np.array([STD, SOG, COG, HEADING, WATER, YAW, BOTTOM, SHAFT])


_wrap = part_of_kernels(without_compiling(wrap))


class Assembly(NamedTuple):
    """The arrays that the assembler fills, and those that it keeps from call to call.

    memory (MEMORY,); latest (TALKERS, LATEST) the last time of each talker, when that was received and whether it sends
    GST; newest (TALKERS, OPEN) the indices of its newest rows, newest first, −1 for none; rows (most, COLUMNS), with
    seen (a bit a kind) and owners (talker) beside; lost counts by LOST.
    """

    memory: np.ndarray
    latest: np.ndarray
    newest: np.ndarray
    rows: np.ndarray
    seen: np.ndarray
    owners: np.ndarray
    lost: np.ndarray


def new_assembly() -> Assembly:
    """An assembler without a row."""
    memory = np.full(MEMORY, np.nan)
    memory[[IS_UNDATED, SHIFT, ROLLOVERS, OWN_VARIATION, RMC_VARIATION, AHEAD, LOCAL]] = 0.0
    latest, newest = np.full((TALKERS, LATEST), np.nan), np.full((TALKERS, OPEN), -1, np.int64)
    none = np.empty(0, np.int64)
    return Assembly(memory, latest, newest, np.empty((0, COLUMNS)), none, none, np.zeros(len(LOST), np.int64))


@part_of_kernels
def _dated_time(value: Floats, memory: Floats, reference: float) -> float:
    """The time of a sentence with a date: moved by whole 1024-week rollovers when it is that much too early."""
    time = DAY * value[field.DAY] + value[field.TOD]
    weeks = round((reference - time) / ROLLOVER) if math.isfinite(reference) else 0.0
    if weeks >= 1.0 and abs(reference - time - weeks * ROLLOVER) < NEAR:
        time += weeks * ROLLOVER
        memory[ROLLOVERS] += 1.0
    return time


@part_of_kernels
def _nearest_day(time_of_day: float, reference: float) -> float:
    """The Unix time of this time of day that is nearest to a reference."""
    return time_of_day + DAY * round((reference - time_of_day) / DAY)


@part_of_kernels
def _ahead(latitude: float, longitude: float, time: float, utc: float, memory: Floats) -> float:
    """By how many s a time without a date is local time: whole quarters of an hour from `utc`, at the same place."""
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
    """Unix time of a sentence that has a time of day; sets the clock. One with a date decides between UTC and local."""
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
    """Whether a sentence belongs to a row: same time, no sentence of its kind yet, no other position."""
    if abs(row[TIME] - time) > _SAME_TIME or seen & (1 << kind):
        return False
    if math.isnan(value[field.LAT]) or math.isnan(row[LAT]):
        return True
    tolerance = 1.01 * max(row[QUANTUM], value[field.QUANTUM])
    return abs(row[LAT] - value[field.LAT]) <= tolerance and abs(_wrap(row[LON] - value[field.LON])) <= tolerance


@part_of_kernels
def _open_row(a: Assembly, n: int, talker: int, time: float, received: float, undated: float) -> int:
    """A new row of a talker, which becomes its newest; its index."""
    row, newest = a.rows[n], a.newest[talker]
    row[:] = math.nan
    row[TIME], row[RECEIVED], row[UNDATED] = time, received, undated
    for k in range(OPEN - 1, 0, -1):
        newest[k] = newest[k - 1]
    newest[0] = n
    return n


@part_of_kernels
def _put(row: Floats, value: Floats, overrule: bool) -> None:
    """Write a sentence into its row. The position of finer resolution stays, other values are kept unless overruled."""
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
    """A magnetic heading becomes true by its own variation, else by the last one RMC gave; else it stays magnetic."""
    variation, source = value[field.VARIATION], OWN_VARIATION
    if math.isnan(variation):
        variation, source = memory[LAST_VARIATION], RMC_VARIATION
    if math.isfinite(variation):
        value[field.HEADING] = _wrap(value[field.MAGNETIC] + variation)
        value[field.MAGNETIC] = math.nan
        memory[source] += 1.0


@part_of_kernels
def _says_nothing(value: Floats) -> bool:
    for k in range(VALUES):
        if (
            k != field.TOD
            and k != field.DAY
            and k != field.RECEIVED
            and k != field.VARIATION
            and math.isfinite(value[k])
        ):
            return False
    return True


@part_of_kernels
def _row_of_timed(a: Assembly, n: int, talker: int, value: Floats, kind: int, time: float) -> int:
    """The open row of a timed sentence, or a new one."""
    for k in range(OPEN):
        at = a.newest[talker, k]
        if at >= 0 and _meets(a.rows[at], value, kind, a.seen[at], time):
            return at
    return _open_row(a, n, talker, time, value[field.RECEIVED], a.memory[IS_UNDATED])


@part_of_kernels
def _row_of_received(a: Assembly, n: int, talker: int, value: Floats, kind: int) -> int:
    """The row of a sentence with a receive time only: its own talker's in the same burst, else one of that time."""
    received, at, latest = value[field.RECEIVED], a.newest[talker, 0], a.latest[talker]
    if at >= 0 and abs(received - a.rows[at, RECEIVED]) < _BURST:
        if _meets(a.rows[at], value, kind, a.seen[at], a.rows[at, TIME]):
            return at
    time = latest[0] if 0.0 <= received - latest[1] < _BURST and math.isfinite(value[field.LAT]) else received
    return _open_row(a, n, talker, time, received, 0.0)


@part_of_kernels
def _row_of_untimed(a: Assembly, n: int, talker: int, value: Floats, kind: int) -> int:
    """The row of a sentence without any time: of its talker's epoch, else the log's; −1 − the reason if lost.

    Over a live link one that comes again within an epoch, or long after it, has a row of the time that has passed.
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
    """At the first date: shift the times counted from 1970 until now, and make UTC of those in local time."""
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
    """Sentences into rows; the number of rows then, of `n` before.

    Parameters: `kinds`, `talkers`, `values` as `scan` fills them; `a` has room for a row a sentence.
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
        if _says_nothing(value):
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
