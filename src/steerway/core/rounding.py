"""Finds the number of decimals in recorded values."""

from collections.abc import Sequence

import numpy as np

_ANGLES = sorted([10.0**-k for k in range(2, 10)] + [10.0**-k / 60.0 for k in range(8)], reverse=True)
"""Last decimals of a written angle in degrees, of degrees or of minutes."""
_LEFT, _SHARE = 2e-3, 0.98
"""What is left of a decimal's rounding after degrees, minutes and radians, and the share of values that have it."""


def last_digit(angles: np.ndarray) -> float:
    """The last decimal, of degrees or of minutes, in which these angles (n,) rad are written, in rad; NaN if none."""
    return float(np.radians(decimal_step(np.degrees(angles), _ANGLES, _LEFT, _SHARE)))


def decimal_step(values: np.ndarray, steps: Sequence[float], tolerance: float, share: float = 1.0) -> float:
    """The first of `steps` of which at least `share` of the values (n,) are whole multiples; NaN if none is.

    `tolerance` in parts of a step: more than the error of arithmetic, less than chance gives many values.
    """
    for step in steps:
        parts = values / step
        if np.mean(np.abs(parts - np.round(parts)) < tolerance) >= share:
            return float(step)
    return float("nan")
