"""The command as a user waits for it: a warm `steerway estimate` on a log of 25,000 fixes, start included."""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.parsing import sentences
from benchmarks.support.harness import Result, interleaved

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
    for options, seconds in taken.items():
        note = f"{processor[options]:.2f} s of processor time"
        yield Result(f"steerway estimate LOG{options} -o OUT.csv", seconds, "s", at_most=3.0, note=note)


def _childrens_time() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
