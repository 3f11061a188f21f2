"""A bank of composite filters, one for each compass: their hull, and their mean by likelihood (Magill 1965, MMAE).

An alarm reports a compass that lies outside the box of the bank's compasses.
"""

import itertools
import math
from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.estimation.heading.aided import AidedHeadingFilter
from steerway.estimation.heading.composite import (
    START_VARIANCE,
    advance,
    composite_model,
    heading_deg,
    heading_variance_deg2,
    start_covariance,
    stepped,
)
from steerway.estimation.heading.models import PAPER_YAW, READING_VARIANCE_DEG2, TCM2, CompassModel, HeadingModel
from steerway.estimation.heading.readings import Ticks, checked_difference

LEAST_WEIGHT = 1e-12
"""Least weight relative to the likeliest, so that every filter can become the likeliest again."""


def corners(tolerance: float, compass: CompassModel = TCM2) -> list[CompassModel]:
    """The 16 corners of the box of four coefficients, and its middle last."""
    signs = itertools.product((-1.0, 1.0), repeat=4)
    away = [
        CompassModel(*(c * (1.0 + s * tolerance) for c, s in zip(compass[:4], each, strict=True))) for each in signs
    ]
    return [*away, compass]


def grid(tolerance: float, points: int = 3, compass: CompassModel = TCM2) -> list[CompassModel]:
    """points⁴ compasses, evenly over the box."""
    steps = itertools.product(np.linspace(-tolerance, tolerance, points), repeat=4)
    return [CompassModel(*(c * (1.0 + s) for c, s in zip(compass[:4], each, strict=True))) for each in steps]


class _Bank(NamedTuple):
    """The state of m filters."""

    states: Floats  # (m, 4)
    covariances: Floats  # (m, 4, 4)
    scores: Floats  # (m,) log likelihood relative to the best
    innovations: Floats  # (m,) deg
    degrees: Floats  # (m,) heading


class ModelBank:
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
        self._models = np.array(models)
        m = len(self._models)
        covariances = np.repeat(start_covariance(vehicle_variance)[None], m, axis=0)
        self._bank = _Bank(np.zeros((m, 4)), covariances, np.zeros(m), np.full(m, math.nan), np.zeros(m))
        self._ticks = Ticks()

    @property
    def headings(self) -> Floats:
        return np.radians(self._bank.degrees)

    @property
    def low(self) -> float:
        return math.radians(self._bank.degrees.min())

    @property
    def high(self) -> float:
        return math.radians(self._bank.degrees.max())

    @property
    def nominal(self) -> float:
        """The last filter's heading."""
        return math.radians(self._bank.degrees[-1])

    @property
    def innovation(self) -> float:
        return float(self._bank.innovations[-1])

    @property
    def weights(self) -> Floats:
        """(m,) probabilities, given that one of the compasses is the true one."""
        likely = np.exp(self._bank.scores - self._bank.scores.max())
        return likely / likely.sum()

    @property
    def heading(self) -> float:
        return math.radians(float(self.weights @ self._bank.degrees))

    @property
    def heading_std(self) -> float:
        """1σ of the mixture, rad: from the filters' own variances and their spread."""
        own = [heading_variance_deg2(p, model) for p, model in zip(self._bank.covariances, self._models, strict=True)]
        apart = self._bank.degrees - self.weights @ self._bank.degrees
        return math.radians(math.sqrt(self.weights @ (own + apart * apart)))

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> float:
        """As `CompositeFilter.step`; returns the mean heading (rad)."""
        difference = checked_difference(difference)
        bank, taken = self._bank, 0.0
        bank.innovations[:] = 0.0
        for part, table in self._ticks.parts(dt, readings, times):
            models = self._models if part == 1.0 else np.array([stepped(each, part) for each in self._models])
            taken += _advance(bank, models, difference, table)
        bank.innovations[:] = bank.innovations / taken if taken else math.nan
        return self.heading


@kernel
def _advance(bank: _Bank, models: Floats, difference: float, readings: Floats) -> float:
    """`composite.advance` for every filter. Returns the number of ticks with readings."""
    taken = 0.0
    for n in range(len(models)):
        sums = advance(bank.states[n], bank.covariances[n], models[n], difference, readings)
        bank.innovations[n] += sums.innovation
        bank.scores[n] -= 0.5 * (sums.log + sums.square)
        bank.degrees[n] = heading_deg(bank.states[n], models[n])
        taken = sums.number
    best, floor = bank.scores.max(), math.log(LEAST_WEIGHT)
    for n in range(len(models)):
        bank.scores[n] = max(bank.scores[n] - best, floor)
    return taken


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
