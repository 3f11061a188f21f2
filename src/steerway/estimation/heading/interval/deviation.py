"""Bounds of the heading over all compasses whose deviation is within a limit, however it depends on the heading.

The interval filter of P4 (11)–(15) with a box of deviations δ in ± D instead of coefficients, for a compass without
memory that reads ψ + δ + υ. Its gain (13) and covariance (12), (15) do not depend on δ and are plain numbers. The
filter is linear: the middle of the bounds is the estimate for δ = 0; half their distance is propagated with the
absolute values of the coefficients. The bounds stay some 2 D apart, whereas bounds over coefficients diverge.

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
from steerway.estimation.heading.models import HeadingModel
from steerway.estimation.heading.readings import Ticks, checked_difference


class _Bounds(NamedTuple):
    """Intervals of ψ and q, deg: their middle and half their width."""

    psi: float = 0.0
    q: float = 0.0
    psi_half: float = 0.0
    q_half: float = 0.0
    rho: float = 0.0


class _Part(NamedTuple):
    """Parameters of the kernels for steps of one length."""

    motion: Floats  # (4,) two poles, and the changes of h1 and h2 by an input of 1
    noise: Floats  # (2, 2)
    variance: float  # of a reading
    deviation: float


class DeviationBounds:
    """Bounds `low` and `high` (rad) of the Kalman filter's heading over all deviations in the box.

    yaw: model of the boat. deviation: D; reading_std: 1σ of a reading's noise; start_std: 1σ of the first heading,
    which is 0; all rad. vehicle_std: process noise of each of the boat's states, rad/√s. Readings are modulo a turn.
    Raises InputError for numbers below 0, and for a reading_std of 0.
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
        self._bounds = _Bounds()
        # The covariance of ψ and h2.
        self._covariance = math.degrees(not_negative("heading.start_std", start_std)) ** 2 * shape
        self._ticks = Ticks()
        self._length, self._part = 0.0, _Part(np.empty(4), self._noise, 0.0, 0.0)

    @property
    def low(self) -> float:
        return math.radians(self._bounds.psi - self._bounds.psi_half)

    @property
    def high(self) -> float:
        return math.radians(self._bounds.psi + self._bounds.psi_half)

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
            self._bounds = _advance(self._bounds, self._covariance, self._part, difference, table)
        return self.low, self.high

    def turned(self, std: float) -> None:
        """Increase the uncertainty of the heading by a turn that the model does not predict, 1σ `std` (rad)."""
        self._covariance[0, 0] += math.degrees(std) ** 2

    def yaw_rate(self, difference: float) -> float:
        """Yaw rate of the model with n_d (rad/s), in the middle of the bounds; rad/s."""
        poles, inputs, outputs = self._yaw.matrices()
        psi, q, _, _, rho = self._bounds
        second = q + rho * psi
        change = (np.diag(poles) - 1.0) @ np.radians((psi - second, second))
        return float(change + difference * (inputs @ outputs))


@kernel
def _advance(y: _Bounds, p: Floats, part: _Part, difference: float, readings: Floats) -> _Bounds:
    """Take the readings, then a step of the boat."""
    motion, noise = part.motion, part.noise
    for k in range(readings.shape[1]):
        if readings[1, k] > 0.0:
            y = _corrected(y, p, readings[0, k], part.variance / readings[1, k], part.deviation)
    # ψ ← p1 ψ + (p2 − p1) h2 and h2 ← p2 h2, with h2 = q + ρ ψ.
    a, b, c = motion[0], motion[1] - motion[0], motion[1]
    kept, by_psi, by_q = a + b * y.rho, y.rho * (b - b * y.rho), c - b * y.rho
    first, second = difference * motion[2], difference * motion[3]
    psi = kept * y.psi + b * y.q + first + second
    q = by_q * y.q + by_psi * y.psi + second - y.rho * (first + second)
    psi_half = abs(kept) * y.psi_half + abs(b) * y.q_half
    y = _Bounds(psi, q, psi_half, abs(by_q) * y.q_half + abs(by_psi) * y.psi_half, y.rho)
    p_00, p_01, p_11 = p[0, 0], p[0, 1], p[1, 1]
    p[0, 0] = a * a * p_00 + 2.0 * a * b * p_01 + b * b * p_11 + noise[0, 0]
    p[0, 1] = p[1, 0] = c * (a * p_01 + b * p_11) + noise[0, 1]
    p[1, 1] = c * c * p_11 + noise[1, 1]
    return y


@kernel
def _corrected(y: _Bounds, p: Floats, reading: float, variance: float, deviation: float) -> _Bounds:
    """P4 (13)–(15): ψ ← (1 − K) ψ + K (z − δ); h2 − ρ ψ does not change."""
    rho, gain = p[0, 1] / p[0, 0], p[0, 0] / (p[0, 0] + variance)
    reading += 360.0 * round((y.psi - reading) / 360.0)
    q, q_half = y.q + (y.rho - rho) * y.psi, y.q_half + abs(y.rho - rho) * y.psi_half
    psi, psi_half = (1.0 - gain) * y.psi + gain * reading, (1.0 - gain) * y.psi_half + gain * deviation
    p[1, 1] -= gain * rho * p[0, 1]
    p[0, 1] = p[1, 0] = p[0, 1] * (1.0 - gain)
    p[0, 0] *= 1.0 - gain
    return _Bounds(psi, q, psi_half, q_half, rho)
