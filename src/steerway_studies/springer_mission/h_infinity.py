"""An H-infinity filter of the heading: the worst case over bounded disturbances in place of the mean over noise.

Simon, Optimal State Estimation (2006), section 11.3: as a Kalman filter, with P⁻¹ reduced by θ C ᵀC before every
reading, C x the heading. θ (1/deg²) bounds the worst ratio of heading error to disturbance at 1/θ; θ = 0 is the Kalman
filter, and beyond a largest θ there is no filter.
"""

import math

import numpy as np

from steerway.core import InputError, kernel
from steerway.estimation.heading.composite import (
    OUTPUT_1,
    START_VARIANCE,
    correct,
    heading_deg,
    predict_compass,
    predict_vehicle,
    start_covariance,
)
from steerway.sensors import TICKS


class HInfinityFilter:
    """Heading by the H∞ filter. theta in 1/deg²; raises InputError when none exists at that θ within `horizon` s."""

    def __init__(self, model: np.ndarray, theta: float, vehicle_variance: float = START_VARIANCE, horizon: int = 900):
        if not exists(model, theta, vehicle_variance, horizon):
            raise InputError(f"h_infinity.theta is {theta:g} 1/deg², expected below the largest a filter exists for")
        self._model, self._theta = model, theta
        self._state = np.zeros(4)
        self._covariance = start_covariance(vehicle_variance)

    @property
    def heading(self) -> float:
        """rad."""
        return math.radians(heading_deg(self._state, self._model))

    def second(self, difference: float, readings) -> float:
        """Take (40,) readings (rad) and go one second on with n_d (rad/s); returns the heading (rad)."""
        _second(self._state, self._covariance, self._model, self._theta, difference, np.degrees(readings))
        return self.heading


def exists(model, theta, vehicle_variance=START_VARIANCE, horizon=900) -> bool:
    """Whether the filter keeps a positive P through `horizon` seconds."""
    return bool(_exists(model, theta, start_covariance(vehicle_variance), horizon))


def largest_theta(model, vehicle_variance: float = START_VARIANCE, horizon: int = 900) -> float:
    """The largest θ (to 1 %) for which there is a filter."""
    low, high = 0.0, 1.0
    while exists(model, high, vehicle_variance, horizon):
        low, high = high, 10.0 * high
    while high - low > 0.01 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if exists(model, middle, vehicle_variance, horizon) else (low, middle)
    return low


@kernel
def _inflate(p, model, theta):
    """P ← (P⁻¹ − θ Cᵀ C)⁻¹ by Sherman and Morrison. Returns False where that is not positive."""
    o0, o1 = model[OUTPUT_1], model[OUTPUT_1 + 1]
    pc = o0 * p[0] + o1 * p[1]
    left = 1.0 - theta * (o0 * pc[0] + o1 * pc[1])
    if not left > 0.0:
        return False
    for i in range(4):
        for j in range(4):
            p[i, j] += theta / left * pc[i] * pc[j]
    return True


@kernel
def _second(x, p, model, theta, difference, readings_deg):
    for k in range(TICKS):
        predict_compass(x, p, model)
        if not _inflate(p, model, theta):
            return False
        correct(x, p, model, readings_deg[k])
    predict_vehicle(x, p, model, difference)
    return True


@kernel
def _exists(model, theta, p, horizon):
    x, still = np.zeros(4), np.zeros(TICKS)
    for _ in range(horizon):
        if not _second(x, p, model, theta, 0.0, still):
            return False
    return True
