"""How late a reference is against the positions, found without any filter's estimate, so that it favours none.

A displacement is the integral of the velocity over the same time. That lag is taken which brings the two closest, in
the mean of clipped differences, if it gains at least 1 %.
"""

import math
from dataclasses import replace

import numpy as np

from steerway.core import wrap_array
from steerway_studies.unseen_logs.reference import Integral, VelocityReference

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
    """The same of its rate, by the turn from the displacement before a fix to the one behind it, two seconds each."""
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

    return _least(difference)[0]


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
