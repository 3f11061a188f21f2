"""Any number of thrusters that together give a force in surge and sway and a moment in yaw.

τ = B f with f the thrusts; the allocation is f = B⁺ τ (Fossen 2021, section 11.2). Where that exceeds a thruster's
limits, it is held there and what is missing is asked of the others (Bordignon 1996, redistributed pseudo-inverse).
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.errors import InputError

_RANK = 1e-9
"""Singular values, over the largest, that count as none."""


def thruster_matrix(places: Sequence[tuple[float, float, float]]) -> Floats:
    """B (3, n) of thrusters at (m ahead, m to starboard) that push at an angle (rad, + to starboard) from ahead."""
    columns = [(math.cos(a), math.sin(a), x * math.sin(a) - y * math.cos(a)) for x, y, a in places]
    return np.array(columns, dtype=np.float64).reshape(-1, 3).T


class Thrusters:
    """The allocation for B (3, n), thrusts from `low` to `high` (n,), N.

    Raises InputError for shapes that do not fit, limits that leave nothing, and thrusters that together do not push in
    every direction.
    """

    def __init__(self, matrix: ArrayLike, low: ArrayLike, high: ArrayLike):
        self.matrix, self.low, self.high = (np.array(each, dtype=np.float64) for each in (matrix, low, high))
        if self.matrix.ndim != 2 or self.matrix.shape[0] != 3 or not np.isfinite(self.matrix).all():
            raise InputError(f"thrusters.matrix has shape {self.matrix.shape}, expected (3, n) numbers")
        if not self.low.shape == self.high.shape == self.matrix.shape[1:]:
            raise InputError(f"thrusters.high has shape {self.high.shape}, expected one for each of the thrusters")
        if not ((self.low <= 0.0) & (self.high > 0.0)).all():
            raise InputError(f"thrusters are limited to {self.low} to {self.high} N, expected 0 N between")
        if np.linalg.matrix_rank(self.matrix, _RANK) < 3:
            raise InputError("thrusters do not give surge, sway and yaw together, expected three independent ones")

    def allocate(self, force: ArrayLike) -> tuple[Floats, Floats]:
        """(thrusts (n,), force (3,) that they give) for a wanted force (surge N, sway N, yaw N·m)."""
        wanted = np.asarray(force, dtype=np.float64)
        thrusts, free = np.zeros(len(self.low)), np.ones(len(self.low), dtype=bool)
        while free.any():
            missing = wanted - self.matrix[:, ~free] @ thrusts[~free]
            thrusts[free] = np.linalg.pinv(self.matrix[:, free], _RANK) @ missing
            beyond = free & ((thrusts < self.low) | (thrusts > self.high))
            thrusts = np.clip(thrusts, self.low, self.high)
            if not beyond.any():
                break
            free &= ~beyond
        return thrusts, self.matrix @ thrusts

    def step(self, surge_force: float, yaw: float) -> tuple[float, ...]:
        """The thrusts, then the achieved force and moment, without a force in sway: for `pilot.Pilot`."""
        thrusts, (surge, _, moment) = self.allocate((surge_force, 0.0, yaw))
        return (*thrusts.tolist(), float(surge), float(moment))
