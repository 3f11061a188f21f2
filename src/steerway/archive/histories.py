"""Trips, stops and events of ships, from their estimates: turns, gaps, jumps, and wrong transmitted SOG and COG.

Each track is processed in one pass. A record of a few numbers (HISTORY) is carried from one day to the next, so the
result does not depend on where a record is cut.
"""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.archive.tracks import ANOTHER, JUMP, MOVED, record_of
from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import OK, REJECTED

EVENTS = ("jump", "moved", "another ship", "gap", "dark period", "turn", "speed", "course")
"""Kinds of events. `value`: for a jump, a move or another ship the distance (m) from the estimate or last position; for
a gap or dark period the distance (m) between its ends; for a turn the angle (degrees, starboard positive); for a wrong
speed or course the largest difference, transmitted minus estimated (m/s or degrees)."""
_JUMP, _MOVED, _ANOTHER, _GAP, _DARK, _TURN, _SPEED, _COURSE = range(8)
MODES = ("unknown", "stop", "trip")
_UNKNOWN, _STOP, _TRIP = range(3)

STOP_RADIUS, STOP_TIME = 250.0, 900.0
"""Radius (m) and time (s) of a stop: a vessel that stays within the radius for this time has stopped."""
_DARK_SPEED, _DARK_DISTANCE = 1.0, 2000.0
"""Speed (m/s) and distance (m): a gap is dark if the vessel was faster before it, or is farther away after it."""
_TURN_RATE, _TURN_LEAST = math.radians(0.1), math.radians(45.0)
_EXCURSION, _EXCURSION_TIME, _BACK = 500.0, 7200.0, 0.3
"""Distance (m), time (s) and ratio of a jump. A report is a jump if (1) the distances to it and back both exceed this
distance, (2) the report before, the jump and the report after come within this time, and (3) the reports before and
after it are closer together than this ratio times the shorter distance."""
_LIMIT, _RUN = 4.0, 5
"""Limits of wrong transmitted values. A value is wrong if it differs by more than `_LIMIT` times the combined σ; `_RUN`
wrong reports in a row make an event."""
_SOG_STD, _SOG_MARGIN = 0.2, 0.5
_COG_STD, _COG_MARGIN, _COG_LEAST_SPEED = math.radians(3.0), math.radians(5.0), 2.0

EVENT = record_of("track kind start end latitude longitude value rows")
TRIP = record_of(
    "track mode start end start_latitude start_longitude end_latitude end_longitude distance greatest_speed"
)
_RUN_OF_WRONG = record_of("began rows most")
HISTORY = record_of(
    "time latitude longitude sog cog rows mode began began_latitude began_longitude distance fastest"
    " anchor_time anchor_latitude anchor_longitude anchor_distance turn_began turned"
    " last_time last_latitude last_longitude last_sog former_time former_latitude former_longitude reports",
    fast=_RUN_OF_WRONG,
    away=_RUN_OF_WRONG,
)
"""History of a track, zero before its first row. It holds the row before and the number of rows; the mode (of MODES),
its start, the distance since then and the highest speed; the anchor, where a stop may have begun; the turn in progress;
the last report with its SOG, the report before that, and the number of reports; and the runs of wrong SOG (`fast`) and
COG (`away`): start, rows, largest difference."""


@kernel
def history(
    bounds: NDArray[np.int64],
    order: NDArray[np.int64],
    rows: tuple[np.ndarray, ...],
    carry: np.ndarray,
    events: np.ndarray,
    trips: np.ndarray,
) -> tuple[int, int]:
    """Find the events and trips of tracks. Returns their numbers, which can exceed the lengths of `events` and `trips`.

    Args:
        bounds: (tracks + 1,) where each track begins in `order` (n,), the row numbers by track and time.
        rows: (time, estimate, status, event, reported), the first four as in `association.associate`; reported (n, 4):
            latitude, longitude, SOG, COG in SI units, NaN where unknown.
        carry: (tracks,) HISTORY, updated. events: (any,) EVENT. trips: (any,) TRIP.
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
                elif c.rows > 0.0:
                    value = _apart(reported[k, 0], reported[k, 1], c.latitude, c.longitude)
                e = _emit(events, e, i, kind, time[k], time[k], reported[k, 0], reported[k, 1], value, 1.0)
            elif math.isfinite(reported[k, 0]):
                e = _excursion(events, e, i, c, time[k], reported[k])
            if status[k] == REJECTED or not math.isfinite(reported[k, 0]):
                continue
            latitude, longitude, sog = estimate[k, 0], estimate[k, 1], estimate[k, 2]
            if c.rows > 0.0:
                step = _apart(latitude, longitude, c.latitude, c.longitude)
                elapsed = time[k] - c.time
                if elapsed > LONGEST_GAP:
                    dark = c.sog > _DARK_SPEED or step > _DARK_DISTANCE
                    kind = _DARK if dark else _GAP
                    e = _emit(events, e, i, kind, c.time, time[k], c.latitude, c.longitude, step, 0.0)
                if event[k] != MOVED:
                    c.distance += step
                e = _turning(events, e, i, c, time[k], estimate[k], status[k], elapsed)
                t = _sailing(trips, t, i, c, time[k], latitude, longitude)
            else:
                _drop_anchor(c, time[k], latitude, longitude)
                _begin(c, _UNKNOWN, time[k], latitude, longitude, 0.0)
            if math.isfinite(sog):
                c.fastest = max(c.fastest, sog)
            e = _wrong_speed(events, e, i, c, time[k], estimate[k], reported[k, 2])
            e = _wrong_course(events, e, i, c, time[k], estimate[k], status[k], reported[k, 3])
            c.time, c.latitude, c.longitude = time[k], latitude, longitude
            c.sog = sog if math.isfinite(sog) else 0.0
            c.cog = estimate[k, 3]
            c.rows += 1.0
    return e, t


@called_kernel
def _excursion(events: np.ndarray, e: int, track: int, c: np.record, time: float, reported: Floats) -> int:
    """Emit a jump if reaching the last report and returning needs more speed than the ship has; store this report.

    Such a jump is within reach of the track, so only the next report, near the earlier one, shows it.
    """
    if c.reports >= 2.0 and time - c.former_time <= _EXCURSION_TIME:
        there = _apart(c.last_latitude, c.last_longitude, c.former_latitude, c.former_longitude)
        back = _apart(reported[0], reported[1], c.last_latitude, c.last_longitude)
        least = min(there, back)
        if least > _EXCURSION:
            between = _apart(reported[0], reported[1], c.former_latitude, c.former_longitude)
            speed = min(there / max(c.last_time - c.former_time, 1.0), back / max(time - c.last_time, 1.0))
            known = 2.0 * c.last_sog + 0.5 if math.isfinite(c.last_sog) else 5.0
            if between < _BACK * least and speed > known:
                began, place = c.last_time, (c.last_latitude, c.last_longitude)
                e = _emit(events, e, track, _JUMP, began, began, place[0], place[1], least, 1.0)
    c.former_time, c.former_latitude, c.former_longitude = c.last_time, c.last_latitude, c.last_longitude
    c.last_time, c.last_latitude, c.last_longitude, c.last_sog = time, reported[0], reported[1], reported[2]
    c.reports += 1.0
    return e


@kernel
def unfinished(carry: np.ndarray, trips: np.ndarray) -> int:
    """Fill `trips` with the current trip or stop of every track; returns the number written."""
    t = 0
    for i in range(len(carry)):
        c = carry[i]
        t = _end(trips, t, i, c, c.time, c.latitude, c.longitude, c.distance)
    return t


@lean_kernel
def _apart(latitude: float, longitude: float, latitude_0: float, longitude_0: float) -> float:
    north, east = displacement(latitude, longitude, latitude_0, longitude_0)
    return math.hypot(north, east)


@lean_kernel
def _emit(
    events: np.ndarray,
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
        row.track, row.kind, row.start, row.end = track, kind, start, end
        row.latitude, row.longitude, row.value, row.rows = latitude, longitude, value, rows
    return e + 1


@lean_kernel
def _begin(c: np.record, mode: int, time: float, latitude: float, longitude: float, distance: float) -> None:
    c.mode, c.began, c.began_latitude, c.began_longitude = mode, time, latitude, longitude
    c.distance, c.fastest = distance, 0.0


@lean_kernel
def _drop_anchor(c: np.record, time: float, latitude: float, longitude: float) -> None:
    c.anchor_time, c.anchor_latitude, c.anchor_longitude = time, latitude, longitude
    c.anchor_distance = c.distance


@lean_kernel
def _end(
    trips: np.ndarray, t: int, track: int, c: np.record, time: float, latitude: float, longitude: float, distance: float
) -> int:
    if c.mode != _UNKNOWN or time > c.began:
        if t < len(trips):
            row = trips[t]
            row.track, row.mode, row.start, row.end = track, c.mode, c.began, time
            row.start_latitude, row.start_longitude = c.began_latitude, c.began_longitude
            row.end_latitude, row.end_longitude = latitude, longitude
            row.distance, row.greatest_speed = distance, c.fastest
        t += 1
    return t


@called_kernel
def _sailing(
    trips: np.ndarray, t: int, track: int, c: np.record, time: float, latitude: float, longitude: float
) -> int:
    """Update the mode. A stop begins at the first row within the radius and ends at the last; trips are in between."""
    inside = _apart(latitude, longitude, c.anchor_latitude, c.anchor_longitude) <= STOP_RADIUS
    if c.mode == _STOP:
        if not inside:
            t = _end(trips, t, track, c, c.time, c.latitude, c.longitude, 0.0)
            step = _apart(latitude, longitude, c.latitude, c.longitude)
            _begin(c, _TRIP, c.time, c.latitude, c.longitude, step)
            _drop_anchor(c, time, latitude, longitude)
        return t
    if not inside:
        if c.mode == _UNKNOWN:
            c.mode = _TRIP
        _drop_anchor(c, time, latitude, longitude)
    elif time - c.anchor_time >= STOP_TIME:
        place = c.anchor_latitude, c.anchor_longitude
        if c.mode == _TRIP:
            t = _end(trips, t, track, c, c.anchor_time, place[0], place[1], c.anchor_distance)
        _begin(c, _STOP, c.anchor_time, place[0], place[1], 0.0)
    return t


@called_kernel
def _turning(
    events: np.ndarray, e: int, track: int, c: np.record, time: float, estimate: Floats, status: int, elapsed: float
) -> int:
    """Update the turn in progress, a run of rows whose course rate has one sign; emit it at its end."""
    rate = estimate[4] if status == OK and math.isfinite(c.cog) and elapsed <= LONGEST_GAP else 0.0
    turns = abs(rate) > _TURN_RATE
    if c.turned != 0.0 and not (turns and rate * c.turned > 0.0):
        if abs(c.turned) >= _TURN_LEAST:
            value = math.degrees(c.turned)
            e = _emit(events, e, track, _TURN, c.turn_began, c.time, c.latitude, c.longitude, value, 0.0)
        c.turned = 0.0
    if turns:
        change = wrap(estimate[3] - c.cog)
        if c.turned == 0.0:
            c.turn_began = c.time
        if change * rate > 0.0:
            c.turned += change
    return e


@lean_kernel
def _wrong(
    events: np.ndarray, e: int, track: int, c: np.record, run: np.record, kind: int, time: float, value: float
) -> int:
    """Update a run of wrong values, and emit it at its end. value: the difference, 0 if the row is within limits."""
    if value != 0.0:
        if run.rows == 0.0:
            run.began, run.most = time, 0.0
        run.rows += 1.0
        if abs(value) > abs(run.most):
            run.most = value
    elif run.rows > 0.0:
        if run.rows >= _RUN:
            e = _emit(events, e, track, kind, run.began, c.time, c.latitude, c.longitude, run.most, run.rows)
        run.rows = 0.0
    return e


@called_kernel
def _wrong_speed(
    events: np.ndarray, e: int, track: int, c: np.record, time: float, estimate: Floats, sog: float
) -> int:
    difference = sog - estimate[2]
    if not math.isfinite(difference) or not math.isfinite(estimate[5]):
        return e
    differs = abs(difference) > _LIMIT * math.hypot(estimate[5], _SOG_STD) + _SOG_MARGIN
    return _wrong(events, e, track, c, c.fast, _SPEED, time, difference if differs else 0.0)


@called_kernel
def _wrong_course(
    events: np.ndarray, e: int, track: int, c: np.record, time: float, estimate: Floats, status: int, cog: float
) -> int:
    if status != OK or not math.isfinite(cog) or not estimate[2] > _COG_LEAST_SPEED:
        return e
    difference = wrap(cog - estimate[3])
    differs = abs(difference) > _LIMIT * math.hypot(estimate[6], _COG_STD) + _COG_MARGIN
    return _wrong(events, e, track, c, c.away, _COURSE, time, math.degrees(difference) if differs else 0.0)
