"""The reference of a log, a velocity that does not come from its positions: its spikes, its noise and its lags.

Lags of a reference behind the positions are found without any filter's estimate, so that they favour no filter.

A displacement is the integral of the velocity over the same time. The lag found is the one with the least mean clipped
difference between the two. A lag is used only if it lowers this mean by at least 1 %.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from steerway.core import wrap_array

MOST_ACCELERATION = 30.0
"""Largest acceleration, m/s², of a reference. A faster change is a spike of its receiver: neither boats nor sailors
accelerate at three times gravity, and recorded spikes are ten times larger."""
WORST_ACCURACY = 1.5  # m/s, as the receiver states it
_AROUND_SPIKES = 1.0  # s
_WAY = 0.6  # m/s: the noise of a course is determined above this speed
_QUARTILE_OF_NORMAL = 0.3186
_THIRD_DIFFERENCE = math.sqrt(20.0)
_FEWEST = 30
_LONGEST_LINE = 1.0  # s: rows that are not farther apart are interpolated, whatever the usual interval


@dataclass(frozen=True, eq=False)
class VelocityReference:
    """Speed, course and rate of another instrument than the one that gives the positions, or of the same (`own`).

    Shapes: all (n,); time ascends strictly. NaN where unknown. The speed is late by `lag` s, the course by another
    `course_lag` s, the rate by `rate_lag` s. `lasting`: 1σ (m/s) of errors that last over several rows, if known.
    """

    time: np.ndarray
    sog: np.ndarray
    cog: np.ndarray
    rate: np.ndarray
    own: bool = True
    lag: float = 0.0
    rate_lag: float = 0.0
    course_lag: float = 0.0
    lasting: float = 0.0

    def believed(self, accuracy: np.ndarray | None = None) -> Self:
        """The reference without the rows around spikes and without those of poor stated accuracy (m/s).

        The decision uses the reference alone, not its agreement with the positions.
        """
        known = np.flatnonzero(np.isfinite(self.sog))
        time, sog, cog = self.time[known], self.sog[known], self.cog[known]
        turn = np.where(np.isfinite(np.diff(cog)), np.diff(cog), 0.0)
        change = np.abs(sog[1:] * np.exp(1j * turn) - sog[:-1]) / np.diff(time)
        bad = near(self.time, time[1:][change > MOST_ACCELERATION], _AROUND_SPIKES)
        if accuracy is not None:
            bad |= accuracy > WORST_ACCURACY
        return replace(self, sog=np.where(bad, np.nan, self.sog), cog=np.where(bad, np.nan, self.cog))

    def at(self, time) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """SOG, COG and rate at other times, interpolated linearly and corrected for the lags."""
        moved = time + self.lag
        rate = line(time + self.rate_lag, self.time, self.rate)
        return line(moved, self.time, self.sog), self._course(moved), rate

    def _course(self, time):
        """COG, corrected for the course's additional lag, at times of the speed."""
        east, north = (line(time + self.course_lag, self.time, f(self.cog)) for f in (np.sin, np.cos))
        return np.arctan2(east, north)

    def travelled(self, begin, end) -> tuple[np.ndarray, np.ndarray]:
        """North and east (m) travelled between two times, from the velocity corrected for lag; NaN without a course."""
        return tuple(each.between(begin + self.lag, end + self.lag) for each in self._ways[:2])

    def way(self, begin, end) -> np.ndarray:
        """Distance (m) travelled between two times, from the speed corrected for lag."""
        return self._ways[2].between(begin + self.lag, end + self.lag)

    @cached_property
    def _ways(self) -> tuple["Integral", ...]:
        cog = self._course(self.time) if self.course_lag else self.cog
        speeds = self.sog * np.cos(cog), self.sog * np.sin(cog), self.sog
        return tuple(Integral(self.time, each) for each in speeds)

    @cached_property
    def noise(self) -> tuple[float, float, float]:
        """1σ of the reference's noise: SOG (m/s), velocity across the course (m/s), rate (rad/s).

        The white part is from the lower quartile of the size of third differences, in which motion does not matter. It
        is at least the rounding error. Errors that last over several rows are `lasting` only.
        """
        fast = np.where(self.sog > _WAY, self.sog, np.nan)
        changes = np.diff(self.sog), wrap_array(np.diff(self.cog)) * fast[1:], np.diff(self.rate)
        along, across, rate = (_white_noise(self.time, each) for each in changes)
        return math.hypot(along, self.lasting), math.hypot(across, self.lasting), rate


class Integral:
    """The integral of (n,) values over (n,) times by trapezoids, which also counts gaps."""

    def __init__(self, time, values):
        step = np.diff(time)
        area = 0.5 * (values[1:] + values[:-1]) * step
        hole = ~np.isfinite(area) | (step > _longest_line(time))
        self._time = time
        self._total = np.concatenate([[0.0], np.cumsum(np.where(hole, 0.0, area))])
        self._holes = np.concatenate([[0], np.cumsum(hole)])

    def between(self, begin, end) -> np.ndarray:
        """The integral from `begin` to `end`; NaN over a gap and outside the record."""
        time = self._time
        first = (np.searchsorted(time, begin, side="right") - 1).clip(0)
        last = np.searchsorted(time, end, side="left").clip(0, len(time) - 1)
        known = (begin >= time[0]) & (end <= time[-1]) & (self._holes[first] == self._holes[last])
        growth = np.interp(end, time, self._total) - np.interp(begin, time, self._total)
        return np.where(known, growth, np.nan)


def near(time, moments, reach) -> np.ndarray:
    """(n,) bool: whether each time is within `reach` s of one of the moments. Times and moments ascend."""
    if not len(moments):
        return np.zeros(len(time), dtype=bool)
    after = np.searchsorted(moments, time).clip(0, len(moments) - 1)
    before = (after - 1).clip(0)
    return np.minimum(np.abs(moments[after] - time), np.abs(moments[before] - time)) <= reach


def line(at, time, values) -> np.ndarray:
    """Values at other times, interpolated linearly between known rows; NaN outside the record and in gaps."""
    known = np.isfinite(values)
    if known.sum() < 2:
        return np.full(len(at), np.nan)
    time, values = time[known], values[known]
    after = np.searchsorted(time, at, side="left").clip(1, len(time) - 1)
    joined = time[after] - time[after - 1] <= _longest_line(time)
    within = (at >= time[0]) & (at <= time[-1])
    return np.where(joined & within, np.interp(at, time, values), np.nan)


def _longest_line(time) -> float:
    return max(_LONGEST_LINE, 2.5 * float(np.median(np.diff(time))))


def _white_noise(time, change) -> float:
    """White noise (1σ) of a slow signal, from its changes from row to row (n − 1,); 0 for too few rows."""
    step = np.diff(time)
    even = np.abs(step - np.median(step)) < 0.2 * np.median(step)
    third = np.abs(np.diff(change, 2)[even[:-2] & even[1:-1] & even[2:]])
    third = third[np.isfinite(third)]
    if len(third) < _FEWEST:
        return 0.0
    white = float(np.quantile(third, 0.25)) / (_QUARTILE_OF_NORMAL * _THIRD_DIFFERENCE)
    moved = np.abs(change[np.isfinite(change) & (np.abs(change) > 1e-9)])
    rounding = float(np.quantile(moved, 0.05)) / math.sqrt(12.0) if len(moved) >= _FEWEST else 0.0
    return max(white, rounding)


LAGS = np.arange(-80, 121) * 0.05  # s
_UNMOVED = 80  # of them, 0
_SPAN = 5.0  # s
_HALF_TURN = 2.0  # s, duration of either of the two displacements that show a turn
_WAY = 0.6  # m/s
_LEAST_GAIN = 0.01
_APART = 0.1
"""Least gain for which speed and course get separate lags. In the develop half the gain is at most 0.04."""
_CLIP = 3.0
_FEWEST = 30
_SURE, _BLOCK = 4.0, 10.0
"""Gain, in standard errors, above which a lag of the rate is used; and length of a block, s. Compared: for rates
without lag, the best of 200 lags gains up to 2.5 standard errors, and 3.3 (at −2.05 s) in recorded turns of a motor
boat. A true lag of 1 s gains 6 in the scene `sea` and 4 in `tacks`."""


def velocity_lag(reference: VelocityReference, time, places) -> float:
    """Lag (s) of the velocity, from displacements over five seconds or two fixes; 0 if it is not determined.

    `reference` with lag 0; time: (n,) s; places: (n, 2) m. Without a course, distances are compared.
    """
    return _least(_off(reference, time, places))[0]


def course_lag(reference: VelocityReference, time, places) -> float:
    """Lag (s) of the course behind the speed, because instruments damp them differently; 0 if it improves nothing.

    The speed is compared with distances over five seconds or two fixes, the course with their directions.
    """
    rows, ahead, moved = _displacements(time, places)
    way = np.hypot(*moved.T)

    def of_way(lag):
        return np.abs(way - reference.way(time[rows] + lag, time[ahead] + lag))

    def of_direction(lag):
        north, east = reference.travelled(time[rows] + lag, time[ahead] + lag)
        return way * np.abs(wrap_array(np.arctan2(east, north) - np.arctan2(moved[:, 1], moved[:, 0])))

    later = _least(of_direction)[0] - _least(of_way)[0]
    together = _off(reference, time, places)
    most = _most(together)
    apart = _least(_off(replace(reference, course_lag=later), time, places), most)[1]
    return later if apart < (1.0 - _APART) * _least(together, most)[1] else 0.0


def _off(reference, time, places):
    """A function of the lag that returns the distances (m) between displacements of fixes and of the reference."""
    rows, ahead, moved = _displacements(time, places)
    directed = np.isfinite(reference.travelled(time[rows], time[ahead])[0]).sum() >= _FEWEST

    def difference(lag):
        begin, end = time[rows] + lag, time[ahead] + lag
        if directed:
            return np.hypot(*(moved.T - reference.travelled(begin, end)))
        return np.abs(np.hypot(*moved.T) - reference.way(begin, end))

    return difference


def _displacements(time, places):
    """Rows, the rows five seconds or two fixes ahead of them, and the displacements (m) between; without gaps."""
    ahead = np.maximum(np.searchsorted(time, time + _SPAN - 1e-6), np.arange(len(time)) + 2)
    rows = np.flatnonzero(ahead < len(time))
    ahead = ahead[rows]
    short = time[ahead] - time[rows] < 2.0 * max(_SPAN, 2.0 * float(np.median(np.diff(time))))
    rows, ahead = rows[short], ahead[short]
    return rows, ahead, places[ahead] - places[rows]


def rate_lag(reference: VelocityReference, time, places) -> float:
    """Lag (s) of the rate, from the turn between the displacements in the two seconds before and after each fix.

    0 if the turns do not determine it.
    """
    back = np.searchsorted(time, time - _HALF_TURN - 1e-6)
    ahead = np.searchsorted(time, time + _HALF_TURN - 1e-6)
    rows = np.flatnonzero((ahead < len(time)) & (time - time[back] < 1.5 * _HALF_TURN) & (back > 0))
    first, last = (places[j] - places[i] for i, j in ((back[rows], rows), (rows, ahead[rows])))
    half = 0.25 * (time[ahead[rows]] - time[back[rows]])
    across = first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]
    turn = np.arctan2(across, (first * last).sum(axis=1))
    slow = np.minimum(np.hypot(*first.T), np.hypot(*last.T)) < _WAY * 2.0 * half
    turned = Integral(reference.time, reference.rate)

    def difference(lag):
        at = time[rows] + lag
        return np.where(slow, np.nan, np.abs(turn - turned.between(at - half, at + half)))

    lag = _least(difference)[0]
    return lag if _sureness(difference, lag, time[rows]) > _SURE else 0.0


def _sureness(difference, lag, time) -> float:
    """Gain of a lag over no lag, in standard errors; rows of the same ten seconds count as one sample."""
    most = _most(difference)
    gain = np.minimum(difference(0.0), most) - np.minimum(difference(lag), most)
    known = np.isfinite(gain)
    of_blocks = np.bincount(((time[known] - time[0]) // _BLOCK).astype(int), gain[known])
    error = math.sqrt(float(of_blocks @ of_blocks))
    return float(of_blocks.sum()) / error if error > 0.0 else 0.0


def _most(difference) -> float:
    """The limit at which differences are clipped."""
    unmoved = difference(0.0)
    return _CLIP * float(np.nanmedian(unmoved)) if np.isfinite(unmoved).sum() >= _FEWEST else math.nan


def _least(difference, most=None) -> tuple[float, float]:
    """(lag with the least mean difference, this mean); lag 0 if no lag gains enough."""
    most = _most(difference) if most is None else most
    costs = np.full(len(LAGS), np.inf)
    for k, lag in enumerate(LAGS):
        differences = difference(lag)
        if math.isfinite(most) and np.isfinite(differences).sum() >= _FEWEST:
            costs[k] = np.nanmean(np.minimum(differences, most))
    best, unmoved = int(np.argmin(costs)), costs[_UNMOVED]
    return (float(LAGS[best]), costs[best]) if costs[best] < (1.0 - _LEAST_GAIN) * unmoved else (0.0, unmoved)
