"""Start-up: import, the first start with compilation, and a start with everything compiled."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.support.harness import Result
from benchmarks.support.sentences import sentences

_TIMED = """
import time
start = time.perf_counter()
{}
print(time.perf_counter() - start)
"""
_STREAM = """
import steerway
estimator = steerway.FiveStateFilter()
estimator.predict(0.02)
estimator.update(1.0, 0.2)
"""
# A small process starts the command: the largest memory of a process includes that of the process it was forked from.
_MEASURED = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3)
"""


def run():
    yield Result("import steerway", min(_seconds("import steerway", None) for _ in range(3)), "s")
    with tempfile.TemporaryDirectory() as cache:
        yield Result("first step of a stream, nothing compiled", _seconds(_STREAM, cache), "s")
        yield Result("… the next time", min(_seconds(_STREAM, cache) for _ in range(3)), "s")
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.nmea"
        log.write_bytes(sentences(28_800))
        for what in ("first steerway estimate of 28,800 fixes, nothing compiled", "… the next time"):
            seconds, memory = _estimated(log, Path(folder) / "cache")
            yield Result(f"{what}, processor time", seconds, "s", at_most=25.0)
            yield Result("… its largest memory", memory, "MB", at_most=400.0)


def _seconds(code, cache):
    """Wall time (s) of `code` in its own process."""
    environment = os.environ | ({"STEERWAY_CACHE": cache} if cache else {})
    ended = subprocess.run([sys.executable, "-c", _TIMED.format(code)], env=environment, capture_output=True, text=True)
    if ended.returncode:
        raise RuntimeError(ended.stderr)
    return float(ended.stdout)


def _estimated(log, cache):
    """Processor time (s) and largest memory (MB) of `steerway estimate` with an output."""
    environment = os.environ | {"STEERWAY_CACHE": str(cache)}
    command = [
        str(Path(sys.executable).with_name("steerway")),
        "estimate",
        str(log),
        "-o",
        str(log.with_suffix(".csv")),
    ]
    measured = [sys.executable, "-c", _MEASURED, *command]
    ended = subprocess.run(measured, env=environment, capture_output=True, text=True)
    if ended.returncode:
        raise RuntimeError(ended.stderr)
    return tuple(map(float, ended.stdout.split()))
