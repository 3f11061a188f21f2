"""Statistics of samples of which some are unknown."""

import math

import numpy as np
from numpy.typing import ArrayLike


def rms(values: ArrayLike) -> float:
    """Root mean square of the known values of an array of any shape, in its unit; NaN where none is known."""
    values = np.asarray(values, dtype=np.float64)
    known = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else math.nan
