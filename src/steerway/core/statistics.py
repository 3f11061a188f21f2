"""Gates, quantiles, statistics of samples with unknown values, and the number of decimals of written numbers."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

FIX_GATE, AID_GATE = 13.8, 10.8
"""Gates on the NIS of a fix (two degrees of freedom) and of a scalar (one): 99.9 % quantiles of χ²."""
UNBROKEN_REJECTION = 2.0
"""Duration of unbroken rejections, s, after which the filter counts as wrong, not the fixes. At 1 Hz it spans three
fixes, one of which may be an outlier."""
DIFFUSE_SPEED_STD = 20.0
"""Prior 1σ of an unknown speed, m/s: 40 kn, the speed of fast vessels."""
DEVIATION_OF_MEDIAN = 1.4826
"""Standard deviation of a normal distribution divided by its median absolute deviation: 1/Φ⁻¹(3/4)."""
_ROUNDING = 1e-12
"""Tolerance for rounding errors, rad or m. It matters where σ is 0, as when the true motion serves as the estimate."""
NORMAL_95 = 1.959963984540054
"""Half the width of a 95 % interval in standard deviations: 0.975 quantile of the normal distribution."""
_ANGLES = sorted([10.0**-k for k in range(2, 10)] + [10.0**-k / 60.0 for k in range(8)], reverse=True)
"""Possible steps (degrees) of the last decimal of a written angle, in degrees or in minutes."""
_LEFT, _SHARE = 2e-3, 0.98
"""Tolerance for conversions between degrees, minutes and radians, in steps of the last decimal; and the share of values
that must be within this tolerance."""


def share_within(errors: ArrayLike, std: ArrayLike) -> float:
    """% of the known errors that lie within ± 2σ (95 if they are normal and σ is calibrated); NaN if none is known."""
    ratio = np.abs(np.asarray(errors, dtype=np.float64))
    known = np.isfinite(ratio + std)
    return 100.0 * float(np.mean((ratio <= 2.0 * np.asarray(std) + _ROUNDING)[known])) if known.any() else math.nan


def rms(values: ArrayLike) -> float:
    """Root mean square of the known values of an array of any shape, in its unit; NaN if none is known."""
    values = np.asarray(values, dtype=np.float64)
    known = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else math.nan


def last_digit(angles: np.ndarray) -> float:
    """One unit (rad) of the last decimal (degrees or minutes) to which angles (n,) rad were rounded; NaN if none."""
    return float(np.radians(decimal_step(np.degrees(angles), _ANGLES, _LEFT, _SHARE)))


def decimal_step(values: np.ndarray, steps: Sequence[float], tolerance: float, share: float = 1.0) -> float:
    """The first of `steps` such that at least `share` of the values (n,) are whole multiples of it; NaN without one.

    tolerance: in steps; larger than rounding errors, and so small that few other values are within it by chance.
    """
    for step in steps:
        parts = values / step
        if np.mean(np.abs(parts - np.round(parts)) < tolerance) >= share:
            return float(step)
    return float("nan")
