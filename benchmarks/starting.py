"""Before anything is estimated: import, the very first compilation, and the same start when all is compiled."""

import os
import subprocess
import sys
import tempfile

from benchmarks.support.harness import Result

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
_RECORD = """
import numpy, steerway
seconds = numpy.arange(10.0)
fixes = steerway.Fixes(seconds, 1.0 + 1e-6 * seconds, 0.2 + 0.0 * seconds)
steerway.FiveStateFilter().filter(fixes)
"""


def run():
    yield Result("import steerway", min(_seconds("import steerway", None) for _ in range(3)), "s")
    for what, code in (("stream", _STREAM), ("filter a record", _RECORD)):
        with tempfile.TemporaryDirectory() as cache:
            yield Result(f"first {what}, nothing compiled", _seconds(code, cache), "s")
            yield Result("… the next time", min(_seconds(code, cache) for _ in range(3)), "s")


def _seconds(code, cache):
    """Wall time of `code` in a process of its own."""
    environment = os.environ | ({"STEERWAY_CACHE": cache} if cache else {})
    ended = subprocess.run([sys.executable, "-c", _TIMED.format(code)], env=environment, capture_output=True, text=True)
    if ended.returncode:
        raise RuntimeError(ended.stderr)
    return float(ended.stdout)
