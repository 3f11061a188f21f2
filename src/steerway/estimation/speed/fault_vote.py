"""Fault isolation between two instruments that measure one quantity, by others that measure only its changes.

A conflict is a mean difference of the two, over a short or a long window, that their noise does not explain. The faulty
instrument is the one whose offset to the others has changed, by the likelihood of the changes. Over a short lag,
offsets are relative to a speed integrated from an accelerometer. Over a long lag, they are relative to a third
instrument: the speed of a model, which errs most while the speed changes. The 1σ of the model's drift is the larger of
two values: the recent change that both offsets have in common, and a share of the change of speed.
"""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats, Ints
from steerway.core.compiled import kernel
from steerway.core.errors import InputError

CONFLICT = 5.2
"""Least mean difference, in its σ, for a vote: about one false vote in 10⁶ readings. The normal distribution has 2·10⁻⁷
beyond it in both tails; two windows are judged."""
SHORT, LONG = 2.0, 5.0
"""Windows, s, over which differences are averaged: a short one for steps, a long one for drifts. `steerway study
adaptive-speed` judges these and the numbers below."""
LAG = 10.0
"""Time, s, between the two windows whose offsets a vote compares."""
THIRD_DRIFT = 0.01
"""Least 1σ of the third instrument's own drift over LAG, in the instruments' unit (m/s)."""
MODEL_SHARE = 0.1
"""1σ of the third instrument's drift over LAG, as a share of the change of speed."""
REMEMBERED = 15.0
"""Time constant (s) with which a larger drift of the third instrument is forgotten."""
SHORT_LAG, INERTIAL_DRIFT = 3.0, 0.012
"""Time, s, between the two windows of the integrated acceleration, and 1σ of its own drift in this time, m/s."""
SUDDEN = 0.7
"""The accelerometer votes only if at least this share of a difference is newer than SHORT_LAG."""
SURE = 6.0
"""Least size of this newer part, in its σ: a noisy mean during a slow ramp does not count as a step."""
CLEAR = 3.0
"""Least log likelihood ratio of the two instruments for a decision: odds of 20 to 1."""
_ROWS = 1024
"""Readings kept of each instrument: enough for LAG and LONG at 68 Hz."""

NONE = -1
_TIME, _OFFSET, _THIRD, _INERTIAL, _READING = range(5)


class _Record(NamedTuple):
    """Readings of both instruments up to now."""

    time: float  # now
    rows: Floats  # (2, _ROWS, 5): time, reading − estimate, − third, − inertial (NaN: none); reading
    last: Ints  # (2,) the latest row of each
    stds: tuple[float, float]


class FaultVote:
    """Compares instruments 0 and 1, whose white errors have the 1σ `stds`.

    `excluded` is the faulty instrument, or None; `conflict`: they differ, and the faulty one cannot be identified.
    """

    def __init__(self, stds: tuple[float, float]) -> None:
        self.stds = stds
        self.excluded: int | None = None
        self.conflict = False
        self._since = -math.inf
        self._kept = np.full((2, _ROWS, 5), -math.inf)
        self._last = np.zeros(2, dtype=np.int64)
        self._drift, self._judged = 0.0, math.nan

    def take(
        self, which: int, time: float, reading: float, estimate: float, third: float, inertial: float = math.nan
    ) -> None:
        """Take a reading of instrument `which` (0 or 1), and what it is compared with: the filter's `estimate` of the
        speed, the reading of the `third` instrument, and `inertial`, an integrated accelerometer (NaN: none)."""
        if which not in (0, 1):
            raise InputError(f"fault_vote.which is {which}, expected 0 or 1")
        self._last[which] = (self._last[which] + 1) % _ROWS
        self._kept[which, self._last[which]] = (time, reading - estimate, reading - third, reading - inertial, reading)

    def judge(self, time: float, explained: float = 0.0) -> tuple[float, float]:
        """Vote again. If an instrument has just been excluded, returns the mean difference of the other one from the
        estimate (0 within its noise) and the window (s); else NaN. `explained`: 1σ of differences beside noise.
        """
        before = NONE if self.excluded is None else self.excluded
        elapsed = 0.0 if math.isnan(self._judged) else time - self._judged
        record = _Record(time, self._kept, self._last, self.stds)
        self._drift = max(_common(record), self._drift * math.exp(-elapsed / REMEMBERED))
        self._judged = time
        wrong, self.conflict, misled, window = _judge(record, before, self._since, explained, self._drift)
        if wrong != before:
            self._since = time
        self.excluded = None if wrong == NONE else wrong
        return misled, window


@kernel
def _mean(record: _Record, which: int, window: float, ago: float, column: int) -> tuple[float, int]:
    """(mean, number) of an instrument's readings in a window (s) that ended some time `ago`; NaN if any is."""
    rows, last, stop = record.rows[which], record.last[which], record.time - ago
    total, count = 0.0, 0
    for back in range(_ROWS):
        row = rows[(last - back) % _ROWS]
        if row[_TIME] <= stop - window:
            break
        if row[_TIME] <= stop:
            total += row[column]
            count += 1
    return total / max(count, 1), count


@kernel
def _difference(record: _Record, window: float, explained: float) -> tuple[float, float]:
    """(mean difference, largest one that noise explains) over a window; the latter is ∞ until the window is full."""
    first, n = _mean(record, 0, window, 0.0, _OFFSET)
    second, m = _mean(record, 1, window, 0.0, _OFFSET)
    before = min(_mean(record, 0, 0.2 * window, window, _OFFSET)[1], _mean(record, 1, 0.2 * window, window, _OFFSET)[1])
    if min(n, m) < 2 or before == 0:
        return 0.0, math.inf
    return first - second, CONFLICT * math.sqrt(record.stds[0] ** 2 / n + record.stds[1] ** 2 / m + explained**2)


@kernel
def _judge(
    record: _Record, excluded: int, since: float, explained: float, drift: float
) -> tuple[int, bool, float, float]:
    """(excluded or NONE, whether a conflict is unsettled, mean difference and window as in `FaultVote.judge`)."""
    if excluded != NONE:
        # Readmitted only when the long mean, made of readings since, is well within what noise explains.
        difference, most = _difference(record, LONG, explained)
        back = record.time - since > LONG and most < math.inf and abs(difference) < 0.5 * most
        return (NONE if back else excluded), False, math.nan, math.nan
    conflict = False
    for window in (SHORT, LONG):
        difference, most = _difference(record, window, explained)
        if abs(difference) > most:
            wrong = _wrong(record, window, drift)
            conflict = True
            if wrong != NONE:
                misled, n = _mean(record, 1 - wrong, window, 0.0, _OFFSET)
                noise = record.stds[1 - wrong] / math.sqrt(n)
                return wrong, False, (misled if abs(misled) > 3.0 * noise else 0.0), window
    return NONE, conflict, math.nan, math.nan


@kernel
def _change(record: _Record, which: int, window: float, lag: float, column: int) -> tuple[float, float]:
    """(change of an offset over a lag, its variance relative to that of one reading); NaN where it is not known."""
    now, n = _mean(record, which, window, 0.0, column)
    before, m = _mean(record, which, window, lag, column)
    if min(n, m) < 2:
        return math.nan, math.inf
    return now - before, 1.0 / n + 1.0 / m


@kernel
def _common(record: _Record) -> float:
    """The smaller change of the two offsets to the third instrument; 0 if it is unknown."""
    common = min(abs(_change(record, 0, SHORT, LAG, _THIRD)[0]), abs(_change(record, 1, SHORT, LAG, _THIRD)[0]))
    return common if math.isfinite(common) else 0.0


@kernel
def _likelihood(record: _Record, window: float, lag: float, column: int, drift: float) -> float:
    """Log likelihood ratio of a fault of instrument 0 to a fault of instrument 1; 0 if it is unknown."""
    first, n = _change(record, 0, window, lag, column)
    second, m = _change(record, 1, window, lag, column)
    if not (math.isfinite(first) and math.isfinite(second)):
        return 0.0
    std, other_std = record.stds
    return 0.5 * (first**2 / (std**2 * n + drift**2) - second**2 / (other_std**2 * m + drift**2))


@kernel
def _wrong(record: _Record, window: float, drift: float) -> int:
    """The instrument whose offsets to the others have clearly changed more; NONE if neither has."""
    faster, _ = _change(record, 0, window, LAG, _READING)
    other, _ = _change(record, 1, window, LAG, _READING)
    drift = max(drift, MODEL_SHARE * min(abs(faster), abs(other)), THIRD_DRIFT)
    lead = _likelihood(record, window, LAG, _THIRD, drift)
    # An accelerometer shows sudden faults only: slow ones enter the estimate of its bias.
    first, n = _change(record, 0, SHORT, SHORT_LAG, _OFFSET)
    second, m = _change(record, 1, SHORT, SHORT_LAG, _OFFSET)
    difference, _ = _difference(record, SHORT, 0.0)
    noise = math.sqrt(record.stds[0] ** 2 * n + record.stds[1] ** 2 * m)
    if abs(first - second) > max(SUDDEN * abs(difference), SURE * noise):
        lead += _likelihood(record, SHORT, SHORT_LAG, _INERTIAL, INERTIAL_DRIFT)
    if not abs(lead) > CLEAR:
        return NONE
    return 0 if lead > 0.0 else 1
