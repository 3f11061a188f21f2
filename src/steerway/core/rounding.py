"""Finds the number of decimals in recorded values."""

from collections.abc import Sequence

import numpy as np


def decimal_step(values: np.ndarray, steps: Sequence[float], tolerance: float, share: float = 1.0) -> float:
    """The first of `steps` of which at least `share` of the values (n,) are whole multiples; NaN if none is.

    `tolerance` in parts of a step: more than the error of arithmetic, less than chance gives many values.
    """
    for step in steps:
        parts = values / step
        if np.mean(np.abs(parts - np.round(parts)) < tolerance) >= share:
            return float(step)
    return float("nan")
