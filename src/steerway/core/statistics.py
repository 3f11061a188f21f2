"""Gates, quantiles, and statistics of samples of which some are unknown."""

import math

import numpy as np
from numpy.typing import ArrayLike

FIX_GATE, AID_GATE = 13.8, 10.8
"""On the normalised innovation squared of a fix and of a scalar: χ² with two degrees of freedom and one at 0.1 %."""
NORMAL_95 = 1.959963984540054
"""Half the width of a 95 % interval in standard deviations: 0.975 quantile of the normal distribution."""


def rms(values: ArrayLike) -> float:
    """Root mean square of the known values of an array of any shape, in its unit; NaN where none is known."""
    values = np.asarray(values, dtype=np.float64)
    known = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else math.nan
