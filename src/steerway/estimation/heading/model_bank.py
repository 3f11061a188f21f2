"""A bank of composite filters, one for each compass: their hull, and their mean by likelihood (Magill 1965, MMAE).

An alarm reports a compass that lies outside the box of the bank's compasses.
"""

import itertools
import math
from collections.abc import Iterable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.estimation.heading.aided import AidedHeadingFilter
from steerway.estimation.heading.composite import START_VARIANCE, FilterBank, composite_model, start_covariance
from steerway.estimation.heading.models import PAPER_YAW, READING_VARIANCE_DEG2, TCM2, CompassModel, HeadingModel
from steerway.estimation.heading.readings import checked_difference

LEAST_WEIGHT = 1e-12
"""Least weight relative to the likeliest, so that every filter can become the likeliest again."""


def corners(tolerance: float, compass: CompassModel = TCM2) -> list[CompassModel]:
    """The 16 corners of the box of four coefficients, and its middle last."""
    return [*grid(tolerance, 2, compass), compass]


def grid(tolerance: float, points: int = 3, compass: CompassModel = TCM2) -> list[CompassModel]:
    """points⁴ compasses, evenly over the box."""
    steps = itertools.product(np.linspace(-tolerance, tolerance, points), repeat=4)
    return [CompassModel(*(c * (1.0 + s) for c, s in zip(compass[:4], each, strict=True))) for each in steps]


class ModelBank(FilterBank):
    """Filters side by side. `headings` (m,), their hull `low` and `high`, and their mean `heading`; all rad, unwrapped.

    `innovation` (deg) is the last filter's mean innovation over the last step; with `corners` the last filter is the
    nominal one. vehicle_variance: of each yaw state at the start; reading_variance: of a reading, deg². Raises
    InputError without a compass.
    """

    def __init__(
        self,
        compasses: Iterable[CompassModel],
        yaw: HeadingModel = PAPER_YAW,
        vehicle_variance: float = START_VARIANCE,
        reading_variance: float = READING_VARIANCE_DEG2,
    ) -> None:
        models = [composite_model(each, yaw, reading_variance=reading_variance) for each in compasses]
        if not models:
            raise InputError("heading.compasses is empty, expected at least one")
        m = len(models)
        covariances = np.repeat(start_covariance(vehicle_variance)[None], m, axis=0)
        super().__init__(np.array(models), np.zeros((m, 4)), covariances)

    @property
    def headings(self) -> Floats:
        return np.radians(self._degrees)

    @property
    def low(self) -> float:
        return float(self.headings.min())

    @property
    def high(self) -> float:
        return float(self.headings.max())

    @property
    def nominal(self) -> float:
        """The last filter's heading."""
        return float(self.headings[-1])

    @property
    def heading(self) -> float:
        return float(self.weights @ self.headings)

    @property
    def heading_std(self) -> float:
        """1σ of the mixture, rad: from the filters' own variances and their spread."""
        return self._spread(self._degrees - self.weights @ self._degrees)

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> float:
        """As `CompositeFilter.step`; returns the mean heading (rad)."""
        difference = checked_difference(difference)
        self._advance(difference, self._ticks.parts(dt, readings, times))
        self._scores = np.maximum(self._scores - self._scores.max(), math.log(LEAST_WEIGHT))
        return self.heading


SIGMAS = 3.0
"""Distance of the scale from the box, in its σ, above which there is an alarm: by chance 0.13 % on either side."""
LARGEST_STD = 0.05
"""1σ of the scale above which no alarm is given; three σ are 15 % of the gain."""


@cache
def gain_range(tolerance: float) -> tuple[float, float]:
    """Least and largest gain, over the TCM2's, within ± tolerance; the gain is monotone in each coefficient."""
    gains = [each.gain / TCM2.gain for each in corners(tolerance)]
    return min(gains), max(gains)


def outside(estimator: AidedHeadingFilter, tolerance: float) -> bool:
    """Whether the compass's gain lies outside the box by more than three of its standard deviations."""
    low, high = gain_range(tolerance)
    spread = estimator.scale_std
    return spread < LARGEST_STD and not low - SIGMAS * spread <= estimator.scale <= high + SIGMAS * spread
