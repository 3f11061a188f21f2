"""The streams of positions in one talker: two receivers, or a plotter whose sentences are of different moments.

Two positions by one formatter in an epoch come from two receivers: each goes to the track it continues. Two formatters
that disagree come from a plotter that stamps positions of different moments with one second: each formatter is a
source. A log is divided as a whole (`streams`), a live link by its newest epochs (`division`, `Track`).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.formats.nmea0183.epochs import LAT, LON, OPEN, SOG
from steerway.formats.nmea0183.fields import FORMATTERS, LAST_POSITION

POSITIONS = (2 << LAST_POSITION) - 1
"""The bits of `seen` of sentences with a position."""
FEW = 4
"""Rows below which nothing can be divided."""
_LEAST = 3.0  # epochs with two positions
_TWO_STREAMS = 0.3  # of the epochs with two positions: below, they are accidents


class Division(NamedTuple):
    """How a talker is divided: by formatter, the best one first, or without any by continuity."""

    formatters: tuple[int, ...] = ()

    def names(self, talker: str) -> list[str]:
        """The names of the sources, in the same order."""
        if self.formatters:
            return [f"{talker} {FORMATTERS[kind]}" for kind in self.formatters]
        return [talker, f"{talker} 2"]


def division(
    time: Floats, latitude: Floats, longitude: Floats, seen: NDArray[np.int64], sog: Floats, arrival: NDArray[np.int64]
) -> Division | None:
    """The division of a talker's rows with positions, None where they are of one stream.

    Arrays (n,) in time order: position (rad), the bits of the kinds of sentences in each row, SOG (NaN for none), and
    the place of each row in the order of arrival.
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
    """A talker's rows (indices in time order) as one source, or as several when an epoch has two positions.

    Rows without position stay with the first. Returns pairs of name and indices.
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
    """The rows of each formatter; a row of two formatters is in both."""
    is_placed = np.isin(mine, placed)
    parts = [is_placed & (seen[mine] >> kind & 1 > 0) for kind in divided.formatters]
    parts[0] |= ~is_placed
    return parts


def _by_continuity(
    time: Floats, rows: Floats, mine: NDArray[np.int64], placed: NDArray[np.int64]
) -> list[NDArray[np.bool_]]:
    """The rows of an epoch go to the two tracks so that both move least."""
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
