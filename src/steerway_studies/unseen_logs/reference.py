"""What is known of a motion beside the positions: where it is believed, and how noisy it is at least.

Lags of a reference behind the positions are found without any filter's estimate, so that they favour no filter.

A displacement is the integral of the velocity over the same time. The lag brings the two closest (mean of clipped
differences), if it gains at least 1 %.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from steerway.core import wrap_array

MOST_ACCELERATION = 30.0
"""m/s². A reference that changes faster is a spike of its receiver: three times gravity is beyond a boat and who sails
it, and what receivers recorded as spikes is ten times beyond that."""
WORST_ACCURACY = 1.5  # m/s, as the receiver states it
_AROUND_SPIKES = 1.0  # s
_WAY = 0.6  # m/s, above which the noise of a course is determined
_QUARTILE_OF_NORMAL = 0.3186
_THIRD_DIFFERENCE = math.sqrt(20.0)
_FEWEST = 30
_LONGEST_LINE = 1.0  # s between rows that are joined by a line, at least


@dataclass(frozen=True, eq=False)
class VelocityReference:
    """Speed, course and rate by another instrument than the positions', or by the same receiver (`own`).

    Shapes: all (n,); time ascends strictly. NaN where unknown. The speed is late by `lag` s, the course by `course_lag`
    more, the rate by `rate_lag`. `lasting`: standard deviation (m/s) of errors that last over rows, where known.
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
        """Without the rows around spikes, and those whose stated accuracy (m/s) is poor.

        Judged by the reference alone: agreement with positions plays no part.
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
        """SOG, COG and rate at other times, by lines between rows, the lags taken out."""
        moved = time + self.lag
        rate = line(time + self.rate_lag, self.time, self.rate)
        return line(moved, self.time, self.sog), self._course(moved), rate

    def _course(self, time):
        """COG when the speed is that of the row of this time."""
        east, north = (line(time + self.course_lag, self.time, f(self.cog)) for f in (np.sin, np.cos))
        return np.arctan2(east, north)

    def travelled(self, begin, end) -> tuple[np.ndarray, np.ndarray]:
        """North and east (m) between two times by its velocity, the lag taken out; NaN without a course."""
        return tuple(each.between(begin + self.lag, end + self.lag) for each in self._ways[:2])

    def way(self, begin, end) -> np.ndarray:
        """Metres sailed between two times by its speed alone, the lag taken out."""
        return self._ways[2].between(begin + self.lag, end + self.lag)

    @cached_property
    def _ways(self) -> tuple["Integral", ...]:
        cog = self._course(self.time) if self.course_lag else self.cog
        speeds = self.sog * np.cos(cog), self.sog * np.sin(cog), self.sog
        return tuple(Integral(self.time, each) for each in speeds)

    @cached_property
    def noise(self) -> tuple[float, float, float]:
        """Standard deviations of its noise: SOG (m/s), velocity across the course (m/s), rate (rad/s).

        The white part is from third differences, by the quartile of their size: in the calm quarter of a log motion
        plays no part. No smaller than rounding makes it. Of errors that last over several rows only `lasting` is in it.
        """
        fast = np.where(self.sog > _WAY, self.sog, np.nan)
        changes = np.diff(self.sog), wrap_array(np.diff(self.cog)) * fast[1:], np.diff(self.rate)
        along, across, rate = (_white_noise(self.time, each) for each in changes)
        return math.hypot(along, self.lasting), math.hypot(across, self.lasting), rate


class Integral:
    """The integral of (n,) values over (n,) times by trapezoids, with account of its holes."""

    def __init__(self, time, values):
        step = np.diff(time)
        area = 0.5 * (values[1:] + values[:-1]) * step
        hole = ~np.isfinite(area) | (step > _longest_line(time))
        self._time = time
        self._total = np.concatenate([[0.0], np.cumsum(np.where(hole, 0.0, area))])
        self._holes = np.concatenate([[0], np.cumsum(hole)])

    def between(self, begin, end) -> np.ndarray:
        """Its growth between times; NaN over a hole and outside the record."""
        time = self._time
        first = (np.searchsorted(time, begin, side="right") - 1).clip(0)
        last = np.searchsorted(time, end, side="left").clip(0, len(time) - 1)
        known = (begin >= time[0]) & (end <= time[-1]) & (self._holes[first] == self._holes[last])
        growth = np.interp(end, time, self._total) - np.interp(begin, time, self._total)
        return np.where(known, growth, np.nan)


def near(time, moments, reach) -> np.ndarray:
    """(n,) bool: which times are within `reach` s of any of the moments. Both ascend."""
    if not len(moments):
        return np.zeros(len(time), dtype=bool)
    after = np.searchsorted(moments, time).clip(0, len(moments) - 1)
    before = (after - 1).clip(0)
    return np.minimum(np.abs(moments[after] - time), np.abs(moments[before] - time)) <= reach


def line(at, time, values) -> np.ndarray:
    """Values at other times by lines between known rows; NaN outside them and in gaps."""
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
_HALF_TURN = 2.0  # s of each of the displacements that show a turn
_WAY = 0.6  # m/s
_LEAST_GAIN = 0.01
_APART = 0.1
"""Gain of displacements when speed and course have a lag each. Chosen: it is at most 0.04 in the developing half."""
_CLIP = 3.0
_FEWEST = 30
_SURE, _BLOCK = 4.0, 10.0
"""Standard errors of its gain from which on a lag of the rate is determined, and s of a block. Chosen: of rates that
are not late the likeliest of 200 lags gains up to 2.5, of recorded turns of a motor boat 3.3 at −2.05 s; one of 1 s
gains 6 in the scene `sea` and 4 in `tacks`."""


def velocity_lag(reference: VelocityReference, time, places) -> float:
    """s by which the velocity is late, by displacements over five seconds or two fixes; 0 where it is not found.

    `reference` with its lag at 0; time: (n,) s; places: (n, 2) m. Without a course the ways are compared.
    """
    return _least(_off(reference, time, places))[0]


def course_lag(reference: VelocityReference, time, places) -> float:
    """s by which the course is later than the speed: instruments damp them apart. 0 where that brings nothing closer.

    The ways over five seconds or two fixes are compared for the speed, their directions for the course.
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
    """Metres between displacements and what the reference travelled meanwhile, by its lag."""
    rows, ahead, moved = _displacements(time, places)
    directed = np.isfinite(reference.travelled(time[rows], time[ahead])[0]).sum() >= _FEWEST

    def difference(lag):
        begin, end = time[rows] + lag, time[ahead] + lag
        if directed:
            return np.hypot(*(moved.T - reference.travelled(begin, end)))
        return np.abs(np.hypot(*moved.T) - reference.way(begin, end))

    return difference


def _displacements(time, places):
    """Rows, those five seconds or two fixes ahead of them, and the displacements (m) between; not over gaps."""
    ahead = np.maximum(np.searchsorted(time, time + _SPAN - 1e-6), np.arange(len(time)) + 2)
    rows = np.flatnonzero(ahead < len(time))
    ahead = ahead[rows]
    short = time[ahead] - time[rows] < 2.0 * max(_SPAN, 2.0 * float(np.median(np.diff(time))))
    rows, ahead = rows[short], ahead[short]
    return rows, ahead, places[ahead] - places[rows]


def rate_lag(reference: VelocityReference, time, places) -> float:
    """The same of its rate, by the turn from the displacement before a fix to the one behind it, two seconds each.

    0 where the turns do not determine it.
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
    """Gain of a lag against none in its standard errors; what rows of the same ten seconds say counts once."""
    most = _most(difference)
    gain = np.minimum(difference(0.0), most) - np.minimum(difference(lag), most)
    known = np.isfinite(gain)
    of_blocks = np.bincount(((time[known] - time[0]) // _BLOCK).astype(int), gain[known])
    error = math.sqrt(float(of_blocks @ of_blocks))
    return float(of_blocks.sum()) / error if error > 0.0 else 0.0


def _most(difference) -> float:
    """The difference that counts at most."""
    unmoved = difference(0.0)
    return _CLIP * float(np.nanmedian(unmoved)) if np.isfinite(unmoved).sum() >= _FEWEST else math.nan


def _least(difference, most=None) -> tuple[float, float]:
    """The lag of the least mean difference, 0 where it is not found, and that mean."""
    most = _most(difference) if most is None else most
    costs = np.full(len(LAGS), np.inf)
    for k, lag in enumerate(LAGS):
        differences = difference(lag)
        if math.isfinite(most) and np.isfinite(differences).sum() >= _FEWEST:
            costs[k] = np.nanmean(np.minimum(differences, most))
    best, unmoved = int(np.argmin(costs)), costs[_UNMOVED]
    return (float(LAGS[best]), costs[best]) if costs[best] < (1.0 - _LEAST_GAIN) * unmoved else (0.0, unmoved)
