"""Fault isolation: two instruments measure one quantity, a third its changes only; which of the two is faulty?

A conflict is a mean difference, over a short or a long window, that their noise does not explain. The faulty one is the
one whose offset to the third has changed.
"""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.errors import InputError

CONFLICT = 5.2
"""Standard deviations of a mean difference that call for a vote: one false call in some 10⁶ readings."""
SHORT, LONG = 2.0, 5.0
"""s over which differences are averaged: the short one for steps, the long one for drifts."""
LAG = 10.0
"""s between the two windows whose offsets a vote compares."""
THIRD_DRIFT = 0.01
"""1σ of the third instrument's own drift over LAG, in the instruments' unit (m/s)."""
CLEAR = 1.5
"""Standard deviations by which one must have changed more than the other for a decision."""
_ROWS = 1024
"""Readings kept of each instrument: enough for LAG and LONG at 68 Hz."""

NONE = -1
_TIME, _OFFSET, _CHANGE = range(3)


class FaultVote:
    """Compares instruments 0 and 1 with white errors of `stds`.

    `excluded` is the faulty one, or None; `conflict` whether they differ and the faulty one cannot be identified.
    """

    def __init__(self, stds: tuple[float, float]) -> None:
        self.stds = stds
        self.excluded: int | None = None
        self.conflict = False
        self._since = -math.inf
        self._kept = np.full((2, _ROWS, 3), -math.inf)  # time, reading − estimate, reading − third (NaN: none)
        self._last = np.zeros(2, dtype=np.int64)

    def take(self, which: int, time: float, reading: float, estimate: float, third: float) -> None:
        """A reading of instrument `which` (0 or 1), the estimate of it, and the third instrument's reading (or NaN)."""
        if which not in (0, 1):
            raise InputError(f"fault_vote.which is {which}, expected 0 or 1")
        self._last[which] = (self._last[which] + 1) % _ROWS
        self._kept[which, self._last[which]] = (time, reading - estimate, reading - third)

    def judge(self, time: float) -> tuple[float, float]:
        """Decide anew. Returns, where an instrument has just been excluded, the other one's mean difference from the
        estimate and the window (s); else NaN.
        """
        before = NONE if self.excluded is None else self.excluded
        wrong, self.conflict, misled, window = _judge(self._kept, self._last, time, before, self._since, *self.stds)
        if wrong != before:
            self._since = time
        self.excluded = None if wrong == NONE else wrong
        return misled, window


@kernel
def _mean(rows: Floats, last: int, start: float, stop: float, column: int) -> tuple[float, int]:
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
def _difference(
    kept: Floats, last: NDArray[np.int64], time: float, window: float, std: float, other_std: float
) -> tuple[float, float]:
    """(mean difference, the part that noise explains) over a window; a window not full explains everything."""
    first, n = _mean(kept[0], last[0], time - window, time, _OFFSET)
    second, m = _mean(kept[1], last[1], time - window, time, _OFFSET)
    full = min(_number_before(kept[0], last[0], time, window), _number_before(kept[1], last[1], time, window))
    if min(n, m) < 2 or full == 0:
        return 0.0, math.inf
    return first - second, CONFLICT * math.sqrt(std**2 / n + other_std**2 / m)


@kernel
def _number_before(rows: Floats, last: int, time: float, window: float) -> int:
    return _mean(rows, last, time - 1.2 * window, time - window, _OFFSET)[1]


@kernel
def _judge(
    kept: Floats, last: NDArray[np.int64], time: float, excluded: int, since: float, std: float, other_std: float
) -> tuple[int, bool, float, float]:
    """(excluded or NONE, whether an unsettled conflict stands, misled, window)."""
    if excluded != NONE:
        # Readmitted only when the long mean, made of readings since, is well within what noise explains.
        difference, most = _difference(kept, last, time, LONG, std, other_std)
        back = time - since > LONG and most < math.inf and abs(difference) < 0.5 * most
        return (NONE if back else excluded), False, math.nan, math.nan
    for window in (SHORT, LONG):
        difference, most = _difference(kept, last, time, window, std, other_std)
        if abs(difference) > most:
            wrong = _wrong(kept, last, time, window, std, other_std)
            if wrong == NONE:
                return NONE, True, math.nan, math.nan
            misled, n = _mean(kept[1 - wrong], last[1 - wrong], time - window, time, _OFFSET)
            noise = (std if wrong == 1 else other_std) / math.sqrt(n)
            return wrong, False, (misled if abs(misled) > 3.0 * noise else 0.0), window
    return NONE, False, math.nan, math.nan


@kernel
def _moved(rows: Floats, last: int, time: float, window: float, std: float) -> float:
    """Standard deviations by which the offset to the third has changed since LAG before; NaN where it is not known."""
    now, n = _mean(rows, last, time - window, time, _CHANGE)
    before, m = _mean(rows, last, time - LAG - window, time - LAG, _CHANGE)
    if min(n, m) < 2:
        return math.nan
    return abs(now - before) / math.sqrt(std**2 * (1.0 / n + 1.0 / m) + THIRD_DRIFT**2)


@kernel
def _wrong(kept: Floats, last: NDArray[np.int64], time: float, window: float, std: float, other_std: float) -> int:
    """The instrument whose offset to the third has clearly moved further, NONE where that is not clear."""
    lead = _moved(kept[0], last[0], time, window, std) - _moved(kept[1], last[1], time, window, other_std)
    if not abs(lead) > CLEAR:
        return NONE
    return 0 if lead > 0.0 else 1
