"""Time: what each tick costs and how late it is, in memory of fixed size; and the clock of the fixes."""

import math
import time
from collections import deque

from steerway.core.checks import not_negative

_LEAST, _PER_DECADE, _BINS = 1e-6, 25, 200  # s: from a microsecond to a hundred seconds, each bin a tenth wider
LATE = 0.05
"""s by which a tick may be late."""


class Durations:
    """A histogram of durations, s."""

    def __init__(self) -> None:
        self._counts = [0] * _BINS
        self.longest = 0.0

    def add(self, duration: float) -> None:
        """Add one."""
        place = int(_PER_DECADE * math.log10(max(duration / _LEAST, 1.0)))
        self._counts[min(place, _BINS - 1)] += 1
        self.longest = max(self.longest, duration)

    def within(self, fraction: float) -> float:
        """The quantile of a fraction; NaN without any."""
        left = fraction * sum(self._counts)
        for place, count in enumerate(self._counts):
            left -= count
            if left <= 0.0 and count:
                return min(_LEAST * 10.0 ** ((place + 1) / _PER_DECADE), self.longest)
        return math.nan


class Pulse:
    """Processor time of this thread in a tick, and since the tick before; and how late ticks were."""

    def __init__(self) -> None:
        self.beats = 0
        self.own, self.compute, self.lateness = Durations(), Durations(), Durations()
        self.missed = 0
        self._begun = self._spent = time.thread_time()

    def begin(self) -> None:
        """A tick begins."""
        self._begun = time.thread_time()

    def beat(self, lateness: float) -> None:
        """A tick that was so late (s) ends."""
        spent = time.thread_time()
        self.beats += 1
        self.own.add(spent - self._begun)
        self.compute.add(spent - self._spent)
        self.lateness.add(max(lateness, 0.0))
        self.missed += lateness > LATE
        self._spent = spent

    def __str__(self) -> str:
        spreads = {"each": self.own, "with all else": self.compute, "late by": self.lateness}
        parts = ", ".join(f"{name} {_ms(each)}" for name, each in spreads.items())
        return f"{self.beats} ticks, {parts}, {self.missed} later than {1e3 * LATE:g} ms"


def _ms(durations: Durations) -> str:
    within = (durations.within(0.5), durations.within(0.999), durations.longest)
    return "{:.3g} ms (99.9 %: {:.3g}, at most {:.3g})".format(*(1e3 * each for each in within))


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
