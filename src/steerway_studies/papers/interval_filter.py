"""The interval Kalman filter as printed, P4 (11)–(15) after Chen, Wang and Shieh (1997): the ordinary filter in
interval arithmetic. A number that occurs twice counts as two independent ones, so that the bounds diverge within
seconds. Elsewhere use `steerway.estimation.heading.IntervalFilter`.
"""

import math

import numpy as np

from steerway.core import InputError, kernel
from steerway.estimation.heading.composite import AT, START_VARIANCE
from steerway.estimation.heading.interval.arithmetic import (
    add,
    at,
    divide,
    entry,
    matrix_multiply,
    matrix_multiply_transposed,
    multiply,
    outward_radians,
    point,
    put,
    put_entry,
    scale,
    sound,
    subtract,
)
from steerway.sensors import STATE_VARIANCE, TICKS

WIDEST = 1e6
"""Degrees between the bounds above which they count as diverged."""
WORKSPACE = (6, 4, 4, 2)


class PrintedIntervalFilter:
    """Bounds of the heading (rad) over a box of compasses, (14, 2) from `box_of`, in steps of 1 s.

    `low` and `high` bound the heading in the second that begins. Once `diverged` is true they stay NaN.
    """

    def __init__(self, box: np.ndarray):
        self._box, self._work = box, workspace()
        self._state, self._covariance = np.zeros((4, 2)), np.empty((4, 4, 2))
        start(self._covariance, START_VARIANCE, STATE_VARIANCE)
        self.low = self.high = 0.0
        self.diverged = False

    @property
    def width(self) -> float:
        """Distance of the bounds, rad; NaN once diverged."""
        return self.high - self.low

    def step(self, difference: float, readings) -> tuple[float, float]:
        """Use (40,) readings (rad), then predict by 1 s with n_d (rad/s); returns (low, high), rad.

        Raises InputError for another number of readings, which the printed filter does not have.
        """
        degrees = np.degrees(readings)
        if degrees.shape != (TICKS,):
            raise InputError(f"interval.readings has shape {degrees.shape}, expected ({TICKS},)")
        if not self.diverged:
            low, high = second(self._state, self._covariance, self._box, difference, degrees, self._work)
            self.diverged = not (high - low <= WIDEST)
            self.low, self.high = (math.nan, math.nan) if self.diverged else outward_radians(low, high)
        return self.low, self.high


@kernel
def second(x, p, box, difference, readings_deg, work):
    """A `tick` for each reading, then the vehicle; (low, high) of the heading, degrees; NaN if one is not finite."""
    for k in range(len(readings_deg)):
        tick(x, p, box, readings_deg[k], work)
        for i in range(4):
            if not sound(entry(x, i)) or not sound(at(p, i, i)):
                return math.nan, math.nan
    predict_vehicle(x, p, box, difference, work)
    return heading(x, box)


@kernel
def compass_transition(box, out):
    """A of one tick, (4, 4, 2): P4 (16) with the vehicle's heading as input."""
    out[:] = 0.0
    for i in range(2):
        put(out, i, i, point(1.0))
        put(out, 2, i, multiply(entry(box, AT.b), entry(box, AT.output + i)))
    put(out, 2, 2, entry(box, AT.a1))
    put(out, 2, 3, entry(box, AT.a2))
    put(out, 3, 2, entry(box, AT.shift))


@kernel
def transform(x, p, transition, work):
    """x ← A x (11) and P ← A P Aᵀ (12), without the noise."""
    matrix_multiply(transition, p, work[1])
    matrix_multiply_transposed(work[1], transition, p)
    moved = work[2, 0]
    for i in range(4):
        total = (0.0, 0.0)
        for j in range(4):
            total = add(total, multiply(at(transition, i, j), entry(x, j)))
        put_entry(moved, i, total)
    x[:] = moved


@kernel
def disturb(p, i, variance):
    put(p, i, i, add(at(p, i, i), variance))


@kernel
def tick(x, p, box, reading_deg, work):
    """One tick: predict the compass, correct by a reading. x (4, 2), P (4, 4, 2), box (14, 2), work `workspace()`."""
    compass_transition(box, work[0])
    transform(x, p, work[0], work)
    disturb(p, 2, entry(box, AT.compass_noise))
    disturb(p, 3, entry(box, AT.compass_noise))
    correct(x, p, box, reading_deg, work)


@kernel
def correct(x, p, box, reading_deg, work):
    """AT.k = P Cᵀ (C P Cᵀ + R)⁻¹ (13), x ← x + AT.k (z − C x) (14), P ← (I − AT.k C) P (15)."""
    k = entry(box, AT.k)
    s = add(multiply(multiply(k, at(p, 2, 2)), k), entry(box, AT.reading_noise))
    innovation = subtract(point(reading_deg), multiply(k, entry(x, 2)))
    left = work[0]
    left[:] = 0.0
    for i in range(4):
        put(left, i, i, point(1.0))
    for i in range(4):
        gain = divide(multiply(at(p, i, 2), k), s)
        put(left, i, 2, subtract(at(left, i, 2), multiply(gain, k)))
        put_entry(x, i, add(entry(x, i), multiply(gain, innovation)))
    matrix_multiply(left, p, work[1])
    p[:] = work[1]


@kernel
def predict_vehicle(x, p, box, difference, work):
    """One second of the vehicle, P4 (2)."""
    move = work[0]
    move[:] = 0.0
    for i in range(4):
        put(move, i, i, entry(box, AT.pole + i) if i < 2 else point(1.0))
    transform(x, p, move, work)
    for i in range(2):
        disturb(p, i, entry(box, AT.vehicle_noise))
        put_entry(x, i, add(entry(x, i), scale(difference, entry(box, AT.input + i))))


@kernel
def start(p, vehicle_variance, compass_variance):
    p[:] = 0.0
    for i in range(4):
        put(p, i, i, point(vehicle_variance if i < 2 else compass_variance))


@kernel
def heading(x, box):
    """C v, degrees."""
    return add(multiply(entry(box, AT.output), entry(x, 0)), multiply(entry(box, AT.output + 1), entry(x, 1)))


def workspace() -> np.ndarray:
    return np.empty(WORKSPACE)
