"""Timing of ticks: their processor time and lateness, in memory of fixed size; and the time of the receiver."""

import math
import time
from collections import deque

from steerway.core.checks import not_negative

_LEAST, _PER_DECADE, _BINS = 1e-6, 25, 200  # bins from 1 µs to 100 s, each 10 % wider than the one before
LATE = 0.05
"""Lateness above which a tick counts as missed, s."""


class Durations:
    """A histogram of durations, s."""

    def __init__(self) -> None:
        self._counts = [0] * _BINS
        self.longest = 0.0

    def add(self, duration: float) -> None:
        """Add a duration, s."""
        place = int(_PER_DECADE * math.log10(max(duration / _LEAST, 1.0)))
        self._counts[min(place, _BINS - 1)] += 1
        self.longest = max(self.longest, duration)

    def within(self, fraction: float) -> float:
        """The quantile at a fraction (0 to 1), s; NaN without durations."""
        left = fraction * sum(self._counts)
        for place, count in enumerate(self._counts):
            left -= count
            if left <= 0.0 and count:
                return min(_LEAST * 10.0 ** ((place + 1) / _PER_DECADE), self.longest)
        return math.nan


class Pulse:
    """Processor time of this thread in each tick and from tick to tick; and the lateness of ticks."""

    def __init__(self) -> None:
        self.beats = 0
        self.own, self.compute, self.lateness = Durations(), Durations(), Durations()
        self.missed = 0
        self._begun = self._spent = time.thread_time()

    def begin(self) -> None:
        """A tick begins."""
        self._begun = time.thread_time()

    def beat(self, lateness: float) -> None:
        """A tick ends that began `lateness` s late."""
        spent = time.thread_time()
        self.beats += 1
        self.own.add(spent - self._begun)
        self.compute.add(spent - self._spent)
        self.lateness.add(max(lateness, 0.0))
        self.missed += lateness > LATE
        self._spent = spent

    def __str__(self) -> str:
        spreads = {"processor time": self.own, "from tick to tick": self.compute, "lateness": self.lateness}
        parts = ", ".join(f"{name} {_ms(each)}" for name, each in spreads.items())
        return f"{self.beats} ticks, {parts}, {self.missed} later than {1e3 * LATE:g} ms"


def _ms(durations: Durations) -> str:
    within = (durations.within(0.5), durations.within(0.999), durations.longest)
    return "{:.3g} ms (99.9 %: {:.3g}, at most {:.3g})".format(*(1e3 * each for each in within))


WINDOW = 30.0
"""Time for which the offset of a fix is used, s. Older offsets are dropped, because clocks drift."""


class FixClock:
    """Receiver time by the monotonic clock. The fix with the lowest latency sets the offset; `latency` (s) is that
    latency, from the moment of the fix to its arrival, 0 if unknown."""

    def __init__(self, latency: float = 0.0):
        self.latency = not_negative("latency", latency)
        self._offsets: deque[tuple[float, float]] = deque()  # (arrival, offset), offsets decreasing

    def add(self, time: float, monotonic: float) -> None:
        """Add a fix at `time` (Unix, s) that arrived at `monotonic` (s)."""
        offset = time - monotonic
        while self._offsets and self._offsets[-1][1] <= offset:
            self._offsets.pop()
        self._offsets.append((monotonic, offset))
        while self._offsets[0][0] < monotonic - WINDOW:
            self._offsets.popleft()

    def forget(self) -> None:
        """Drop all offsets: the receiver's time has stepped."""
        self._offsets.clear()

    def now(self, monotonic: float) -> float:
        """Unix time (s) by the receiver; NaN before the first fix."""
        return monotonic + self._offsets[0][1] + self.latency if self._offsets else math.nan
