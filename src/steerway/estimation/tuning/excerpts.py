"""Which rows of a log tell of motion, and excerpts of those too long to be fitted whole."""

import math
from dataclasses import replace

import numpy as np

from steerway.earth import displacement
from steerway.records import Fixes

LEAST_SPEED = 0.5


def moving(fixes: Fixes, half_window=5.0) -> np.ndarray:
    """(n,) bool: displacement over ten seconds says the vessel is under way."""
    placed = fixes.has_position
    if not placed.all():
        return moving(fixes.rows(placed), half_window)[np.maximum(np.cumsum(placed) - 1, 0)]
    time, latitude, longitude = fixes.time, fixes.latitude, fixes.longitude
    first = np.searchsorted(time, time - half_window)
    last = np.minimum(np.searchsorted(time, time + half_window), len(time) - 1)
    speed = np.zeros(len(time))
    for k in range(len(time)):
        i, j = first[k], last[k]
        if time[j] > time[i]:
            north, east = displacement(latitude[j], longitude[j], latitude[i], longitude[i])
            speed[k] = math.hypot(north, east) / (time[j] - time[i])
    return speed > LEAST_SPEED


def thinned(time, spacing):
    """Indices of rows at least `spacing` apart (give or take receiver jitter)."""
    chosen, last = [], -np.inf
    for k, moment in enumerate(time):
        if moment - last >= 0.95 * spacing:
            chosen.append(k)
            last = moment
    return np.array(chosen)


def spaced(fixes: Fixes, spacing: float, aids_spacing: float) -> Fixes:
    """Positions at least so far apart (s); between them what instruments say, so far apart, without a position."""
    placed = np.flatnonzero(fixes.has_position)
    kept = np.zeros(len(fixes), bool)
    kept[placed[thinned(fixes.time[placed], spacing)]] = True
    said = kept.copy()
    said[thinned(fixes.time, aids_spacing)] = True
    places = {name: np.where(kept, getattr(fixes, name), np.nan) for name in ("latitude", "longitude")}
    return replace(fixes, **places).rows(said)


def stretches(fixes: Fixes, count: int, length: int) -> Fixes:
    """At most `count` stretches of so many rows from all over a record, those most under way, each a track."""
    parts = len(fixes) // length
    if parts <= count:
        return fixes
    sailed = moving(fixes)[: parts * length].reshape(parts, length).sum(axis=1)
    busy = np.flatnonzero(sailed >= 0.5 * np.sort(sailed)[-count])
    chosen = busy[np.linspace(0, len(busy) - 1, count).round().astype(int)]
    rows = np.concatenate([np.arange(k * length, (k + 1) * length) for k in chosen])
    sample = fixes.rows(rows)
    return replace(sample, mmsi=np.repeat(np.arange(count), length))
