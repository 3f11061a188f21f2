"""Corrections that need the whole log: week rollovers, a stray date, two receivers in one talker."""

from itertools import pairwise

import numpy as np

from steerway.formats.nmea0183.epochs import (
    DAY,
    LAT,
    LON,
    NEAR,
    OPEN,
    ROLLOVER,
    ROLLOVERS,
    SOG,
    TIME,
    UNDATED,
)
from steerway.formats.nmea0183.fields import FORMATTERS, LAST_POSITION

_HALF_DAY = 0.5 * DAY
_STRAY = 16  # rows that one damaged date can affect before the next date
_POSITIONS = (2 << LAST_POSITION) - 1  # the bits of `seen` of sentences with a position
_FEW = 4  # rows: fewer, as they come from a live link, show no two streams
_TWO_STREAMS = 0.3  # of the epochs with two positions: below, they are accidents


def mended_times(rows: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Unix time of every row in order of arrival, and a note for each kind of correction.

    Rows whole rollovers behind the newest are moved up to it; a few rows on another day than the rows on either side
    of them take theirs.
    """
    notes = []
    time = rows[:, TIME].copy()
    if rows[:, UNDATED].any():
        notes.append("no date anywhere in the log: days are counted from 1970-01-01")
    moved = int(memory[ROLLOVERS])
    if len(time) > 1:
        behind = np.round((time.max() - time) / ROLLOVER)
        early = (behind >= 1.0) & (np.abs(time.max() - time - behind * ROLLOVER) < NEAR)
        time[early] += behind[early] * ROLLOVER
        moved += int(early.sum())
    if moved:
        notes.append(f"GPS week rollover: {moved} dates were 1024 weeks (or a multiple) early and have been moved up")
    strays = _mend_strays(time) if len(time) > 1 else 0
    if strays:
        notes.append(f"{strays} rows had a date unlike those before and after them and took theirs")
    return time, notes


def _mend_strays(time):
    """Correct short runs of rows with another date, in place; returns their number."""
    jumps = np.flatnonzero(np.abs(np.diff(time)) > _HALF_DAY)
    mended = 0
    for before, last in pairwise(jumps):
        if last - before <= _STRAY and abs(time[last + 1] - time[before]) < _HALF_DAY:
            stray = slice(before + 1, last + 1)
            time[stray] += DAY * np.round((time[before] - time[stray]) / DAY)
            mended += last - before
    return mended


def streams(name: str, time: np.ndarray, rows: np.ndarray, seen: np.ndarray, mine: np.ndarray):
    """A talker's rows (indices in time order) as one source, or as several when an epoch has two positions.

    Two positions by one formatter come from two receivers: each goes to the track it continues. Two formatters that
    disagree come from a plotter that stamps positions of different moments with one second: each formatter is a
    source. Rows without position stay with the first. Returns pairs of name and indices.
    """
    if len(mine) < _FEW:
        return [(name, mine)]
    placed = mine[np.isfinite(rows[mine, LAT])]
    together = np.flatnonzero(np.diff(time[placed]) == 0.0)
    first, second = placed[together], placed[together + 1]
    double = (np.abs(first - second) <= OPEN) & (
        (rows[first, LAT] != rows[second, LAT]) | (rows[first, LON] != rows[second, LON])
    )
    if double.sum() < max(3.0, _TWO_STREAMS * (len(placed) - len(together))):
        return [(name, mine)]
    same_formatter = seen[first] & seen[second] & _POSITIONS
    if np.mean(same_formatter[double] > 0) > 0.5:
        return _by_continuity(name, time, rows, mine, placed)
    return _by_formatter(name, rows, seen, mine, placed)


def _by_formatter(name, rows, seen, mine, placed):
    """One source per formatter, the one with most positions and speeds first; a row of two formatters is in both."""
    rows_of = {kind: np.isin(mine, placed) & (seen[mine] >> kind & 1 > 0) for kind in range(LAST_POSITION + 1)}
    with_speed = np.isfinite(rows[mine, SOG])
    scores = {kind: int(mask.sum() + (mask & with_speed).sum()) for kind, mask in rows_of.items()}
    ranked = sorted((kind for kind in rows_of if scores[kind]), key=lambda kind: -scores[kind])
    unplaced = ~np.isin(mine, placed)
    chosen = [rows_of[kind] | unplaced if kind == ranked[0] else rows_of[kind] for kind in ranked]
    return [(f"{name} {FORMATTERS[kind]}", mine[mask]) for kind, mask in zip(ranked, chosen, strict=True)]


def _by_continuity(name, time, rows, mine, placed):
    """Two sources: the rows of an epoch go to the two tracks so that both move least."""
    track = dict.fromkeys(mine.tolist(), 0)
    newest = None
    bounds = [0, *(np.flatnonzero(np.diff(time[placed])) + 1).tolist(), len(placed)]
    for start, stop in pairwise(bounds):
        epoch = placed[start:stop].tolist()
        if newest is None:
            newest = [rows[epoch[0]], rows[epoch[-1]]]
        nearer_second = [_apart(rows[row], newest[1]) - _apart(rows[row], newest[0]) for row in epoch]
        choice = [int(gain < 0.0) for gain in nearer_second]
        if len(epoch) == 2:
            choice = [0, 1] if nearer_second[0] >= nearer_second[1] else [1, 0]
        for row, to in zip(epoch, choice, strict=True):
            track[row] = to
            newest[to] = rows[row]
    second = np.array([track[row] for row in mine.tolist()]) == 1
    return [(name, mine[~second]), (f"{name} 2", mine[second])]


def _apart(row, other):
    return abs(row[LAT] - other[LAT]) + abs(row[LON] - other[LON])
