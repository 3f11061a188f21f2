"""Heading from propellers and compass: a Kalman filter on [vehicle; compass], P4 §3.1 completed.

The paper feeds its compass model the heading, which is the unknown. Here the vehicle model, driven by the propeller
difference, supplies it, and the compass, at 40 Hz, corrects: x = [v1 v2 c1 c2], heading = C v.

`model` is a vector of parameters (the indices below); compass states and readings are in degrees as in the paper, the
rest is SI. Readings reach the kernels as the (2, ticks) tables of `readings`.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.estimation.heading.models import (
    PAPER_YAW,
    READING_VARIANCE_DEG2,
    STATE_VARIANCE,
    TCM2,
    CompassModel,
    HeadingModel,
    held,
)
from steerway.estimation.heading.readings import Ticks, checked_difference

__all__ = [
    "A1",
    "A2",
    "COMPASS_NOISE",
    "INPUT_1",
    "INPUT_2",
    "OUTPUT_1",
    "OUTPUT_2",
    "POLE_1",
    "POLE_2",
    "READING_NOISE",
    "SHIFT",
    "START_VARIANCE",
    "VEHICLE_NOISE",
    "WAVES",
    "B",
    "CompositeFilter",
    "K",
    "advance",
    "checked_model",
    "composite_model",
    "correct",
    "heading_deg",
    "heading_variance_deg2",
    "predict_compass",
    "predict_vehicle",
    "start_covariance",
    "stepped",
    "yaw_rate_deg",
]
"""Public, kernels and places in `model` too: another filter of the same model is built of them."""

(
    POLE_1,
    POLE_2,
    INPUT_1,  # rad per rad/s
    INPUT_2,
    OUTPUT_1,  # to degrees
    OUTPUT_2,
    A1,
    A2,
    B,
    K,
    SHIFT,
    VEHICLE_NOISE,  # variance a second
    COMPASS_NOISE,  # variance a tick
    READING_NOISE,  # variance of a reading, deg²
) = range(14)

WAVES = 1e-14
"""Variance that the sea adds to each vehicle state a second, P4 §6."""
START_VARIANCE = 1e-12
"""Variance of each vehicle state at first, which the paper leaves out: 0.002° of heading. Missions come out as in
P4's Table 1."""


def composite_model(
    compass: CompassModel = TCM2,
    yaw: HeadingModel = PAPER_YAW,
    vehicle_noise: float = WAVES,
    reading_variance: float = READING_VARIANCE_DEG2,
) -> Floats:
    """The (14,) parameters of a filter for this compass and this vehicle, whose steps are 1 s long.

    vehicle_noise: variance that a second adds to each state of yaw; reading_variance: of one reading, deg².
    """
    _, inputs, outputs = yaw.matrices()
    noise = (vehicle_noise, STATE_VARIANCE, reading_variance)
    return np.array([*yaw.poles, *inputs, *np.degrees(outputs), *compass, *noise])


PARAMETERS = READING_NOISE + 1


def checked_model(model: ArrayLike) -> Floats:
    """(14,) parameters as an array of their own; raises InputError for another shape or unknown numbers."""
    array = np.array(model, dtype=np.float64)
    if array.shape != (PARAMETERS,) or not np.isfinite(array).all():
        raise InputError(f"heading.model has shape {array.shape}, expected ({PARAMETERS},) known numbers")
    return array


def stepped(model: Floats, step: float) -> Floats:
    """The parameters of vehicle steps of `step` s: the same poles, exact for a held input; noise grows with time."""
    if step == 1.0:
        return model
    model = model.copy()
    for i in range(2):
        left, entered = held(model[POLE_1 + i], step)
        model[POLE_1 + i] = left
        model[INPUT_1 + i] *= entered
    model[VEHICLE_NOISE] *= step
    return model


def start_covariance(vehicle_variance: float = START_VARIANCE) -> Floats:
    """(4, 4): the heading known well, the compass at one of its own noise."""
    return np.diag([vehicle_variance, vehicle_variance, STATE_VARIANCE, STATE_VARIANCE])


class CompositeFilter:
    """A Kalman filter of heading for one compass.

    `heading` (rad, unwrapped) is the estimate at the end of the last step; `innovation` (deg) and `nis` are means over
    its readings, NaN without any. Raises InputError for a model of another shape.
    """

    def __init__(self, model: ArrayLike, vehicle_variance: float = START_VARIANCE) -> None:
        self._model = checked_model(model)
        self._state = np.zeros(4)
        self._covariance = start_covariance(vehicle_variance)
        self._ticks = Ticks()
        self.innovation = self.nis = math.nan

    @property
    def heading(self) -> float:
        return math.radians(heading_deg(self._state, self._model))

    @property
    def heading_std(self) -> float:
        """rad."""
        return math.radians(math.sqrt(heading_variance_deg2(self._covariance, self._model)))

    def turned(self, std: float) -> None:
        """The boat has turned by more or less than its model says, 1σ in rad."""
        self._covariance[0, 0] += (math.degrees(std) / self._model[OUTPUT_1]) ** 2

    def yaw_rate(self, difference: float) -> float:
        """Yaw rate of the model with n_d (rad/s) in force, rad/s."""
        return math.radians(yaw_rate_deg(self._state, self._model, difference))

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> float:
        """Take the readings of the next dt s (rad, any number) and advance by n_d (rad/s); returns the heading (rad).

        `readings`, `times` and errors: see `readings.Ticks.parts`.
        """
        difference = checked_difference(difference)
        total = squares = taken = 0.0
        for part, table in self._ticks.parts(dt, readings, times):
            model = stepped(self._model, part)
            sums = advance(self._state, self._covariance, model, difference, table)
            total, squares, taken = total + sums[0], squares + sums[1], taken + sums[2]
        self.innovation, self.nis = (total / taken, squares / taken) if taken else (math.nan, math.nan)
        return self.heading


@kernel
def heading_deg(x: Floats, model: Floats) -> float:
    """Heading (deg) of a state (4,): C v of P4 (2)."""
    return model[OUTPUT_1] * x[0] + model[OUTPUT_2] * x[1]


@kernel
def yaw_rate_deg(x: Floats, model: Floats, difference: float) -> float:
    """C ((A − I) v + B n_d), the change of heading in a second of the model's steps, deg/s."""
    rate = 0.0
    for i in range(2):
        change = (model[POLE_1 + i] - 1.0) * x[i] + model[INPUT_1 + i] * difference
        rate += model[OUTPUT_1 + i] * change
    return rate


@kernel
def heading_variance_deg2(p: Floats, model: Floats) -> float:
    """C P Cᵀ."""
    return (
        model[OUTPUT_1] ** 2 * p[0, 0]
        + model[OUTPUT_2] ** 2 * p[1, 1]
        + 2 * model[OUTPUT_1] * model[OUTPUT_2] * p[0, 1]
    )


@kernel
def predict_compass(x: Floats, p: Floats, model: Floats) -> None:
    """One tick of the compass, P4 (5): c1 ← a1 c1 + a2 c2 + b ψ, c2 ← s c1."""
    a1, a2, shift = model[A1], model[A2], model[SHIFT]
    g0, g1 = model[B] * model[OUTPUT_1], model[B] * model[OUTPUT_2]
    c1 = x[2]
    x[2] = g0 * x[0] + g1 * x[1] + a1 * c1 + a2 * x[3]
    x[3] = shift * c1
    pg0 = p[0, 0] * g0 + p[0, 1] * g1 + p[0, 2] * a1 + p[0, 3] * a2
    pg1 = p[1, 0] * g0 + p[1, 1] * g1 + p[1, 2] * a1 + p[1, 3] * a2
    pg2 = p[2, 0] * g0 + p[2, 1] * g1 + p[2, 2] * a1 + p[2, 3] * a2
    pg3 = p[3, 0] * g0 + p[3, 1] * g1 + p[3, 2] * a1 + p[3, 3] * a2
    p[3, 3] = shift * shift * p[2, 2] + model[COMPASS_NOISE]
    p[3, 0] = p[0, 3] = shift * p[0, 2]
    p[3, 1] = p[1, 3] = shift * p[1, 2]
    p[2, 2] = g0 * pg0 + g1 * pg1 + a1 * pg2 + a2 * pg3 + model[COMPASS_NOISE]
    p[2, 0] = p[0, 2] = pg0
    p[2, 1] = p[1, 2] = pg1
    p[3, 2] = p[2, 3] = shift * pg2


@kernel
def correct(x: Floats, p: Floats, model: Floats, reading_deg: float, number: float) -> tuple[float, float]:
    """The mean of `number` readings of one tick, P4 (6). Returns the innovation (deg) and its variance."""
    k = model[K]
    s = k * k * p[2, 2] + model[READING_NOISE] / number
    innovation = reading_deg - k * x[2]
    pc0, pc1, pc2, pc3 = k * p[0, 2], k * p[1, 2], k * p[2, 2], k * p[3, 2]
    gain = (pc0 / s, pc1 / s, pc2 / s, pc3 / s)
    pc = (pc0, pc1, pc2, pc3)
    for i in range(4):
        x[i] += gain[i] * innovation
        for j in range(i, 4):
            p[i, j] -= gain[i] * pc[j]
            p[j, i] = p[i, j]
    return innovation, s


@kernel
def predict_vehicle(x: Floats, p: Floats, model: Floats, difference: float) -> None:
    """One step of the vehicle, P4 (2)."""
    for i in range(2):
        x[i] = model[POLE_1 + i] * x[i] + model[INPUT_1 + i] * difference
        for j in range(4):
            p[i, j] *= model[POLE_1 + i]
        for j in range(4):
            p[j, i] *= model[POLE_1 + i]
        p[i, i] += model[VEHICLE_NOISE]


@kernel
def advance(x: Floats, p: Floats, model: Floats, difference: float, readings: Floats) -> tuple[float, float, float]:
    """The ticks of a table of readings, then the vehicle. Returns sums over the ticks with readings: of the innovation
    (deg), of the NIS, and their number."""
    total = squares = taken = 0.0
    for k in range(readings.shape[1]):
        predict_compass(x, p, model)
        if readings[1, k] > 0.0:
            innovation, s = correct(x, p, model, readings[0, k], readings[1, k])
            total += innovation
            squares += innovation * innovation / s
            taken += 1.0
    predict_vehicle(x, p, model, difference)
    return total, squares, taken
