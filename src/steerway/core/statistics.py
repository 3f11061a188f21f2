"""Figures of merit that several rooms use."""

import numpy as np


def rms(values) -> float:
    """Root mean square of an array of any shape, in its unit; NaN if a value is NaN, or if there is none."""
    values = np.asarray(values, float)
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else float("nan")
