"""The command as a user waits for it: a warm `steerway estimate` on a log of 25,000 fixes, start included."""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.parsing import sentences
from benchmarks.support import by_hand
from benchmarks.support.harness import Result, interleaved
from benchmarks.support.record import Record
from steerway import read
from steerway.core.earth import displacement

_FIXES, _ROUNDS = 25_000, 5


def run():
    command = Path(sys.executable).with_name("steerway")
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder) / "log.nmea", Path(folder) / "out.csv"
        log.write_bytes(sentences(_FIXES))

        def estimate(*options):
            ended = subprocess.run([command, "estimate", log, "-o", out, *options], capture_output=True, text=True)
            if ended.returncode:
                raise RuntimeError(ended.stderr)

        def warm():
            estimate()

        def warm_with_profile():
            estimate("--profile", "small-usv")

        try:
            warm()
        except (RuntimeError, FileNotFoundError) as error:
            yield Result("steerway estimate LOG -o OUT.csv", None, note=f"did not run: {error}")
            return
        contenders = {"": warm, " --profile small-usv": warm_with_profile}
        taken = interleaved(contenders, _ROUNDS, clock=time.perf_counter)
        processor = interleaved(contenders, _ROUNDS, clock=_childrens_time)
        plain = _plain_ekf(log)
    for options, seconds in taken.items():
        note = f"{processor[options]:.2f} s of processor time"
        yield Result(f"steerway estimate LOG{options} -o OUT.csv", seconds, "s", at_most=3.0, note=note)
    if plain is None:
        yield Result("processor time / plain EKF in C on the same log", None, note="no gcc on this machine")
        return
    for options, seconds in processor.items():
        what = f"processor time of steerway estimate LOG{options} / plain EKF in C on the same log"
        yield Result(what, seconds / plain, "times", note=f"the EKF: {1e3 * plain:.1f} ms")


def _plain_ekf(log) -> float | None:
    """Seconds of the five-state filter in C over the fixes of the log, already read; None without a compiler."""
    if not by_hand.Library.available():
        return None
    fixes = read(log)
    there = zip(fixes.latitude, fixes.longitude, strict=True)
    north, east = np.array([displacement(*each, fixes.latitude[0], fixes.longitude[0]) for each in there]).T.copy()
    record, library = Record(fixes.time - fixes.time[0], north, east), by_hand.Library()
    return interleaved({"C": lambda: library.whole_record(record)}, _ROUNDS)["C"]


def _childrens_time() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
