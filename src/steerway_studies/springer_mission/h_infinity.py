"""An H-infinity filter of the heading: the worst case over bounded disturbances in place of the mean over noise.

Simon, Optimal State Estimation (2006), section 11.3: as a Kalman filter, with P⁻¹ reduced by θ C ᵀC before every
reading, C x the heading; errors count at readings only. θ (1/deg²) bounds the worst ratio of heading error to
disturbance at 1/θ; θ = 0 is the Kalman filter, and beyond a largest θ there is no filter.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from steerway.core import InputError, kernel
from steerway.estimation.heading import Ticks, checked_difference
from steerway.estimation.heading.composite import (
    OUTPUT_1,
    START_VARIANCE,
    checked_model,
    correct,
    heading_deg,
    heading_variance_deg2,
    predict_compass,
    predict_vehicle,
    start_covariance,
    stepped,
)
from steerway.sensors import TICKS

Floats = NDArray[np.float64]


class HInfinityFilter:
    """Heading by the H∞ filter. theta in 1/deg²; raises InputError when none exists at that θ within `horizon` s."""

    def __init__(
        self, model: ArrayLike, theta: float, vehicle_variance: float = START_VARIANCE, horizon: int = 900
    ) -> None:
        self._model = checked_model(model)
        if not exists(self._model, theta, vehicle_variance, horizon):
            raise InputError(f"h_infinity.theta is {theta:g} 1/deg², expected below the largest a filter exists for")
        self._theta = theta
        self._state = np.zeros(4)
        self._covariance = start_covariance(vehicle_variance)
        self._ticks = Ticks()

    @property
    def heading(self) -> float:
        """rad, unwrapped."""
        return math.radians(heading_deg(self._state, self._model))

    @property
    def heading_std(self) -> float:
        """√(C P Cᵀ), rad: what bounds the error in place of a standard deviation, and is no smaller than it."""
        return math.radians(math.sqrt(heading_variance_deg2(self._covariance, self._model)))

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> float:
        """As `CompositeFilter.step`; InputError too where no filter exists any more."""
        difference = checked_difference(difference)
        x, p = self._state.copy(), self._covariance.copy()
        for part, table in self._ticks.parts(dt, readings, times):
            if not _advance(x, p, stepped(self._model, part), self._theta, difference, table):
                raise InputError(
                    f"h_infinity.theta is {self._theta:g} 1/deg², expected less for so few readings: no filter exists"
                )
        self._state, self._covariance = x, p
        return self.heading


def exists(model: Floats, theta: float, vehicle_variance: float = START_VARIANCE, horizon: int = 900) -> bool:
    """Whether the filter keeps a positive P through `horizon` seconds of 40 readings."""
    return bool(_exists(checked_model(model), theta, start_covariance(vehicle_variance), horizon))


def largest_theta(model: Floats, vehicle_variance: float = START_VARIANCE, horizon: int = 900) -> float:
    """The largest θ (to 1 %) for which there is a filter."""
    low, high = 0.0, 1.0
    while exists(model, high, vehicle_variance, horizon):
        low, high = high, 10.0 * high
    while high - low > 0.01 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if exists(model, middle, vehicle_variance, horizon) else (low, middle)
    return low


@kernel
def _inflate(p: Floats, model: Floats, theta: float) -> bool:
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
def _advance(x: Floats, p: Floats, model: Floats, theta: float, difference: float, readings: Floats) -> bool:
    for k in range(readings.shape[1]):
        predict_compass(x, p, model)
        if readings[1, k] > 0.0:
            if not _inflate(p, model, theta):
                return False
            correct(x, p, model, readings[0, k], readings[1, k])
    predict_vehicle(x, p, model, difference)
    return True


@kernel
def _exists(model: Floats, theta: float, p: Floats, horizon: int) -> bool:
    x, readings = np.zeros(4), np.zeros((2, TICKS))
    readings[1] = 1.0
    for _ in range(horizon):
        if not _advance(x, p, model, theta, 0.0, readings):
            return False
    return True
