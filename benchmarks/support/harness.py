"""Timing of alternatives side by side, and results with their targets."""

import os
import platform
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Result:
    """One number and its target, if any."""

    what: str
    value: float | None  # None: could not be measured, `note` gives the reason
    unit: str = ""
    at_most: float | None = None
    at_least: float | None = None
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without a target or a value."""
        if self.value is None or (self.at_most is None and self.at_least is None):
            return None
        return (self.at_most is None or self.value <= self.at_most) and (
            self.at_least is None or self.value >= self.at_least
        )

    def __str__(self):
        value = "—" if self.value is None else f"{self.value:,.3g}" if abs(self.value) < 1000 else f"{self.value:,.0f}"
        target = "" if self.at_most is None else f"≤ {self.at_most:g}"
        target = target if self.at_least is None else f"≥ {self.at_least:,g}"
        verdict = {None: "", True: "met", False: "MISSED"}[self.met]
        return f"{self.what:<58}{value:>10} {self.unit:<12}{target:>12} {verdict:<7}{self.note}".rstrip()


def interleaved(contenders: dict[str, Callable[[], object]], rounds: int, clock=time.process_time) -> dict[str, float]:
    """Median seconds of each contender. They take turns (A B C A B C …), so that a slow moment slows all of them."""
    taken = {name: [] for name in contenders}
    print(f"    timing {', '.join(map(str, contenders))}, {rounds} rounds …", file=sys.stderr, flush=True)
    for work in contenders.values():
        work()  # compiles and fills caches
    for _ in range(rounds):
        for name, work in contenders.items():
            start = clock()
            work()
            taken[name].append(clock() - start)
    return {name: statistics.median(times) for name, times in taken.items()}


def machine() -> str:
    """The machine and the versions of the measurement."""
    load = ", ".join(f"{each:.1f}" for each in os.getloadavg()) if hasattr(os, "getloadavg") else "unknown"
    system = f"{platform.system()} {platform.machine()}, Python {platform.python_version()}"
    return f"{_processor()}, {os.cpu_count()} cores, load {load}; {system}; {_versions()}"


def _processor():
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as info:
            return next(line.split(":")[1].strip() for line in info if line.startswith(("model name", "Model")))
    except (OSError, StopIteration):
        return platform.processor() or "unknown processor"


def _versions():
    import numba
    import numpy

    return f"numpy {numpy.__version__}, numba {numba.__version__}"
