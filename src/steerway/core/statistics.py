"""Gates, quantiles, and statistics of samples of which some are unknown; the decimals in which they are written."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

FIX_GATE, AID_GATE = 13.8, 10.8
"""On the normalised innovation squared of a fix and of a scalar: χ² with two degrees of freedom and one at 0.1 %."""
UNBROKEN_REJECTION = 2.0
"""s of unbroken rejections after which a filter is taken to be wrong: three fixes at 1 Hz, of which one may be a
jump."""
DIFFUSE_SPEED_STD = 20.0
"""m/s, 1σ of a speed of which nothing is known: 40 kn, as fast as vessels are."""
DEVIATION_OF_MEDIAN = 1.4826
"""Standard deviation of a normal distribution over the median absolute one: 1/Φ⁻¹(3/4)."""
_ROUNDING = 1e-12
"""rad, m: without errors, with the true motion as estimate, σ is 0."""
NORMAL_95 = 1.959963984540054
"""Half the width of a 95 % interval in standard deviations: 0.975 quantile of the normal distribution."""
_ANGLES = sorted([10.0**-k for k in range(2, 10)] + [10.0**-k / 60.0 for k in range(8)], reverse=True)
"""Last decimals of a written angle in degrees, of degrees or of minutes."""
_LEFT, _SHARE = 2e-3, 0.98
"""Steps of the last decimal by which a value may be off after conversions between degrees, minutes and radians; and the
share of values that have to be within that."""


def share_within(errors: ArrayLike, std: ArrayLike) -> float:
    """% of the known errors that lie within ± 2σ (95 where normal and σ is right); NaN where none is known."""
    ratio = np.abs(np.asarray(errors, dtype=np.float64))
    known = np.isfinite(ratio + std)
    return 100.0 * float(np.mean((ratio <= 2.0 * np.asarray(std) + _ROUNDING)[known])) if known.any() else math.nan


def rms(values: ArrayLike) -> float:
    """Root mean square of the known values of an array of any shape, in its unit; NaN where none is known."""
    values = np.asarray(values, dtype=np.float64)
    known = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else math.nan


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
