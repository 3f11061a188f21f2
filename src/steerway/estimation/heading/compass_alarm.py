"""An alarm for a compass that no model in the box explains: its gain, estimated as a scale state, lies outside."""

from functools import cache

from steerway.estimation.heading.aided import AidedHeadingFilter
from steerway.estimation.heading.model_bank import corners
from steerway.estimation.heading.models import TCM2

SIGMAS = 3.0
"""Standard deviations of the scale beyond the box: by chance 0.13 % on either side (normal)."""
LARGEST_STD = 0.05
"""1σ of the scale above which no alarm is given. Chosen: three of them are 15 % of the gain."""


@cache
def gain_range(tolerance: float) -> tuple[float, float]:
    """Least and largest gain, over the TCM2's own, within ± tolerance. It is monotone in each coefficient."""
    gains = [each.gain / TCM2.gain for each in corners(tolerance)]
    return min(gains), max(gains)


def outside(estimator: AidedHeadingFilter, tolerance: float) -> bool:
    """Whether the compass's gain lies outside the box by more than three of its standard deviations."""
    low, high = gain_range(tolerance)
    spread = estimator.scale_std
    return spread < LARGEST_STD and not low - SIGMAS * spread <= estimator.scale <= high + SIGMAS * spread
