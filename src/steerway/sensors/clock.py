"""When an instrument reads: at the first step at or after each multiple of its period, in a loop and in a record."""

import math

import numpy as np

from steerway.core.errors import InputError

SLACK = 1e-3  # of a period: clocks that count in tenths do not land on their tenths


class Clock:
    """Decides at every step whether a reading is due; periods are counted from the first."""

    def __init__(self, rate: float):
        self._rate = rate
        self._began = None
        self._next = -math.inf

    def due(self, time: float) -> bool:
        if time < self._next:
            return False
        if self._began is None:
            self._began = time
        count = math.floor((time - self._began) * self._rate + SLACK)
        self._next = self._began + (count + 1.0 - SLACK) / self._rate
        return True


def epochs(time: np.ndarray, rate: float) -> np.ndarray:
    """Indices of the samples (n,) at which a `Clock` is due.

    Raises InputError when the time does not rise or the samples are further apart than the readings.
    """
    if len(time) == 0:
        return np.zeros(0, dtype=np.int64)
    steps = np.diff(time)
    if len(steps) and not steps.min() > 0.0:
        raise InputError("the time of the true motion does not rise, expected rising seconds")
    if len(steps) and steps.max() * rate > 1.0 + SLACK:
        raise InputError(f"the true motion comes every {steps.max():g} s, expected at least every {1.0 / rate:g} s")
    count = np.floor((time - time[0]) * rate + SLACK)
    return np.flatnonzero(np.diff(count, prepend=-1.0) > 0.0)
