"""What the estimates of a ship tell: trips and stops, turns, gaps, jumps, and where transmitted SOG and COG are wrong.

One pass over the rows of every track, with a carry of some numbers from one day to the next, so that it does not matter
where a record is cut.
"""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.archive.tracks import ANOTHER, JUMP, MOVED
from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.records import OK, REJECTED

EVENTS = ("jump", "moved", "another ship", "gap", "dark period", "turn", "speed", "course")
"""Kinds of events. `value` is: m from where the ship was to be, for jumps; m between its ends, for gaps; degrees to
starboard, for turns; the largest difference of the transmitted from the derived, m/s or degrees, for the last two."""
_JUMP, _MOVED, _ANOTHER, _GAP, _DARK, _TURN, _SPEED, _COURSE = range(8)
MODES = ("unknown", "stop", "trip")
_UNKNOWN, _STOP, _TRIP = range(3)

GAP = 1800.0
"""s without a report that are a gap, as for the filter; of a vessel under way, or that is elsewhere afterwards, a dark
period."""
STOP_RADIUS, STOP_TIME = 250.0, 900.0
"""A vessel that stays within so many metres for so many seconds has stopped."""
_DARK_SPEED, _DARK_DISTANCE = 1.0, 2000.0
_TURN_RATE, _TURN_LEAST = math.radians(0.1), math.radians(45.0)
_EXCURSION, _EXCURSION_TIME, _BACK = 500.0, 7200.0, 0.3
"""m there and back, within so many seconds, that are a jump; at most the last part of it separates both ends."""
_LIMIT = 4.0
"""Standard deviations of both beyond which a transmitted value differs from the derived, and how many reports one
behind the other make an event."""
_RUN = 5
_SOG_STD, _SOG_MARGIN = 0.2, 0.5
_COG_STD, _COG_MARGIN, _COG_LEAST_SPEED = math.radians(3.0), math.radians(5.0), 2.0

(
    _TIME,
    _LATITUDE,
    _LONGITUDE,
    _SOG,
    _COG,
    _ROWS,
    _MODE,  # of MODES
    _BEGAN,  # of the mode: time and place
    _BEGAN_LATITUDE,
    _BEGAN_LONGITUDE,
    _DISTANCE,  # sailed since
    _FASTEST,
    _ANCHOR_TIME,  # where the vessel may have stopped
    _ANCHOR_LATITUDE,
    _ANCHOR_LONGITUDE,
    _ANCHOR_DISTANCE,
    _TURN_BEGAN,
    _TURNED,
    _FAST_BEGAN,  # of two runs of wrong values: time, rows, largest difference
    _FAST_ROWS,
    _FAST_MOST,
    _AWAY_BEGAN,
    _AWAY_ROWS,
    _AWAY_MOST,
    _LAST_TIME,  # of the report before this one and of the one before that: time, place, transmitted SOG
    _LAST_LATITUDE,
    _LAST_LONGITUDE,
    _LAST_SOG,
    _FORMER_TIME,
    _FORMER_LATITUDE,
    _FORMER_LONGITUDE,
    _REPORTS,  # how many there are of them
) = range(32)
CARRIED = 32
EVENT_COLUMNS, TRIP_COLUMNS = 8, 11


@kernel
def history(
    bounds: NDArray[np.int64],
    order: NDArray[np.int64],
    rows: tuple[np.ndarray, ...],
    carry: Floats,
    events: Floats,
    trips: Floats,
) -> tuple[int, int]:
    """Run over tracks that stand behind one another in an order of rows. Returns how many events and trips there are.

    Args:
        bounds: (tracks + 1,) where in `order` (n,) each begins.
        rows: (time, latitude, longitude, estimate, status, event, reported), as of `association.associate`; reported
            (n, 4): latitude, longitude, SOG, COG, SI, NaN where unknown.
        carry: (tracks, CARRIED), zero before the first row; updated.
        events: (any, EVENT_COLUMNS) receives track, kind, start, end, latitude, longitude, value, rows.
        trips: (any, TRIP_COLUMNS) receives track, mode, start, end, their places, distance, greatest speed, 0.
    """
    time, estimate, status, event, reported = rows
    e = t = 0
    for i in range(len(bounds) - 1):
        c = carry[i]
        for j in range(bounds[i], bounds[i + 1]):
            k = order[j]
            if event[k] == JUMP or event[k] == ANOTHER or event[k] == MOVED:
                kind = _JUMP if event[k] == JUMP else (_MOVED if event[k] == MOVED else _ANOTHER)
                value = 0.0
                if event[k] == JUMP and math.isfinite(estimate[k, 0]):
                    value = _apart(reported[k, 0], reported[k, 1], estimate[k, 0], estimate[k, 1])
                elif c[_ROWS] > 0.0:
                    value = _apart(reported[k, 0], reported[k, 1], c[_LATITUDE], c[_LONGITUDE])
                e = _emit(events, e, i, kind, time[k], time[k], reported[k, 0], reported[k, 1], value, 1.0)
            elif math.isfinite(reported[k, 0]):
                e = _excursion(events, e, i, c, time[k], reported[k])
            if status[k] == REJECTED or not math.isfinite(reported[k, 0]):
                continue
            latitude, longitude, sog = estimate[k, 0], estimate[k, 1], estimate[k, 2]
            if c[_ROWS] > 0.0:
                step = _apart(latitude, longitude, c[_LATITUDE], c[_LONGITUDE])
                elapsed = time[k] - c[_TIME]
                if elapsed > GAP:
                    dark = c[_SOG] > _DARK_SPEED or step > _DARK_DISTANCE
                    kind = _DARK if dark else _GAP
                    e = _emit(events, e, i, kind, c[_TIME], time[k], c[_LATITUDE], c[_LONGITUDE], step, 0.0)
                if event[k] != MOVED:
                    c[_DISTANCE] += step
                e = _turning(events, e, i, c, time[k], estimate[k], status[k], elapsed)
                t = _sailing(trips, t, i, c, time[k], latitude, longitude)
            else:
                _drop_anchor(c, time[k], latitude, longitude)
                _begin(c, _UNKNOWN, time[k], latitude, longitude, 0.0)
            if math.isfinite(sog):
                c[_FASTEST] = max(c[_FASTEST], sog)
            e = _wrong_speed(events, e, i, c, time[k], estimate[k], reported[k, 2])
            e = _wrong_course(events, e, i, c, time[k], estimate[k], status[k], reported[k, 3])
            c[_TIME], c[_LATITUDE], c[_LONGITUDE] = time[k], latitude, longitude
            c[_SOG] = sog if math.isfinite(sog) else 0.0
            c[_COG] = estimate[k, 3]
            c[_ROWS] += 1.0
    return e, t


@called_kernel
def _excursion(events: Floats, e: int, track: int, c: Floats, time: float, reported: Floats) -> int:
    """A jump within the reach of a ship shows when the next report is back: none sails there and back so fast."""
    if c[_REPORTS] >= 2.0 and time - c[_FORMER_TIME] <= _EXCURSION_TIME:
        there = _apart(c[_LAST_LATITUDE], c[_LAST_LONGITUDE], c[_FORMER_LATITUDE], c[_FORMER_LONGITUDE])
        back = _apart(reported[0], reported[1], c[_LAST_LATITUDE], c[_LAST_LONGITUDE])
        least = min(there, back)
        if least > _EXCURSION:
            between = _apart(reported[0], reported[1], c[_FORMER_LATITUDE], c[_FORMER_LONGITUDE])
            speed = min(there / max(c[_LAST_TIME] - c[_FORMER_TIME], 1.0), back / max(time - c[_LAST_TIME], 1.0))
            known = 2.0 * c[_LAST_SOG] + 0.5 if math.isfinite(c[_LAST_SOG]) else 5.0
            if between < _BACK * least and speed > known:
                began, place = c[_LAST_TIME], (c[_LAST_LATITUDE], c[_LAST_LONGITUDE])
                e = _emit(events, e, track, _JUMP, began, began, place[0], place[1], least, 1.0)
    c[_FORMER_TIME], c[_FORMER_LATITUDE], c[_FORMER_LONGITUDE] = c[_LAST_TIME], c[_LAST_LATITUDE], c[_LAST_LONGITUDE]
    c[_LAST_TIME], c[_LAST_LATITUDE], c[_LAST_LONGITUDE], c[_LAST_SOG] = time, reported[0], reported[1], reported[2]
    c[_REPORTS] += 1.0
    return e


@kernel
def unfinished(carry: Floats, trips: Floats) -> int:
    """Fill `trips` with the trip or stop that every track is at; returns how many."""
    t = 0
    for i in range(len(carry)):
        c = carry[i]
        t = _end(trips, t, i, c, c[_TIME], c[_LATITUDE], c[_LONGITUDE], c[_DISTANCE])
    return t


@lean_kernel
def _apart(latitude: float, longitude: float, latitude_0: float, longitude_0: float) -> float:
    north, east = displacement(latitude, longitude, latitude_0, longitude_0)
    return math.hypot(north, east)


@lean_kernel
def _emit(
    events: Floats,
    e: int,
    track: int,
    kind: int,
    start: float,
    end: float,
    latitude: float,
    longitude: float,
    value: float,
    rows: float,
) -> int:
    if e < len(events):
        row = events[e]
        row[0], row[1], row[2], row[3] = track, kind, start, end
        row[4], row[5], row[6], row[7] = latitude, longitude, value, rows
    return e + 1


@lean_kernel
def _begin(c: Floats, mode: int, time: float, latitude: float, longitude: float, distance: float) -> None:
    c[_MODE], c[_BEGAN], c[_BEGAN_LATITUDE], c[_BEGAN_LONGITUDE] = mode, time, latitude, longitude
    c[_DISTANCE], c[_FASTEST] = distance, 0.0


@lean_kernel
def _drop_anchor(c: Floats, time: float, latitude: float, longitude: float) -> None:
    c[_ANCHOR_TIME], c[_ANCHOR_LATITUDE], c[_ANCHOR_LONGITUDE] = time, latitude, longitude
    c[_ANCHOR_DISTANCE] = c[_DISTANCE]


@lean_kernel
def _end(
    trips: Floats, t: int, track: int, c: Floats, time: float, latitude: float, longitude: float, distance: float
) -> int:
    if c[_MODE] != _UNKNOWN or time > c[_BEGAN]:
        if t < len(trips):
            row = trips[t]
            row[0], row[1], row[2], row[3] = track, c[_MODE], c[_BEGAN], time
            row[4], row[5], row[6], row[7] = c[_BEGAN_LATITUDE], c[_BEGAN_LONGITUDE], latitude, longitude
            row[8], row[9] = distance, c[_FASTEST]
        t += 1
    return t


@called_kernel
def _sailing(trips: Floats, t: int, track: int, c: Floats, time: float, latitude: float, longitude: float) -> int:
    """Stops and the trips between them: a stop begins where the vessel came to its place, and ends where it left."""
    inside = _apart(latitude, longitude, c[_ANCHOR_LATITUDE], c[_ANCHOR_LONGITUDE]) <= STOP_RADIUS
    if c[_MODE] == _STOP:
        if not inside:
            t = _end(trips, t, track, c, c[_TIME], c[_LATITUDE], c[_LONGITUDE], 0.0)
            step = _apart(latitude, longitude, c[_LATITUDE], c[_LONGITUDE])
            _begin(c, _TRIP, c[_TIME], c[_LATITUDE], c[_LONGITUDE], step)
            _drop_anchor(c, time, latitude, longitude)
        return t
    if not inside:
        if c[_MODE] == _UNKNOWN:
            c[_MODE] = _TRIP
        _drop_anchor(c, time, latitude, longitude)
    elif time - c[_ANCHOR_TIME] >= STOP_TIME:
        place = c[_ANCHOR_LATITUDE], c[_ANCHOR_LONGITUDE]
        if c[_MODE] == _TRIP:
            t = _end(trips, t, track, c, c[_ANCHOR_TIME], place[0], place[1], c[_ANCHOR_DISTANCE])
        _begin(c, _STOP, c[_ANCHOR_TIME], place[0], place[1], 0.0)
    return t


@called_kernel
def _turning(
    events: Floats, e: int, track: int, c: Floats, time: float, estimate: Floats, status: int, elapsed: float
) -> int:
    """A turn is a run of rows with a course rate of one sign."""
    rate = estimate[4] if status == OK and math.isfinite(c[_COG]) and elapsed <= GAP else 0.0
    turns = abs(rate) > _TURN_RATE
    if c[_TURNED] != 0.0 and not (turns and rate * c[_TURNED] > 0.0):
        if abs(c[_TURNED]) >= _TURN_LEAST:
            value = math.degrees(c[_TURNED])
            e = _emit(events, e, track, _TURN, c[_TURN_BEGAN], c[_TIME], c[_LATITUDE], c[_LONGITUDE], value, 0.0)
        c[_TURNED] = 0.0
    if turns:
        change = wrap(estimate[3] - c[_COG])
        if c[_TURNED] == 0.0:
            c[_TURN_BEGAN] = c[_TIME]
        if change * rate > 0.0:
            c[_TURNED] += change
    return e


@lean_kernel
def _wrong(
    events: Floats, e: int, track: int, c: Floats, began: int, kind: int, time: float, differs: bool, value: float
) -> int:
    """A run of rows that differ: the three numbers of the carry from `began` on."""
    if differs:
        if c[began + 1] == 0.0:
            c[began], c[began + 2] = time, 0.0
        c[began + 1] += 1.0
        if abs(value) > abs(c[began + 2]):
            c[began + 2] = value
    elif c[began + 1] > 0.0:
        if c[began + 1] >= _RUN:
            rows, most = c[began + 1], c[began + 2]
            e = _emit(events, e, track, kind, c[began], c[_TIME], c[_LATITUDE], c[_LONGITUDE], most, rows)
        c[began + 1] = 0.0
    return e


@called_kernel
def _wrong_speed(events: Floats, e: int, track: int, c: Floats, time: float, estimate: Floats, sog: float) -> int:
    difference = sog - estimate[2]
    if not math.isfinite(difference) or not math.isfinite(estimate[5]):
        return e
    differs = abs(difference) > _LIMIT * math.hypot(estimate[5], _SOG_STD) + _SOG_MARGIN
    return _wrong(events, e, track, c, _FAST_BEGAN, _SPEED, time, differs, difference)


@called_kernel
def _wrong_course(
    events: Floats, e: int, track: int, c: Floats, time: float, estimate: Floats, status: int, cog: float
) -> int:
    if status != OK or not math.isfinite(cog) or not estimate[2] > _COG_LEAST_SPEED:
        return e
    difference = wrap(cog - estimate[3])
    differs = abs(difference) > _LIMIT * math.hypot(estimate[6], _COG_STD) + _COG_MARGIN
    return _wrong(events, e, track, c, _AWAY_BEGAN, _COURSE, time, differs, math.degrees(difference))


def carries(count: int) -> np.ndarray:
    """(count, CARRIED) before the first row."""
    return np.zeros((count, CARRIED))
