"""Many short tracks in one call: CPU time per row, against C."""

import numpy as np

from benchmarks.support import by_hand, ours
from benchmarks.support.harness import Result, interleaved
from benchmarks.support.record import winding
from steerway.estimation.filter.model import FUSED

_TRACKS, _ROWS, _ROUNDS = 10_000, 100, 7


class Batch:
    """Arrays that contain the tracks one after another, and arrays for their estimates."""

    def __init__(self, tracks):
        each = winding(_ROWS * 50)  # fifty tracks with different starts, repeated
        repeats = -(-tracks * _ROWS // len(each))
        n = tracks * _ROWS
        self.bounds = np.arange(0, n + 1, _ROWS)
        self.time = np.tile(each.time, repeats)[:n]
        self.north, self.east = np.tile(each.north, repeats)[:n], np.tile(each.east, repeats)[:n]
        self.found, self.outputs = np.empty((n, FUSED + 2)), np.empty((n, FUSED))

    def all(self):
        """Filter all tracks."""
        ours.tracks(self.bounds, self.time, self.north, self.east, self.found)


def run():
    batch = Batch(_TRACKS)
    contenders = {"ours": batch.all}
    if by_hand.Library.available():
        library = by_hand.Library()
        contenders["C"] = lambda: library.tracks(batch.bounds, batch.time, batch.north, batch.east, batch.outputs)
    taken = interleaved(contenders, _ROUNDS)
    for name, seconds in taken.items():
        yield Result(f"{name}, {_TRACKS:,} tracks of {_ROWS} rows", 1e9 * seconds / len(batch.time), "ns a row")
    if "C" in taken:
        rows = ours.compared(batch.found)
        assert np.array_equal(np.isnan(rows), np.isnan(batch.outputs))
        yield Result("largest difference to C", float(np.nanmax(np.abs(rows - batch.outputs))), "", at_most=1e-9)
        yield Result(
            "ours / C (0.5 would take vectors across tracks)", taken["ours"] / taken["C"], "times", at_most=1.5
        )
