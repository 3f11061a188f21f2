"""Rows of a log that are informative of motion, and excerpts of logs too long to be fitted whole."""

import math
from dataclasses import replace

import numpy as np

from steerway.core.compiled import kernel
from steerway.core.earth import displacement
from steerway.core.records import Fixes

LEAST_SPEED = 0.5
"""m/s over ten seconds: five metres, beyond the wander of a receiver at rest in that time."""


def moving(fixes: Fixes, half_window=5.0) -> np.ndarray:
    """(n,) bool: under way by the displacement over ten seconds."""
    placed = fixes.has_position
    if not placed.all():
        return np.r_[False, moving(fixes.rows(placed), half_window)][np.cumsum(placed)]
    return _speeds(fixes.time, fixes.latitude, fixes.longitude, half_window) > LEAST_SPEED


def informative(fixes: Fixes, reach=10.0) -> np.ndarray:
    """(n,) bool: the vessel is under way, or is so within `reach` (s).

    Starts and stops are informative too: without them the acceleration would be underestimated.
    """
    time, before = fixes.time, np.r_[0, np.cumsum(moving(fixes))]
    return before[np.searchsorted(time, time + reach, side="right")] > before[np.searchsorted(time, time - reach)]


@kernel
def _speeds(time, latitude, longitude, half_window):
    """(n,) m/s from the first fix to the last within half a window (s) of each; `time` in order."""
    n = len(time)
    speed = np.zeros(n)
    first = last = 0
    for k in range(n):
        while time[first] < time[k] - half_window:
            first += 1
        while last < n - 1 and time[last] < time[k] + half_window:
            last += 1
        if time[last] > time[first]:
            north, east = displacement(latitude[last], longitude[last], latitude[first], longitude[first])
            speed[k] = math.hypot(north, east) / (time[last] - time[first])
    return speed


@kernel
def thinned(time, spacing):
    """Indices of rows at least `spacing` apart (give or take receiver jitter)."""
    chosen, count, last = np.empty(len(time), np.int64), 0, -np.inf
    for k in range(len(time)):
        if time[k] - last >= 0.95 * spacing:
            chosen[count], last = k, time[k]
            count += 1
    return chosen[:count]


def spaced(fixes: Fixes, spacing: float, aids_spacing: float) -> Fixes:
    """Positions at least so far apart (s); between them aids, so far apart, in rows without a position."""
    placed = np.flatnonzero(fixes.has_position)
    kept = np.zeros(len(fixes), bool)
    kept[placed[thinned(fixes.time[placed], spacing)]] = True
    chosen = kept.copy()
    chosen[thinned(fixes.time, aids_spacing)] = True
    places = {name: np.where(kept, getattr(fixes, name), np.nan) for name in ("latitude", "longitude")}
    return replace(fixes, **places).rows(chosen)


def stretches(counted, count: int, length: int) -> np.ndarray:
    """Rows (at most `count`, `length`) of stretches from all over a record, those that count most.

    A record that is hardly longer than these is one stretch.
    """
    parts = len(counted) // length
    if parts <= count:
        return np.arange(len(counted))[np.newaxis]
    counting = counted[: parts * length].reshape(parts, length).sum(axis=1)
    busy = np.flatnonzero(counting >= 0.5 * np.sort(counting)[-count])
    chosen = busy[np.linspace(0, len(busy) - 1, count).round().astype(int)]
    return chosen[:, np.newaxis] * length + np.arange(length)
