"""What only the whole log shows: dates that came later, 1024-week rollovers, a stray date, two receivers in one talker."""

import numpy as np

from steerway.formats.nmea0183_epochs import (
    DAY,
    IS_UNDATED,
    LAT,
    LON,
    QUANTUM,
    ROLLOVER,
    ROLLOVERS,
    SHIFT,
    UNDATED,
)

_HALF_DAY = 0.5 * DAY
_NEAR = 30.0 * DAY
_STRAY = 16  # rows that one damaged date can lead astray before the next date comes
_TWO_STREAMS = 0.3  # of the epochs with two positions: below, they are accidents


def mended_times(rows: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Unix time of every row in order of arrival, and a note for each kind of correction.

    Rows from before the first date take it; rows whole rollovers behind the newest are moved up to it; a few rows on
    another day than the rows on either side of them take theirs.
    """
    notes = []
    time = rows[:, 0].copy()
    undated = rows[:, UNDATED] == 1.0
    if memory[IS_UNDATED] == 1.0 and undated.any():
        notes.append("no date anywhere in the log: days are counted from 1970-01-01")
    else:
        time[undated] += memory[SHIFT]
    moved = int(memory[ROLLOVERS])
    if len(time):
        behind = np.round((time.max() - time) / ROLLOVER)
        early = (behind >= 1.0) & (np.abs(time.max() - time - behind * ROLLOVER) < _NEAR)
        time[early] += behind[early] * ROLLOVER
        moved += int(early.sum())
    if moved:
        notes.append(f"GPS week rollover: {moved} dates were 1024 weeks (or a multiple) early and have been moved up")
    strays = _mend_strays(time)
    if strays:
        notes.append(f"{strays} rows had a date unlike those before and after them and took theirs")
    return time, notes


def _mend_strays(time):
    """Bring short runs of rows on a foreign day back, in place; how many rows."""
    jumps = np.flatnonzero(np.abs(np.diff(time)) > _HALF_DAY)
    mended = 0
    for before, last in zip(jumps[:-1], jumps[1:], strict=True):
        if last - before <= _STRAY and abs(time[last + 1] - time[before]) < _HALF_DAY:
            stray = slice(before + 1, last + 1)
            time[stray] += DAY * np.round((time[before] - time[stray]) / DAY)
            mended += last - before
    return mended


def streams(name: str, time: np.ndarray, rows: np.ndarray, mine: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """A talker's rows (indices in time order) as one source, or two when it speaks for two receivers.

    Two receivers behind one talker show as two different positions in one epoch, again and again. Then each position
    goes to the stream it continues; rows without position stay with the first.
    """
    placed = mine[np.isfinite(rows[mine, LAT])]
    same_time = np.flatnonzero(np.diff(time[placed]) == 0.0)
    first, second = placed[same_time], placed[same_time + 1]
    apart = np.maximum(np.abs(rows[first, LAT] - rows[second, LAT]), np.abs(rows[first, LON] - rows[second, LON]))
    double = (apart > 1.01 * np.maximum(rows[first, QUANTUM], rows[second, QUANTUM])) & (apart > 0.0)
    epochs = len(placed) - len(same_time)
    if double.sum() < max(3.0, _TWO_STREAMS * epochs):
        return [(name, mine)]
    belongs = dict.fromkeys(mine.tolist(), 0)
    newest = [rows[first[double][0]], rows[second[double][0]]]
    bounds = [0, *(np.flatnonzero(np.diff(time[placed])) + 1).tolist(), len(placed)]
    for start, stop in zip(bounds[:-1], bounds[1:], strict=True):
        pair = placed[start:stop].tolist()
        distance = [[_apart(rows[row], last) for last in newest] for row in pair]
        if len(pair) == 2:
            swapped = distance[0][1] + distance[1][0] < distance[0][0] + distance[1][1]
            choice = [1, 0] if swapped else [0, 1]
        else:
            choice = [int(to[1] < to[0]) for to in distance]
        for row, stream in zip(pair, choice, strict=True):
            belongs[row] = stream
            newest[stream] = rows[row]
    of = np.array([belongs[row] for row in mine.tolist()])
    return [(name, mine[of == 0]), (f"{name} 2", mine[of == 1])]


def _apart(row, other):
    return abs(row[LAT] - other[LAT]) + abs(row[LON] - other[LON])


