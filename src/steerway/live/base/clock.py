"""The receiver's time now: a monotonic clock plus the offset of the least delayed of recent fixes.

The clock of a boat's computer may be wrong or be set while it runs, and every fix arrives late. The receiver knows the
time; the delay varies from fix to fix, and the least delayed one is the closest.
"""

import math
from collections import deque

from steerway.core.checks import not_negative

WINDOW = 30.0
"""s after which a fix no longer counts, so that clocks may drift."""


class FixClock:
    """`latency`: least time from the moment of a fix to its arrival, s; 0 where it is not known."""

    def __init__(self, latency: float = 0.0):
        self.latency = not_negative("latency", latency)
        self._offsets: deque[tuple[float, float]] = deque()  # (arrival, offset), offsets falling

    def add(self, time: float, monotonic: float) -> None:
        """A fix of `time` arrived at a time of the monotonic clock."""
        offset = time - monotonic
        while self._offsets and self._offsets[-1][1] <= offset:
            self._offsets.pop()
        self._offsets.append((monotonic, offset))
        while self._offsets[0][0] < monotonic - WINDOW:
            self._offsets.popleft()

    def forget(self) -> None:
        """The receiver's time has stepped: the offsets are void."""
        self._offsets.clear()

    def now(self, monotonic: float) -> float:
        """Unix time by the receiver; NaN before the first fix."""
        return monotonic + self._offsets[0][1] + self.latency if self._offsets else math.nan
