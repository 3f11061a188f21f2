"""What tuning and choosing share: which parameters there are to be found, and which rows of a log tell of them."""

import math
from dataclasses import replace

import numpy as np

from steerway.earth import displacement
from steerway.records import Fixes

LEAST_SPEED = 0.5

MOTION = ("position_std", "speed_noise", "course_rate_noise", "course_rate_decay")
"""A vessel of one manner of moving, and a receiver of white noise."""
TURNS = ("straight_time", "turn_time", "turn_speed_noise", "turn_course_rate_noise", "turn_course_rate_decay")
"""What a second manner of moving adds."""
LASTING = ("acceleration_std",)
YAWING = ("yawing_period",)
SLOW_ERROR = ("error_std", "error_time")
DRIFT = ("drift_std", "drift_time")

BOUNDS = {
    "position_std": (2e-3, 30.0),
    "speed_noise": (1e-7, 10.0),
    "course_rate_noise": (1e-10, 10.0),
    "course_rate_decay": (5e-3, 2.0),
    "straight_time": (20.0, 1e4),
    "turn_time": (2.0, 3e3),
    "turn_speed_noise": (1e-7, 10.0),
    "turn_course_rate_noise": (1e-8, 10.0),
    "turn_course_rate_decay": (5e-3, 1.0),
    "acceleration_std": (1e-3, 2.0),
    "yawing_period": (3.0, 100.0),
    "error_std": (3e-3, 10.0),
    "error_time": (1.0, 2e3),
    "drift_std": (3e-3, 30.0),
    "drift_time": (1.0, 1e4),
}
"""Least and largest value of every parameter that is fitted."""
EXPECTED = {
    "position_std": (0.5, 2.0),
    "speed_noise": (1e-2, 4.0),
    "course_rate_noise": (1e-3, 4.0),
    "course_rate_decay": (0.2, 2.0),
    "straight_time": (100.0, 2.0),
    "turn_time": (20.0, 2.0),
    "turn_speed_noise": (1e-2, 4.0),
    "turn_course_rate_noise": (1e-3, 4.0),
    "turn_course_rate_decay": (0.2, 2.0),
    "acceleration_std": (0.1, 2.0),
    "yawing_period": (10.0, 1.0),
    "error_std": (1.0, 2.0),
    "error_time": (100.0, 2.0),
    "drift_std": (1.0, 2.0),
    "drift_time": (300.0, 2.0),
}
"""Median and standard deviation of the logarithm: wide, so that only what a log cannot tell is held."""


def moving(fixes: Fixes, half_window=5.0) -> np.ndarray:
    """(n,) bool: displacement over ten seconds says the vessel is under way."""
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
