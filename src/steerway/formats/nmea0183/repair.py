"""Corrections of times that need the whole log: week rollovers, a stray date."""

from itertools import pairwise

import numpy as np

from steerway.core.arrays import Floats
from steerway.formats.nmea0183.epochs import AHEAD, DAY, LOCAL, NEAR, ROLLOVER, ROLLOVERS, TIME, UNDATED

_HALF_DAY = 0.5 * DAY
_STRAY = 16  # rows that one damaged date can affect before the next date


def mended_times(rows: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Unix time of every row in order of arrival, and a note for each kind of correction.

    Rows whole rollovers behind the newest are moved up to it; a few rows on another day than the rows on either side
    of them take theirs.
    """
    notes = []
    time = rows[:, TIME].copy()
    if rows[:, UNDATED].any():
        notes.append("no date anywhere in the log: days are counted from 1970-01-01")
    if memory[LOCAL]:
        hours, minutes = divmod(int(abs(memory[AHEAD])) // 60, 60)
        zone = f"{'-' if memory[AHEAD] < 0.0 else '+'}{hours:02d}:{minutes:02d}"
        notes.append(
            f"{int(memory[LOCAL])} sentences without a date in local time ({zone}): made UTC by those with a date"
        )
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


def _mend_strays(time: Floats) -> int:
    """Correct short runs of rows with another date, in place; returns their number."""
    jumps = np.flatnonzero(np.abs(np.diff(time)) > _HALF_DAY)
    mended = 0
    for before, last in pairwise(jumps):
        if last - before <= _STRAY and abs(time[last + 1] - time[before]) < _HALF_DAY:
            stray = slice(before + 1, last + 1)
            time[stray] += DAY * np.round((time[before] - time[stray]) / DAY)
            mended += int(last - before)
    return mended
