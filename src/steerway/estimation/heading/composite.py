"""Heading from propellers and compass: a Kalman filter on [vehicle; compass], P4 §3.1 made whole.

The paper feeds its compass model the heading, which is what is sought. Here the vehicle model, driven by the propeller
difference each second, supplies it, and the compass, at 40 Hz, corrects: x = [v1 v2 c1 c2], heading = C v.

`model` is a vector of parameters (the indices below); compass states and readings are in degrees as in the paper, the
rest is SI.
"""

import math

import numpy as np

from steerway.core.compiled import kernel
from steerway.sensors.tcm2 import READING_VARIANCE_DEG2, STATE_VARIANCE, TCM2, TICKS, CompassModel
from steerway.vessels.springer import PAPER_YAW, HeadingModel

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
    "composite_model",
    "correct",
    "heading_deg",
    "predict_compass",
    "predict_vehicle",
    "second",
    "start_covariance",
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
"""Of each vehicle state at first, which the paper leaves out: 0.002° of heading; missions come out as P4's Table 1."""


def composite_model(
    compass: CompassModel = TCM2, yaw: HeadingModel = PAPER_YAW, vehicle_noise: float = WAVES
) -> np.ndarray:
    """The (14,) parameters of a filter that believes in this compass and this vehicle."""
    _, inputs, outputs = yaw.matrices()
    noise = (vehicle_noise, STATE_VARIANCE, READING_VARIANCE_DEG2)
    return np.array([*yaw.poles, *inputs, *np.degrees(outputs), *compass, *noise])


def start_covariance(vehicle_variance: float = START_VARIANCE) -> np.ndarray:
    """(4, 4): the heading known well, the compass at one of its own noise."""
    return np.diag([vehicle_variance, vehicle_variance, STATE_VARIANCE, STATE_VARIANCE])


class CompositeFilter:
    """A Kalman filter that believes in one compass. `second` takes a second of readings and the difference held then.

    heading (rad, unwrapped) is the estimate for the second that begins; innovation (deg) and nis are means over the
    last one's readings.
    """

    def __init__(self, model: np.ndarray, vehicle_variance: float = START_VARIANCE):
        self._model = model
        self._state = np.zeros(4)
        self._covariance = start_covariance(vehicle_variance)
        self.innovation = self.nis = math.nan

    @property
    def heading(self) -> float:
        return math.radians(heading_deg(self._state, self._model))

    @property
    def heading_std(self) -> float:
        """rad."""
        return math.radians(math.sqrt(heading_variance_deg2(self._covariance, self._model)))

    def second(self, difference: float, readings) -> float:
        """Take (40,) readings (rad) and go one second on with n_d (rad/s); returns the heading (rad)."""
        self.innovation, self.nis = second(self._state, self._covariance, self._model, difference, np.degrees(readings))
        return self.heading


@kernel
def heading_deg(x, model):
    """Heading (deg) of a state (4,): C v of P4 (2)."""
    return model[OUTPUT_1] * x[0] + model[OUTPUT_2] * x[1]


@kernel
def heading_variance_deg2(p, model):
    return (
        model[OUTPUT_1] ** 2 * p[0, 0]
        + model[OUTPUT_2] ** 2 * p[1, 1]
        + 2 * model[OUTPUT_1] * model[OUTPUT_2] * p[0, 1]
    )


@kernel
def predict_compass(x, p, model):
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
def correct(x, p, model, reading_deg):
    """One reading, P4 (6). Returns the innovation (deg) and its variance."""
    k = model[K]
    s = k * k * p[2, 2] + model[READING_NOISE]
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
def predict_vehicle(x, p, model, difference):
    """One second of the vehicle, P4 (2)."""
    for i in range(2):
        x[i] = model[POLE_1 + i] * x[i] + model[INPUT_1 + i] * difference
        for j in range(4):
            p[i, j] *= model[POLE_1 + i]
        for j in range(4):
            p[j, i] *= model[POLE_1 + i]
        p[i, i] += model[VEHICLE_NOISE]


@kernel
def second(x, p, model, difference, readings_deg):
    """A second: 40 readings, then the vehicle. Returns the mean innovation (deg) and the mean NIS."""
    total = nis = 0.0
    for k in range(TICKS):
        predict_compass(x, p, model)
        innovation, s = correct(x, p, model, readings_deg[k])
        total += innovation
        nis += innovation * innovation / s
    predict_vehicle(x, p, model, difference)
    return total / TICKS, nis / TICKS
