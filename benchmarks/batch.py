"""Many short tracks at once: CPU time a row against C, growth with their number, efficiency on all cores."""

import os
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from benchmarks.support import by_hand, ours
from benchmarks.support.harness import Result, interleaved
from benchmarks.support.record import winding
from steerway.core.compiled import kernel
from steerway.estimation.course.motion.layout import empty_bank
from steerway.estimation.course.output import OUTPUTS
from steerway.estimation.course.replay import TrackOutput, run_track
from steerway.estimation.course.update.aids import NO_AIDS

_TRACKS, _ROWS, _ROUNDS = 10_000, 100, 7
_SPINS = 20_000_000
_NUMBERS = (100, 1_000, 10_000, 100_000)


class Batch:
    """Tracks behind one another, and room for their estimates."""

    def __init__(self, tracks):
        each = winding(_ROWS * 50)  # fifty tracks that start at different places, again and again
        repeats = -(-tracks * _ROWS // len(each))
        n = tracks * _ROWS
        self.bounds = np.arange(0, n + 1, _ROWS)
        self.time = np.tile(each.time, repeats)[:n]
        self.north, self.east = np.tile(each.north, repeats)[:n], np.tile(each.east, repeats)[:n]
        self.found = TrackOutput(n)
        self.outputs = np.empty((n, OUTPUTS + 1))
        self.no_scales = np.empty(0)

    def share(self, first, last):
        """Run tracks first to last."""
        rows = slice(self.bounds[first], self.bounds[last])
        record = self.time[rows], self.north[rows], self.east[rows], self.no_scales, NO_AIDS, False
        bounds = self.bounds[first : last + 1] - self.bounds[first]
        run_track(bounds, record, ours.MODEL, empty_bank(ours.MODEL), self.found.arrays(rows))

    def all(self):
        self.share(0, len(self.bounds) - 1)

    def on_threads(self, pool, threads):
        cuts = np.linspace(0, len(self.bounds) - 1, threads + 1).astype(int)
        list(pool.map(self.share, cuts[:-1], cuts[1:]))


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
        rows = np.column_stack([batch.found.estimate, batch.found.nis])
        assert np.array_equal(np.isnan(rows), np.isnan(batch.outputs))
        yield Result("largest difference to C", float(np.nanmax(np.abs(rows - batch.outputs))), "", at_most=1e-9)
        yield Result(
            "ours / C (0.5 would take vectors across tracks)", taken["ours"] / taken["C"], "times", at_most=1.5
        )
    yield from _growth()
    yield from _cores(batch)


def _growth():
    """Time a row must not grow with the number of tracks."""
    batches = {number: Batch(number) for number in _NUMBERS}
    repeats = {number: max(1, 10_000 // number) for number in _NUMBERS}

    def work(number):
        for _ in range(repeats[number]):
            batches[number].all()

    taken = interleaved({number: lambda number=number: work(number) for number in _NUMBERS}, 5)
    per_row = {number: taken[number] / repeats[number] / (number * _ROWS) for number in _NUMBERS}
    for number in _NUMBERS[1:]:
        ratio = per_row[number] / per_row[_NUMBERS[0]]
        yield Result(f"time a row, {number:,} tracks / 100 tracks", ratio, "times", at_most=1.25)


def _cores(batch):
    threads = os.cpu_count() or 1
    with ThreadPoolExecutor(threads) as pool:
        contenders = {
            "one": batch.all,
            "all": lambda: batch.on_threads(pool, threads),
            "idle arithmetic, one": lambda: _spin(_SPINS),
            "idle arithmetic, all": lambda: list(pool.map(_spin, [_SPINS // threads] * threads)),
        }
        taken = interleaved(contenders, _ROUNDS, clock=time.perf_counter)
    efficiency = 100.0 * taken["one"] / (threads * taken["all"])
    free = 100.0 * taken["idle arithmetic, one"] / (threads * taken["idle arithmetic, all"])
    load = f"load {os.getloadavg()[0]:.1f}"
    yield Result(f"efficiency on {threads} cores", efficiency, "%", at_least=80.0, note=load)
    yield Result(
        "… of arithmetic without memory at the same time", free, "%", note="what other work leaves of the cores"
    )


@kernel
def _spin(times):
    x = 1.0
    for _ in range(times):
        x = x * 1.0000001 + 1e-9
    return x
