"""Heading from propellers, an uncalibrated compass and GNSS velocity, for boats whose models are known roughly.

P4 treats a wrong compass model by bounds. Most of the error of a wrong compass is a scale and a deviation, most of that
of a wrong vehicle is a bias of the propellers; these are states here, and GNSS velocity, which does not depend on the
compass, makes them observable:

    x = [v1 v2 c1 c2 | bias of n_d | compass scale, sine and cosine of its deviation | current north, east].

The compass sees scale · ψ + deviation, v_GNSS = speed · (cos ψ, sin ψ) + current. An extended Kalman filter; readings
are taken modulo a turn. Angles of the compass part in degrees as in `composite`, the rest is SI.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.linear_algebra import fill_lower
from steerway.core.moved import formerly
from steerway.estimation.course.update.aids import take_scalar
from steerway.estimation.heading.composite import (
    A1,
    A2,
    COMPASS_NOISE,
    INPUT_1,
    OUTPUT_1,
    POLE_1,
    READING_NOISE,
    SHIFT,
    VEHICLE_NOISE,
    B,
    K,
    composite_model,
    heading_deg,
    heading_variance_deg2,
    stepped,
)
from steerway.estimation.heading.readings import Ticks, checked_difference
from steerway.sensors.tcm2 import STATE_VARIANCE, TCM2, CompassModel
from steerway.vessels.springer import PHYSICAL_YAW, RPM, SPEED, HeadingModel

BIAS, SCALE, SINE, COSINE, CURRENT_NORTH, CURRENT_EAST = range(4, 10)
STATES = 10
WALKS = len((BIAS, SCALE, SINE, COSINE, CURRENT_NORTH, CURRENT_EAST))


@dataclass(frozen=True)
class HeadingTuning:
    """Noise of every state; pairs are (1σ at first, random walk in 1σ a root second). Zero pairs hold a state fixed."""

    vehicle_std: float = 2e-4  # of each vehicle state a second
    vehicle_start_std: float = 1e-5
    bias: tuple[float, float] = (20.0 * RPM, 0.2 * RPM)  # rad/s
    scale: tuple[float, float] = (0.3, 1e-4)
    deviation: tuple[float, float] = (4.0, 0.2)  # degrees; covers a card's harmonics too
    current: tuple[float, float] = (0.3, 2e-3)  # m/s
    velocity_std: float = 0.1  # of GNSS velocity, north and east, m/s
    speed: float = SPEED  # through the water, m/s

    def __post_init__(self) -> None:
        for name in ("vehicle_std", "vehicle_start_std"):
            not_negative(f"heading_tuning.{name}", getattr(self, name))
        for name in ("bias", "scale", "deviation", "current"):
            for value in getattr(self, name):
                not_negative(f"heading_tuning.{name}", value)
        positive("heading_tuning.velocity_std", self.velocity_std)
        positive("heading_tuning.speed", self.speed)

    def pairs(self) -> Floats:
        """(6, 2) start and walk of the states beyond vehicle and compass."""
        return np.array([self.bias, self.scale, self.deviation, self.deviation, self.current, self.current])


PRODUCT = HeadingTuning()
SCALE_ONLY = HeadingTuning(1e-7, 1e-6, (0.0, 0.0), (0.3, 0.0), (0.0, 0.0), (0.0, 0.0))
"""For P4's own world, where vehicle, propellers and noise are known and the compass alone is not."""


class AidedHeadingFilter:
    """An extended Kalman filter of heading; see the module.

    At the end of the last step: heading, heading_std (rad), scale (the compass's gain over the model's) with scale_std,
    bias (rad/s), current (north, east; m/s) and deviation (rad at sine and cosine).
    """

    def __init__(
        self, tuning: HeadingTuning = PRODUCT, compass: CompassModel = TCM2, yaw: HeadingModel = PHYSICAL_YAW
    ) -> None:
        self._model = composite_model(compass, yaw, tuning.vehicle_std**2)
        pairs = tuning.pairs()
        self._walks = pairs[:, 1] ** 2
        self._velocity = (tuning.speed, tuning.velocity_std**2)
        self._state = np.zeros(STATES)
        self._state[SCALE] = 1.0
        start = [tuning.vehicle_start_std**2] * 2 + [STATE_VARIANCE] * 2
        self._covariance = np.diag([*start, *pairs[:, 0] ** 2])
        self._work = np.empty((2, STATES))
        self._ticks = Ticks()

    @property
    def heading(self) -> float:
        return math.radians(heading_deg(self._state, self._model))

    @property
    def heading_std(self) -> float:
        return math.radians(math.sqrt(heading_variance_deg2(self._covariance, self._model)))

    @property
    def scale(self) -> float:
        return float(self._state[SCALE])

    @property
    def scale_std(self) -> float:
        return math.sqrt(self._covariance[SCALE, SCALE])

    @property
    def bias(self) -> float:
        return float(self._state[BIAS])

    @property
    def deviation(self) -> tuple[float, float]:
        return math.radians(self._state[SINE]), math.radians(self._state[COSINE])

    @property
    def current(self) -> tuple[float, float]:
        return float(self._state[CURRENT_NORTH]), float(self._state[CURRENT_EAST])

    def step(
        self,
        difference: float,
        readings: ArrayLike | None = None,
        velocity: tuple[float, float] = (math.nan, math.nan),
        dt: float = 1.0,
        times: ArrayLike | None = None,
    ) -> float:
        """Take a GNSS velocity (north, east, m/s; NaN for none) of now, the readings of the next dt s (rad, any number)
        and advance by n_d (rad/s); returns the heading (rad).

        `readings`, `times` and errors: see `readings.Ticks.parts`.
        """
        difference = checked_difference(difference)
        if np.shape(velocity) != (2,):
            raise InputError(f"heading.velocity has shape {np.shape(velocity)}, expected (north, east)")
        x, p = self._state, self._covariance
        parts = self._ticks.parts(dt, readings, times)
        if math.isfinite(velocity[0]) and math.isfinite(velocity[1]):
            take_velocity(x, p, self._work, self._model, *velocity, *self._velocity)
        for part, table in parts:
            model = stepped(self._model, part)
            take_readings(x, p, self._work, model, table)
            predict_vehicle(x, p, model, difference, self._walks * part)
        return self.heading

    second = formerly("second", step)


@kernel
def take_velocity(
    x: Floats, p: Floats, work: Floats, model: Floats, north: float, east: float, speed: float, variance: float
) -> None:
    """GNSS velocity as two scalars, by the update of every aid."""
    for axis in range(2):
        psi = math.radians(heading_deg(x, model))
        along = speed * (math.cos(psi) if axis == 0 else math.sin(psi))
        turn = math.radians(speed * (-math.sin(psi) if axis == 0 else math.cos(psi)))
        pc, s = work[0], variance
        for j in range(STATES):
            pc[j] = turn * (model[OUTPUT_1] * p[0, j] + model[OUTPUT_2] * p[1, j]) + p[CURRENT_NORTH + axis, j]
        s += turn * (model[OUTPUT_1] * pc[0] + model[OUTPUT_2] * pc[1]) + pc[CURRENT_NORTH + axis]
        measured = north if axis == 0 else east
        take_scalar(x, p, pc, work[1], s, measured - along - x[CURRENT_NORTH + axis])
        fill_lower(p)


OUTPUT_2 = OUTPUT_1 + 1


@kernel
def predict_compass(x: Floats, p: Floats, row: Floats, model: Floats) -> None:
    """One tick: c1 ← a1 c1 + a2 c2 + b (scale ψ + deviation), c2 ← s c1. `row` is workspace (n,)."""
    psi_deg = heading_deg(x, model)
    psi = math.radians(psi_deg)
    sine, cosine, b, shift = math.sin(psi), math.cos(psi), model[B], model[SHIFT]
    slope = b * (x[SCALE] + math.radians(x[SINE] * cosine - x[COSINE] * sine))
    c1 = x[2]
    x[2] = model[A1] * c1 + model[A2] * x[3] + b * (x[SCALE] * psi_deg + x[SINE] * sine + x[COSINE] * cosine)
    x[3] = shift * c1
    g0, g1, g5, g6, g7 = slope * model[OUTPUT_1], slope * model[OUTPUT_2], b * psi_deg, b * sine, b * cosine
    for j in range(STATES):
        own = g0 * p[0, j] + g1 * p[1, j] + model[A1] * p[2, j] + model[A2] * p[3, j]
        row[j] = own + g5 * p[SCALE, j] + g6 * p[SINE, j] + g7 * p[COSINE, j]
    variance = g0 * row[0] + g1 * row[1] + model[A1] * row[2] + model[A2] * row[3]
    variance += g5 * row[SCALE] + g6 * row[SINE] + g7 * row[COSINE]
    late = shift * shift * p[2, 2] + model[COMPASS_NOISE]
    for j in range(STATES):
        if j != 2 and j != 3:
            p[3, j] = p[j, 3] = shift * p[2, j]
            p[2, j] = p[j, 2] = row[j]
    p[2, 3] = p[3, 2] = shift * row[2]
    p[2, 2], p[3, 3] = variance + model[COMPASS_NOISE], late


@kernel
def take_readings(x: Floats, p: Floats, work: Floats, model: Floats, readings: Floats) -> None:
    """The ticks of a table of readings, each reading modulo a turn."""
    k = model[K]
    for tick in range(readings.shape[1]):
        predict_compass(x, p, work[0], model)
        if readings[1, tick] > 0.0:
            innovation = readings[0, tick] - k * x[2]
            innovation -= 360.0 * round(innovation / 360.0)
            for j in range(STATES):
                work[0, j] = k * p[2, j]
            s = k * work[0, 2] + model[READING_NOISE] / readings[1, tick]
            take_scalar(x, p, work[0], work[1], s, innovation)
            fill_lower(p)


@kernel
def predict_vehicle(x: Floats, p: Floats, model: Floats, difference: float, walks: Floats) -> None:
    """One step of the vehicle with n_d + bias, and of the random walks, whose variances (6,) are those of the step."""
    for i in range(2):
        pole, push = model[POLE_1 + i], model[INPUT_1 + i]
        x[i] = pole * x[i] + push * (difference + x[BIAS])
        for j in range(STATES):
            p[i, j] = pole * p[i, j] + push * p[BIAS, j]
        for j in range(STATES):
            p[j, i] = pole * p[j, i] + push * p[j, BIAS]
        p[i, i] += model[VEHICLE_NOISE]
    for i in range(WALKS):
        p[BIAS + i, BIAS + i] += walks[i]
