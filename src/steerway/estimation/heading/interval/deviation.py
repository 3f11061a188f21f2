"""Bounds of the heading over all compasses whose deviation is within a limit, however it depends on the heading.

The interval filter of P4 (11)–(15) with a box of deviations δ in ± D instead of coefficients, for a compass without
memory that reads ψ + δ + υ. Its gain (13) and covariance (12), (15) do not depend on δ and are plain numbers. The
bounds stay some 2 D apart, whereas bounds over coefficients diverge.

The heading has two parts, ψ = h1 + h2, P4 (2). The filter keeps intervals of ψ and of q = h2 − ρ ψ, with ρ the
regression of h2 on ψ. A reading corrects h2 by ρ times as much as ψ, so that q does not change and ψ contracts.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.estimation.heading.interval.arithmetic import (
    add,
    entry,
    multiply,
    outward_radians,
    point,
    put_entry,
    scale,
    subtract,
)
from steerway.estimation.heading.models import HeadingModel
from steerway.estimation.heading.readings import Ticks, checked_difference

PSI, Q, RHO = range(3)


class _Part(NamedTuple):
    """Parameters of the kernels for steps of one length."""

    motion: Floats  # (4,) two poles, and the changes of h1 and h2 by an input of 1
    noise: Floats  # (2, 2)
    variance: float  # of a reading
    deviation: float


class DeviationBounds:
    """Bounds `low` and `high` (rad) of the Kalman filter's heading over all deviations in the box.

    yaw: the boat. deviation: D; reading_std: 1σ of a reading's noise; start_std: 1σ of the first heading, which is 0;
    all rad. vehicle_std: process noise of each of the boat's states, rad/√s. Readings are modulo a turn. Raises
    InputError for numbers below 0, and for a reading_std of 0.
    """

    def __init__(
        self, yaw: HeadingModel, deviation: float, reading_std: float, vehicle_std: float, start_std: float = math.pi
    ) -> None:
        self._yaw = yaw
        self._deviation = math.degrees(not_negative("heading.deviation", deviation))
        self._reading_variance = math.degrees(positive("heading.reading_std", reading_std)) ** 2
        spread = np.array(yaw.outputs) ** 2
        shape = np.array([[spread.sum(), spread[1]], [spread[1], spread[1]]])
        self._noise = math.degrees(not_negative("heading.vehicle_std", vehicle_std)) ** 2 * shape
        self._bounds = np.zeros((3, 2))  # of ψ, q and ρ, in degrees
        # The covariance of ψ and h2.
        self._covariance = math.degrees(not_negative("heading.start_std", start_std)) ** 2 * shape
        self._ticks = Ticks()
        self._length, self._part = 0.0, _Part(np.empty(4), self._noise, 0.0, 0.0)

    @property
    def low(self) -> float:
        return float(outward_radians(*self._bounds[PSI])[0])

    @property
    def high(self) -> float:
        return float(outward_radians(*self._bounds[PSI])[1])

    @property
    def heading_std(self) -> float:
        """1σ (rad) of the heading, for the noise and a deviation anywhere in the box."""
        return math.sqrt(math.radians(math.sqrt(self._covariance[0, 0])) ** 2 + (self.high - self.low) ** 2 / 12.0)

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> tuple[float, float]:
        """As `CompositeFilter.step`; returns (low, high), rad."""
        difference = checked_difference(difference)
        for part, table in self._ticks.parts(dt, readings, times):
            if part != self._length:
                poles, inputs, outputs = self._yaw.matrices(part)
                motion = np.array([*np.diag(poles), *np.degrees(outputs * inputs)])
                self._length = part
                self._part = _Part(motion, part * self._noise, self._reading_variance, self._deviation)
            _advance(self._bounds, self._covariance, self._part, difference, table)
        return self.low, self.high

    def turned(self, std: float) -> None:
        """Increase the uncertainty of the heading by a turn that the model does not predict, 1σ `std` (rad)."""
        self._covariance[0, 0] += math.degrees(std) ** 2

    def yaw_rate(self, difference: float) -> float:
        """Yaw rate of the model with n_d (rad/s), in the middle of the bounds; rad/s."""
        poles, inputs, outputs = self._yaw.matrices()
        psi, q = np.radians(self._bounds[:RHO].mean(axis=1))
        second = q + self._bounds[RHO, 0] * psi
        change = (np.diag(poles) - 1.0) @ (psi - second, second)
        return float(change + difference * (inputs @ outputs))


@kernel
def _advance(y: Floats, p: Floats, part: _Part, difference: float, readings: Floats) -> None:
    """Take the readings, then a step of the boat."""
    motion, noise = part.motion, part.noise
    for k in range(readings.shape[1]):
        if readings[1, k] > 0.0:
            _correct(y, p, readings[0, k], part.variance / readings[1, k], part.deviation)
    psi, q, rho = entry(y, PSI), entry(y, Q), point(y[RHO, 0])
    pole, faster = point(motion[0]), subtract(point(motion[1]), point(motion[0]))
    shared = multiply(faster, rho)
    first, second = scale(difference, point(motion[2])), scale(difference, point(motion[3]))
    # ψ = p1 ψ + (p2 − p1) h2 and h2 = p2 h2, with h2 = q + ρ ψ, using each number once.
    by_psi, by_q = multiply(rho, subtract(faster, shared)), subtract(add(pole, faster), shared)
    pushed = add(first, second)
    put_entry(y, PSI, add(add(multiply(add(pole, shared), psi), multiply(faster, q)), pushed))
    put_entry(y, Q, add(add(multiply(by_q, q), multiply(by_psi, psi)), subtract(second, multiply(rho, pushed))))
    a, b, c = motion[0], motion[1] - motion[0], motion[1]
    p_00, p_01, p_11 = p[0, 0], p[0, 1], p[1, 1]
    p[0, 0] = a * a * p_00 + 2.0 * a * b * p_01 + b * b * p_11 + noise[0, 0]
    p[0, 1] = p[1, 0] = c * (a * p_01 + b * p_11) + noise[0, 1]
    p[1, 1] = c * c * p_11 + noise[1, 1]


@kernel
def _correct(y: Floats, p: Floats, reading: float, variance: float, deviation: float) -> None:
    """P4 (13)–(15): ψ ← (1 − K) ψ + K (z − δ); h2 − ρ ψ does not change."""
    rho = p[0, 1] / p[0, 0]
    psi = entry(y, PSI)
    put_entry(y, Q, add(entry(y, Q), multiply(subtract(point(y[RHO, 0]), point(rho)), psi)))
    y[RHO, 0] = y[RHO, 1] = rho
    gain = p[0, 0] / (p[0, 0] + variance)
    reading += 360.0 * round((0.5 * (psi[0] + psi[1]) - reading) / 360.0)
    seen = add(point(reading), (-deviation, deviation))
    put_entry(y, PSI, add(multiply(subtract(point(1.0), point(gain)), psi), scale(gain, seen)))
    p[1, 1] -= gain * rho * p[0, 1]
    p[0, 1] = p[1, 0] = p[0, 1] * (1.0 - gain)
    p[0, 0] *= 1.0 - gain
