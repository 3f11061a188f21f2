"""Dynamic positioning: PID control of position and heading by forces in surge, sway and yaw; P2 §II-C.

τ = K_p Rᵀe + K_i ∫Rᵀe dt − K_d ν with e = η_d − η and the heading error wrapped. P2 (30) as printed has positive
feedback and does not rotate the error from NED to the body frame.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.checks import array_of, not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError


@dataclass(frozen=True)
class PositioningGains:
    """K_p, K_i and K_d, (3, 3) in surge, sway and yaw, and the `limit` (3,) of the forces (N, N, N·m)."""

    proportional: np.ndarray
    integral: np.ndarray
    derivative: np.ndarray
    limit: tuple[float, ...] = (math.inf,) * 3

    def __post_init__(self) -> None:
        for name in ("proportional", "integral", "derivative"):
            matrix = np.array(getattr(self, name), dtype=np.float64)
            if matrix.shape != (3, 3):
                raise InputError(f"positioning.{name} has shape {matrix.shape}, expected (3, 3)")
            object.__setattr__(self, name, matrix)
        if len(self.limit) != 3 or not all(value > 0.0 for value in self.limit):
            raise InputError(f"positioning.limit is {self.limit}, expected three numbers above 0")


def by_bandwidth(
    inertia: ArrayLike,
    bandwidth: float,
    damping: float = 1.0,
    integral: float = 0.1,
    limit: Sequence[float] = (math.inf,) * 3,
) -> PositioningGains:
    """K_p = ω_n² M, K_d = 2ζω_n M, K_i = `integral` ω_n K_p; P2 (31)–(33) with the mass matrix M in place of m.

    The vessel's own damping adds to K_d. Raises InputError for a bandwidth or damping that is not positive.
    """
    inertia = array_of("positioning.inertia", inertia, (3, 3))
    proportional = positive("positioning.bandwidth", bandwidth) ** 2 * inertia
    derivative = 2.0 * positive("positioning.damping", damping) / bandwidth * proportional
    share = not_negative("positioning.integral", integral) * bandwidth
    return PositioningGains(proportional, share * proportional, derivative, tuple(limit))


@kernel
def position_pid(
    desired: Floats,
    north: float,
    east: float,
    heading: float,
    velocity: Floats,
    integral: Floats,
    proportional: Floats,
    derivative: Floats,
) -> tuple[Floats, Floats]:
    """(desired force (3,), error in the body frame (3,)); `integral` (3,) is in N, N, N·m."""
    c, s = math.cos(heading), math.sin(heading)
    to_north, to_east = desired[0] - north, desired[1] - east
    error = np.array([c * to_north + s * to_east, c * to_east - s * to_north, wrap(desired[2] - heading)])
    wanted = np.empty(3)
    for i in range(3):
        wanted[i] = integral[i]
        for j in range(3):
            wanted[i] += proportional[i, j] * error[j] - derivative[i, j] * velocity[j]
    return wanted, error


class PositionPID:
    """Holds a position and heading; `step` returns the force within its limits.

    An integral does not move further into the limit of its force. Without `anti_windup`, as in the paper, it winds up
    during every long move to a new position.
    """

    def __init__(self, gains: PositioningGains, anti_windup: bool = True):
        self.gains = gains
        self.anti_windup = anti_windup
        self._limit = np.array(gains.limit, dtype=np.float64)
        self.restart()

    def restart(self) -> None:
        """Reset the integral, which counteracts wind and current."""
        self.integral = np.zeros(3)

    def step(
        self, desired: Sequence[float], north: float, east: float, heading: float, velocity: Sequence[float], dt: float
    ) -> np.ndarray:
        """Force (3,) for a `desired` (north, east, heading); `velocity` (surge, sway, yaw rate); m, rad, s."""
        gains = self.gains
        wanted, error = position_pid(
            np.asarray(desired, dtype=np.float64),
            north,
            east,
            heading,
            np.asarray(velocity, dtype=np.float64),
            self.integral,
            gains.proportional,
            gains.derivative,
        )
        force = np.minimum(np.maximum(wanted, -self._limit), self._limit)
        push = dt * (gains.integral @ error)
        further = self.anti_windup & (push * (wanted - force) > 0.0)
        self.integral += np.where(further, 0.0, push)
        return force
