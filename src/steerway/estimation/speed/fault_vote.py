"""Two instruments measure one thing, a third cannot tell its value but can tell its changes: who is wrong?

A conflict is a mean difference, over a short or a long while, that their noise does not explain. Wrong is the one whose
offset to the third has changed since a while before.
"""

import math

import numpy as np

from steerway.core.compiled import kernel

CONFLICT = 5.2
"""Standard deviations of a mean difference that call for a vote: one false call in some 10⁶ readings."""
SHORT, LONG = 2.0, 5.0
"""s over which differences are averaged: the short one for steps, the long one for creeping faults."""
LAG = 10.0
"""s before now at which the offsets are taken that a vote compares with."""
THIRD_DRIFT = 0.01
"""1σ by which the third instrument may change over LAG by itself, in the instruments' unit (m/s)."""
CLEAR = 1.5
"""Standard deviations by which one must have moved more than the other; before that nobody is named."""
_ROWS = 1024
"""Readings kept of each instrument: enough for LAG and LONG at 68 Hz."""

NOBODY = -1
_TIME, _OFFSET, _CHANGE = range(3)


class FaultVote:
    """Watches instruments 0 and 1 with white errors of `stds`.

    `excluded` is the one to be left out now, or None; `conflict` whether they differ and it cannot be told who is
    wrong.
    """

    def __init__(self, stds: tuple[float, float]):
        self.stds = stds
        self.excluded: int | None = None
        self.conflict = False
        self._since = -math.inf
        self._kept = np.full((2, _ROWS, 3), -math.inf)  # time, reading − estimate, reading − third (NaN: silent)
        self._last = np.zeros(2, dtype=np.int64)

    def take(self, which: int, time: float, reading: float, estimate: float, third: float) -> None:
        """A reading of instrument `which`, what was expected of it, and what the third instrument says (or NaN)."""
        self._last[which] = (self._last[which] + 1) % _ROWS
        self._kept[which, self._last[which]] = (time, reading - estimate, reading - third)

    def judge(self, time: float) -> tuple[float, float]:
        """Decide anew. Returns, where an instrument has just been excluded, by how much the other one contradicts the
        estimate and over how many s; else NaN.
        """
        before = NOBODY if self.excluded is None else self.excluded
        wrong, self.conflict, misled, window = _judge(self._kept, self._last, time, before, self._since, *self.stds)
        if wrong != before:
            self._since = time
        self.excluded = None if wrong == NOBODY else wrong
        return misled, window


@kernel
def _mean(rows, last, start, stop, column):
    """(mean, number) of the readings with start < time ≤ stop; NaN as soon as one is."""
    total, count = 0.0, 0
    for back in range(_ROWS):
        row = rows[(last - back) % _ROWS]
        if row[_TIME] <= start:
            break
        if row[_TIME] <= stop:
            total += row[column]
            count += 1
    return total / max(count, 1), count


@kernel
def _difference(kept, last, time, window, std, other_std):
    """(mean difference, what noise explains of it) over a window; a window not full explains everything."""
    first, n = _mean(kept[0], last[0], time - window, time, _OFFSET)
    second, m = _mean(kept[1], last[1], time - window, time, _OFFSET)
    full = min(_number_before(kept[0], last[0], time, window), _number_before(kept[1], last[1], time, window))
    if min(n, m) < 2 or full == 0:
        return 0.0, math.inf
    return first - second, CONFLICT * math.sqrt(std**2 / n + other_std**2 / m)


@kernel
def _number_before(rows, last, time, window):
    return _mean(rows, last, time - 1.2 * window, time - window, _OFFSET)[1]


@kernel
def _judge(kept, last, time, excluded, since, std, other_std):
    """(excluded or NOBODY, whether an unsettled conflict stands, misled, window)."""
    if excluded != NOBODY:
        # Back only when the long mean, made of readings since, is well within what noise explains.
        difference, most = _difference(kept, last, time, LONG, std, other_std)
        back = time - since > LONG and most < math.inf and abs(difference) < 0.5 * most
        return (NOBODY if back else excluded), False, math.nan, math.nan
    for window in (SHORT, LONG):
        difference, most = _difference(kept, last, time, window, std, other_std)
        if abs(difference) > most:
            wrong = _wrong(kept, last, time, window, std, other_std)
            if wrong == NOBODY:
                return NOBODY, True, math.nan, math.nan
            misled, n = _mean(kept[1 - wrong], last[1 - wrong], time - window, time, _OFFSET)
            noise = (std if wrong == 1 else other_std) / math.sqrt(n)
            return wrong, False, (misled if abs(misled) > 3.0 * noise else 0.0), window
    return NOBODY, False, math.nan, math.nan


@kernel
def _moved(rows, last, time, window, std):
    """Standard deviations by which the offset to the third has changed since LAG before; NaN where it is not known."""
    now, n = _mean(rows, last, time - window, time, _CHANGE)
    before, m = _mean(rows, last, time - LAG - window, time - LAG, _CHANGE)
    if min(n, m) < 2:
        return math.nan
    return abs(now - before) / math.sqrt(std**2 * (1.0 / n + 1.0 / m) + THIRD_DRIFT**2)


@kernel
def _wrong(kept, last, time, window, std, other_std):
    """The instrument whose offset to the third has clearly moved further, NOBODY where that cannot be told."""
    lead = _moved(kept[0], last[0], time, window, std) - _moved(kept[1], last[1], time, window, other_std)
    if not abs(lead) > CLEAR:
        return NOBODY
    return 0 if lead > 0.0 else 1
