"""Statistics of samples of which some are unknown."""

import math

import numpy as np


def rms(values) -> float:
    """Root mean square of the finite values; NaN where there are none."""
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    return float(np.sqrt(np.mean(known * known))) if len(known) else math.nan
