"""The errors of a receiver from its fixes alone: white noise, and a slow error that wanders in seconds.

White noise is estimated from third differences, in which the boat's motion is small. The slow error is the part of the
residuals about a smooth path of `_PATH` s that white noise does not explain.
"""

import math
from collections import deque
from collections.abc import Collection

import numpy as np

_KEPT, _LEAST = 200, 12
"""Number of third differences of which the median is taken, and the least number. Chosen: at best, the noise is known
to 5 % with the first number and to 21 % with the second, 1/(2 ln 2 √n)."""
_REGULAR = 0.2
"""Relative difference of intervals above which fixes are unevenly spaced. Chosen: one lost fix is a difference of 1."""
_SPREAD = 20.0 * 2.0 * math.log(2.0)
"""Ratio of the median of the squared third difference, summed over two axes, to the variance of the white noise. It is
the sum of the squared binomial coefficients, 20, times the median of χ²₂.
"""
_PATH, _EVERY, _PATHS = 10.0, 2.0, 15
"""Length of a path, s, which is a parabola in either axis; time between two paths, s; and number of paths kept. Chosen:
most stretches of 38 s are straight."""
_SURE = 1.2
"""Ratio of the residuals to the white noise above which there is a slow error. In 30 records of 60 s of white noise
alone, 1 at 1 Hz and none at 5 Hz shows a slow error; with a ratio of 1, 14 at 1 Hz and 12 at 5 Hz do."""
_LEFT = 0.3
"""Share of the variance of a slow error that remains in the residuals. For a first-order Gauss–Markov process of 5 s it
is 0.23 with fixes at 1 Hz and 0.17 at 10 Hz (trace of residual projection times covariance). Chosen above both, so that
`slow` is low. For 0.25 m beside white noise of 0.05 m, `slow` is 0.6 of the true value at 5 Hz and 0.3 at 1 Hz (median
of 30 records of 60 s); with a share of 0.2, 0.74 and 0.34."""


class ReceiverNoise:
    """Estimates 1σ of white noise (`white`) and slow error (`slow`) in one axis, m; NaN until there are enough
    fixes."""

    def __init__(self) -> None:
        self.white = self.slow = math.nan
        self._fixes: deque[tuple[float, float, float]] = deque()
        self._squares: deque[float] = deque(maxlen=_KEPT)
        self._paths: deque[float] = deque(maxlen=_PATHS)
        self._next_path = -math.inf

    def add(self, time: float, north: float, east: float) -> None:
        """Add a fix: time (s), position (m)."""
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
