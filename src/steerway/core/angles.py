"""Angles: wrapping to one turn, the smallest signed difference, and sin a / a."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from steerway.core.compiled import kernel, lean_kernel

TURN = 2.0 * math.pi


@kernel
def wrap(angle: float) -> float:
    """The same direction in [−π, π); P0's ssa under (54). Scalar, rad."""
    if -math.pi <= angle < math.pi:
        return angle
    wrapped = (angle + math.pi) % TURN - math.pi
    return -math.pi if wrapped >= math.pi else wrapped  # in this order NaN stays NaN


@lean_kernel
def sinc(angle: float) -> tuple[float, float]:
    """(sin a)/a and its derivative."""
    if abs(angle) < 0.05:
        b = angle * angle
        ratio = 1.0 - b * (1.0 / 6.0 - b * (1.0 / 120.0 - b * (1.0 / 5040.0)))
        return ratio, -angle * (1.0 / 3.0 - b * (1.0 / 30.0 - b * (1.0 / 840.0 - b * (1.0 / 45360.0))))
    ratio = math.sin(angle) / angle
    return ratio, (math.cos(angle) - ratio) / angle


def wrap_array(angles: ArrayLike) -> NDArray[np.float64]:
    """`wrap` for an array of any shape, rad. NaN and angles already in [−π, π) are returned unchanged."""
    angles = np.asarray(angles, dtype=np.float64)
    wrapped = np.mod(angles + np.pi, TURN) - np.pi
    kept = (angles >= -np.pi) & (angles < np.pi)
    return np.where(kept, angles, np.where(wrapped >= np.pi, -np.pi, wrapped))
