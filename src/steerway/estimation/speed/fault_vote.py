"""Fault isolation: two instruments measure one quantity, others its changes only; which of the two is faulty?

A conflict is a mean difference, over a short or a long window, that their noise does not explain. The faulty one is the
one whose offset to the others has changed, by the likelihood of the offsets' changes: over a short lag those to a speed
integrated from an accelerometer, over a long one those to a third instrument. The third is a model's speed that may be
wrong, most so while the speed changes: its drift is what both offsets have lately had in common, and a share of what
the speed has changed by.
"""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.errors import InputError

CONFLICT = 5.2
"""Standard deviations of a mean difference that call for a vote: one false call in some 10⁶ readings. The normal
distribution holds 2·10⁻⁷ beyond in both tails; two windows are judged."""
SHORT, LONG = 2.0, 5.0
"""s over which differences are averaged: the short one for steps, the long one for drifts. Chosen, as the numbers
below; `steerway study adaptive-speed` judges them."""
LAG = 10.0
"""s between the two windows whose offsets a vote compares."""
THIRD_DRIFT = 0.01
"""Least 1σ of the third instrument's own drift over LAG, in the instruments' unit (m/s)."""
MODEL_SHARE = 0.1
"""1σ of the third's drift over LAG as a part of what the speed has changed by."""
REMEMBERED = 15.0
"""s in which a larger drift of the third is forgotten to 1/e."""
SHORT_LAG, INERTIAL_DRIFT = 3.0, 0.012
"""s between the two windows of the integrated acceleration, and 1σ of its own drift over them (m/s)."""
SUDDEN = 0.7
"""Part of a difference that has to be newer than SHORT_LAG for the accelerometer to be used."""
SURE = 6.0
"""Standard deviations by which it has to be: a noisy mean beside a slow ramp is not taken for a step."""
CLEAR = 3.0
"""Logarithm of the likelihood ratio of the two for a decision: odds of 20 to 1."""
_ROWS = 1024
"""Readings kept of each instrument: enough for LAG and LONG at 68 Hz."""

NONE = -1
_TIME, _OFFSET, _THIRD, _INERTIAL, _READING = range(5)


class FaultVote:
    """Compares instruments 0 and 1 with white errors of `stds`.

    `excluded` is the faulty one, or None; `conflict` whether they differ and the faulty one cannot be identified.
    """

    def __init__(self, stds: tuple[float, float]) -> None:
        self.stds = stds
        self.excluded: int | None = None
        self.conflict = False
        self._since = -math.inf
        self._kept = np.full(
            (2, _ROWS, 5), -math.inf
        )  # time, reading − estimate, − third, − inertial (NaN: none); reading
        self._last = np.zeros(2, dtype=np.int64)
        self._drift, self._judged = 0.0, math.nan

    def take(
        self, which: int, time: float, reading: float, estimate: float, third: float, inertial: float = math.nan
    ) -> None:
        """A reading of instrument `which` (0 or 1), the estimate of it, the third instrument's reading and the speed
        integrated from an accelerometer, whose constant is of no account (NaN: none)."""
        if which not in (0, 1):
            raise InputError(f"fault_vote.which is {which}, expected 0 or 1")
        self._last[which] = (self._last[which] + 1) % _ROWS
        self._kept[which, self._last[which]] = (time, reading - estimate, reading - third, reading - inertial, reading)

    def judge(self, time: float, explained: float = 0.0) -> tuple[float, float]:
        """Decide anew. Returns, where an instrument has just been excluded, the other one's mean difference from the
        estimate and the window (s); else NaN. `explained`: 1σ of what the instruments may differ by besides noise.
        """
        before = NONE if self.excluded is None else self.excluded
        elapsed = 0.0 if math.isnan(self._judged) else time - self._judged
        common = _common(self._kept, self._last, time)
        self._drift = max(common, self._drift * math.exp(-elapsed / REMEMBERED))
        self._judged = time
        wrong, self.conflict, misled, window = _judge(
            self._kept, self._last, time, before, self._since, *self.stds, explained, self._drift
        )
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
    kept: Floats, last: NDArray[np.int64], time: float, window: float, std: float, other_std: float, explained: float
) -> tuple[float, float]:
    """(mean difference, the part that noise explains) over a window; a window not full explains everything."""
    first, n = _mean(kept[0], last[0], time - window, time, _OFFSET)
    second, m = _mean(kept[1], last[1], time - window, time, _OFFSET)
    full = min(_number_before(kept[0], last[0], time, window), _number_before(kept[1], last[1], time, window))
    if min(n, m) < 2 or full == 0:
        return 0.0, math.inf
    return first - second, CONFLICT * math.sqrt(std**2 / n + other_std**2 / m + explained**2)


@kernel
def _number_before(rows: Floats, last: int, time: float, window: float) -> int:
    return _mean(rows, last, time - 1.2 * window, time - window, _OFFSET)[1]


@kernel
def _judge(
    kept: Floats,
    last: NDArray[np.int64],
    time: float,
    excluded: int,
    since: float,
    std: float,
    other_std: float,
    explained: float,
    drift: float,
) -> tuple[int, bool, float, float]:
    """(excluded or NONE, whether an unsettled conflict stands, misled, window)."""
    if excluded != NONE:
        # Readmitted only when the long mean, made of readings since, is well within what noise explains.
        difference, most = _difference(kept, last, time, LONG, std, other_std, explained)
        back = time - since > LONG and most < math.inf and abs(difference) < 0.5 * most
        return (NONE if back else excluded), False, math.nan, math.nan
    conflict = False
    for window in (SHORT, LONG):
        difference, most = _difference(kept, last, time, window, std, other_std, explained)
        if abs(difference) > most:
            wrong = _wrong(kept, last, time, window, std, other_std, drift)
            conflict = True
            if wrong != NONE:
                misled, n = _mean(kept[1 - wrong], last[1 - wrong], time - window, time, _OFFSET)
                noise = (std if wrong == 1 else other_std) / math.sqrt(n)
                return wrong, False, (misled if abs(misled) > 3.0 * noise else 0.0), window
    return NONE, conflict, math.nan, math.nan


@kernel
def _change(rows: Floats, last: int, time: float, window: float, lag: float, column: int) -> tuple[float, float]:
    """(change of an offset over a lag, its variance in units of one reading's); NaN where it is not known."""
    now, n = _mean(rows, last, time - window, time, column)
    before, m = _mean(rows, last, time - lag - window, time - lag, column)
    if min(n, m) < 2:
        return math.nan, math.inf
    return now - before, 1.0 / n + 1.0 / m


@kernel
def _common(kept: Floats, last: NDArray[np.int64], time: float) -> float:
    """What the offsets of both to the third have changed by, the lesser of the two; 0 where it is not known."""
    first, _ = _change(kept[0], last[0], time, SHORT, LAG, _THIRD)
    second, _ = _change(kept[1], last[1], time, SHORT, LAG, _THIRD)
    common = min(abs(first), abs(second))
    return common if math.isfinite(common) else 0.0


@kernel
def _likelihood(
    kept: Floats,
    last: NDArray[np.int64],
    time: float,
    window: float,
    lag: float,
    column: int,
    stds: tuple[float, float],
    drift: float,
) -> float:
    """Logarithm of the likelihood that 0 is faulty and 1 is not over that of the opposite; 0 where nothing is known."""
    first, n = _change(kept[0], last[0], time, window, lag, column)
    second, m = _change(kept[1], last[1], time, window, lag, column)
    if not (math.isfinite(first) and math.isfinite(second)):
        return 0.0
    drifted = drift**2
    return 0.5 * (first**2 / (stds[0] ** 2 * n + drifted) - second**2 / (stds[1] ** 2 * m + drifted))


@kernel
def _wrong(
    kept: Floats, last: NDArray[np.int64], time: float, window: float, std: float, other_std: float, drift: float
) -> int:
    """The instrument whose offsets to the others have clearly changed more, NONE where that is not clear."""
    stds = (std, other_std)
    faster, _ = _change(kept[0], last[0], time, window, LAG, _READING)
    other, _ = _change(kept[1], last[1], time, window, LAG, _READING)
    drift = max(drift, MODEL_SHARE * min(abs(faster), abs(other)), THIRD_DRIFT)
    lead = _likelihood(kept, last, time, window, LAG, _THIRD, stds, drift)
    # An accelerometer shows sudden faults only: slow ones enter the estimate of its bias.
    first, n = _change(kept[0], last[0], time, SHORT, SHORT_LAG, _OFFSET)
    second, m = _change(kept[1], last[1], time, SHORT, SHORT_LAG, _OFFSET)
    difference, _ = _difference(kept, last, time, SHORT, std, other_std, 0.0)
    noise = math.sqrt(std**2 * n + other_std**2 * m)
    if abs(first - second) > max(SUDDEN * abs(difference), SURE * noise):
        lead += _likelihood(kept, last, time, SHORT, SHORT_LAG, _INERTIAL, stds, INERTIAL_DRIFT)
    if not abs(lead) > CLEAR:
        return NONE
    return 0 if lead > 0.0 else 1
