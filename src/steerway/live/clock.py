"""The time of the fixes, now: a monotonic clock plus the offset of the least delayed of recent fixes.

A boat's computer may not know the time, may be set while it runs, and hears every fix late. The receiver knows the
time; what differs from fix to fix is the delay, and the least delayed fix is the nearest to the truth.
"""

import math
from collections import deque

from steerway.core.checks import not_negative

WINDOW = 30.0
"""s after which a fix no longer tells the offset, so that clocks may drift."""


class FixClock:
    """`latency`: s from the moment a fix is of to the moment it is heard, at the least; 0 where it is not known."""

    def __init__(self, latency: float = 0.0):
        self.latency = not_negative("latency", latency)
        self._offsets: deque[tuple[float, float]] = deque()  # (when heard, offset), offsets falling

    def hear(self, time: float, monotonic: float) -> None:
        """A fix of `time` was heard at a time of the monotonic clock."""
        offset = time - monotonic
        while self._offsets and self._offsets[-1][1] <= offset:
            self._offsets.pop()
        self._offsets.append((monotonic, offset))
        while self._offsets[0][0] < monotonic - WINDOW:
            self._offsets.popleft()

    def forget(self) -> None:
        """The receiver's time has stepped: what fixes told of it is void."""
        self._offsets.clear()

    def now(self, monotonic: float) -> float:
        """Unix time as the receiver tells it; NaN before the first fix."""
        return monotonic + self._offsets[0][1] + self.latency if self._offsets else math.nan
