"""Separate the streams of positions under one talker.

Two positions by one formatter in an epoch come from two receivers; each position goes to the track that it continues.
Two formatters that disagree come from a plotter that stamps positions of different moments with the same second; each
formatter becomes a source. `streams` divides a whole log, `division` also the newest epochs of a live link.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.formats.nmea0183.epochs import LAT, LON, OPEN, SOG
from steerway.formats.nmea0183.fields import FORMATTERS, LAST_POSITION

POSITIONS = (2 << LAST_POSITION) - 1
"""Mask of the bits in `seen` that stand for sentences with a position."""
FEW = 4
"""Minimum number of rows that are divided."""
_LEAST = 3.0  # least number of epochs with two positions, to divide a talker
_TWO_STREAMS = 0.3  # least share of such epochs; a smaller share is accidental


class Division(NamedTuple):
    """Division of a talker: by formatters, best first, or by continuity without formatters."""

    formatters: tuple[int, ...] = ()

    def names(self, talker: str) -> list[str]:
        """The names of the sources, in the order of the formatters."""
        if self.formatters:
            return [f"{talker} {FORMATTERS[kind]}" for kind in self.formatters]
        return [talker, f"{talker} 2"]


def division(
    time: Floats, latitude: Floats, longitude: Floats, seen: NDArray[np.int64], sog: Floats, arrival: NDArray[np.int64]
) -> Division | None:
    """The division of a talker's rows with positions; None if they are one stream.

    Arrays (n,) in time order: position (rad); seen, a bit per kind of sentence in the row; SOG (NaN if unknown); and
    arrival, each row's index in order of arrival.
    """
    together = np.flatnonzero(np.diff(time) == 0.0)
    first, second = together, together + 1
    double = (np.abs(arrival[first] - arrival[second]) <= OPEN) & (
        (latitude[first] != latitude[second]) | (longitude[first] != longitude[second])
    )
    if double.sum() < max(_LEAST, _TWO_STREAMS * (len(time) - len(together))):
        return None
    same_formatter = seen[first] & seen[second] & POSITIONS
    if np.mean(same_formatter[double] > 0) > 0.5:
        return Division()
    with_speed = np.isfinite(sog)
    scores = {}
    for kind in range(LAST_POSITION + 1):
        mask = seen >> kind & 1 > 0
        scores[kind] = int(mask.sum() + (mask & with_speed).sum())
    return Division(tuple(sorted((kind for kind in scores if scores[kind]), key=lambda kind: -scores[kind])))


def streams(
    name: str, time: np.ndarray, rows: np.ndarray, seen: np.ndarray, mine: np.ndarray
) -> list[tuple[str, NDArray[np.int64]]]:
    """Pairs (name, row indices) of a talker's sources: one, or several if epochs have two positions.

    mine: indices of the talker's rows, in time order. Rows without a position stay with the first source.
    """
    if len(mine) < FEW:
        return [(name, mine)]
    placed = mine[np.isfinite(rows[mine, LAT])]
    divided = division(time[placed], rows[placed, LAT], rows[placed, LON], seen[placed], rows[placed, SOG], placed)
    if divided is None:
        return [(name, mine)]
    parts = (
        _by_formatter(divided, seen, mine, placed) if divided.formatters else _by_continuity(time, rows, mine, placed)
    )
    return [(each, mine[mask]) for each, mask in zip(divided.names(name), parts, strict=True)]


def _by_formatter(
    divided: Division, seen: NDArray[np.int64], mine: NDArray[np.int64], placed: NDArray[np.int64]
) -> list[NDArray[np.bool_]]:
    """Masks (len(mine),) of the rows of each formatter; a row with two formatters is in both."""
    is_placed = np.isin(mine, placed)
    parts = [is_placed & (seen[mine] >> kind & 1 > 0) for kind in divided.formatters]
    parts[0] |= ~is_placed
    return parts


def _by_continuity(
    time: Floats, rows: Floats, mine: NDArray[np.int64], placed: NDArray[np.int64]
) -> list[NDArray[np.bool_]]:
    """Masks (len(mine),) of two tracks. The positions of an epoch are assigned so that the tracks move least."""
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
    return [~second, second]


def _apart(row: Floats, other: Floats) -> float:
    return abs(row[LAT] - other[LAT]) + abs(row[LON] - other[LON])
