"""What tuning and choosing share: which fixes are under way, how far apart, a search that knows what to expect."""

import math

import numpy as np

from steerway.earth import displacement
from steerway.estimation.profiles import Profile
from steerway.records import Fixes

LEAST_SPEED = 0.5

_BOUNDS = {
    "position_std": (0.003, 30.0),
    "speed_noise": (1e-6, 10.0),
    "course_rate_noise": (1e-9, 10.0),
    "course_rate_decay": (0.01, 2.0),
    "acceleration_std": (1e-3, 2.0),
    "yawing_period": (3.0, 100.0),
    "yawing_time": (1.0, 1000.0),
    "error_std": (0.003, 10.0),
    "error_time": (1.0, 2000.0),
}
_EXPECTED = {  # median and standard deviation of the logarithm: wide, so that only what a log cannot tell is held
    "position_std": (0.5, 2.0),
    "speed_noise": (1e-2, 4.0),
    "course_rate_noise": (1e-3, 4.0),
    "course_rate_decay": (0.2, 2.0),
    "acceleration_std": (0.1, 2.0),
    "yawing_period": (10.0, 1.0),
    "yawing_time": (15.0, 1.0),
    "error_std": (1.0, 2.0),
    "error_time": (100.0, 2.0),
}
MOTION = ("position_std", "speed_noise", "course_rate_noise", "course_rate_decay")

FURTHER = ("acceleration_std", "yawing_period")
"""Of motions that have it."""


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


def minimise(objective, base: Profile, names, start, evaluations, step=None):
    """Nelder–Mead in the logarithms of `names`; returns the best profile and its cost with the prior."""
    from scipy.optimize import minimize

    low, high = (np.log([_BOUNDS[name][k] for name in names]) for k in range(2))
    centre = np.log([_EXPECTED[name][0] for name in names])
    spread = np.array([_EXPECTED[name][1] for name in names])

    def profile_of(logs):
        values = np.exp(np.clip(logs, low, high))
        return base.model_copy(update=dict(zip(names, values.tolist(), strict=True)))

    def penalised(logs):
        if step:
            step()
        return objective(profile_of(logs)) + 0.5 * float((((np.clip(logs, low, high) - centre) / spread) ** 2).sum())

    origin = np.log([start[name] for name in names])
    simplex = np.vstack([origin, origin + np.eye(len(names))])
    options = {"maxfev": evaluations, "xatol": 0.01, "fatol": 0.02, "initial_simplex": simplex}
    found = minimize(penalised, origin, method="Nelder-Mead", options=options)
    return profile_of(found.x), float(found.fun)
