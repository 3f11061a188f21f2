"""The errors of a receiver from its fixes alone: white noise, and a slow error that wanders in seconds.

White noise is what third differences show, in which the boat's motion is small; the slow error is what is left beside
it of the fixes around a smooth path of `_PATH` s.
"""

import math
from collections import deque
from collections.abc import Collection

import numpy as np

_KEPT, _LEAST = 200, 12
"""Third differences of which the median is taken, and how many there have to be. Chosen: the noise is then
known to 5 and 21 % at best, 1/(2 ln 2 √n)."""
_REGULAR = 0.2
"""Relative difference of intervals above which fixes are not evenly spaced. Chosen: one lost fix is 1."""
_SPREAD = 20.0 * 2.0 * math.log(2.0)
"""Median of the squared third difference of two axes over the variance: Σ of the binomials' squares, times that of
χ²₂.
"""
_PATH, _EVERY, _PATHS = 10.0, 2.0, 15
"""s of a path, a parabola in either axis; s between two; how many are kept. Chosen: of 38 s most
are straight."""
_SURE = 1.2
"""Ratio to the white noise above which there is a slow error: of 30 records of 60 s of white noise alone 1 at 1 Hz and
none at 5 Hz shows one; with a factor of 1, 14 and 12 do."""
_LEFT = 0.3
"""Share of the variance of a slow error that such a path leaves. Chosen: of a first-order Gauss-Markov process of 5 s
it is 0.23 with fixes at 1 Hz, 0.17 at 10 Hz (trace of residual projection times covariance), so that `slow` is low:
0.6 of 0.25 m beside white noise of 0.05 m at 5 Hz, 0.3 at 1 Hz (median of 30 records of 60 s; 0.74, 0.34 with 0.2)."""


class ReceiverNoise:
    """`add` fixes; `white` and `slow` are 1σ of one axis, m, NaN before there are enough."""

    def __init__(self) -> None:
        self.white = self.slow = math.nan
        self._fixes: deque[tuple[float, float, float]] = deque()
        self._squares: deque[float] = deque(maxlen=_KEPT)
        self._paths: deque[float] = deque(maxlen=_PATHS)
        self._next_path = -math.inf

    def add(self, time: float, north: float, east: float) -> None:
        """A fix: s, m."""
        if self._fixes and not 0.0 < time - self._fixes[-1][0] < _PATH:
            self._fixes.clear()
        self._fixes.append((time, north, east))
        while time - self._fixes[0][0] > _PATH:
            self._fixes.popleft()
        if len(self._fixes) < 4:
            return
        self._third_difference()
        if time >= self._next_path and time - self._fixes[0][0] > 0.8 * _PATH and len(self._fixes) > 6:
            self._next_path = time + _EVERY
            self._path()

    def _third_difference(self) -> None:
        (t0, n0, e0), (t1, n1, e1), (t2, n2, e2), (t3, n3, e3) = (self._fixes[k] for k in (-4, -3, -2, -1))
        steps = t1 - t0, t2 - t1, t3 - t2
        if max(steps) > (1.0 + _REGULAR) * min(steps):
            return
        self._squares.append((n3 - 3.0 * (n2 - n1) - n0) ** 2 + (e3 - 3.0 * (e2 - e1) - e0) ** 2)
        if len(self._squares) >= _LEAST:
            self.white = math.sqrt(_median(self._squares) / _SPREAD)

    def _path(self) -> None:
        time, *axes = np.array(self._fixes).T
        design = np.vander((time - time[-1]) / _PATH, 3)
        left = 0.0
        for axis in axes:
            fitted, *_ = np.linalg.lstsq(design, axis - axis[-1], rcond=None)
            left += float(np.sum((axis - axis[-1] - design @ fitted) ** 2)) / (2.0 * (len(time) - 3))
        self._paths.append(left)
        if not math.isnan(self.white) and len(self._paths) >= 3:
            beyond = _median(self._paths) - (_SURE * self.white) ** 2
            self.slow = math.sqrt(max(beyond, 0.0) / _LEFT)


def _median(values: Collection[float]) -> float:
    return sorted(values)[len(values) // 2]
