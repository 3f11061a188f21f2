"""A bank of composite filters, one a compass: their hull, and their mean by likelihood (Magill 1965, MMAE)."""

import itertools
import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.estimation.heading import composite
from steerway.estimation.heading.composite import (
    START_VARIANCE,
    composite_model,
    heading_deg,
    heading_variance_deg2,
    start_covariance,
    stepped,
)
from steerway.estimation.heading.models import PAPER_YAW, READING_VARIANCE_DEG2, TCM2, CompassModel, HeadingModel
from steerway.estimation.heading.readings import Ticks, checked_difference

LEAST_WEIGHT = 1e-12
"""Least weight relative to the likeliest, so that every filter can become the likeliest again. Chosen."""


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


class ModelBank:
    """Filters side by side. `headings` (m,), their hull `low` and `high`, and their mean `heading`; all rad, unwrapped.

    `innovation` (deg) is the last filter's mean over the last step: of `corners`, the nominal one's. vehicle_variance:
    of each state of yaw at first; reading_variance: of a reading, deg². Raises InputError without a compass.
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
        self._states = np.zeros((m, 4))
        self._covariances = np.repeat(start_covariance(vehicle_variance)[None], m, axis=0)
        self._scores = np.zeros(m)
        self._innovations = np.full(m, math.nan)
        self._degrees = np.zeros(m)
        self._ticks = Ticks()

    @property
    def headings(self) -> Floats:
        return np.radians(self._degrees)

    @property
    def low(self) -> float:
        return math.radians(self._degrees.min())

    @property
    def high(self) -> float:
        return math.radians(self._degrees.max())

    @property
    def nominal(self) -> float:
        """The last filter's heading."""
        return math.radians(self._degrees[-1])

    @property
    def innovation(self) -> float:
        return float(self._innovations[-1])

    @property
    def weights(self) -> Floats:
        """(m,) probabilities, given that one of the compasses is the true one."""
        likely = np.exp(self._scores - self._scores.max())
        return likely / likely.sum()

    @property
    def heading(self) -> float:
        return math.radians(float(self.weights @ self._degrees))

    @property
    def heading_std(self) -> float:
        """1σ of the mixture, rad: from the filters' own variances and their spread."""
        own = [heading_variance_deg2(p, model) for p, model in zip(self._covariances, self._models, strict=True)]
        apart = self._degrees - self.weights @ self._degrees
        return math.radians(math.sqrt(self.weights @ (own + apart * apart)))

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> float:
        """As `CompositeFilter.step`; returns the mean heading (rad)."""
        difference = checked_difference(difference)
        sums, taken = np.zeros(len(self._models)), 0.0
        for part, table in self._ticks.parts(dt, readings, times):
            models = self._models if part == 1.0 else np.array([stepped(each, part) for each in self._models])
            taken += _advance(
                self._states, self._covariances, models, difference, table, self._scores, sums, self._degrees
            )
        self._innovations = sums / taken if taken else np.full(len(sums), math.nan)
        return self.heading


@kernel
def _advance(
    states: Floats,
    covariances: Floats,
    models: Floats,
    difference: float,
    readings: Floats,
    scores: Floats,
    innovations: Floats,
    degrees: Floats,
) -> float:
    """`composite.advance` for every filter, its heading into `degrees`, its innovations (deg) added to `innovations`.

    Returns the number of ticks with readings.
    """
    taken = 0.0
    for n in range(len(models)):
        x, p, model = states[n], covariances[n], models[n]
        taken = 0.0
        for k in range(readings.shape[1]):
            composite.predict_compass(x, p, model)
            if readings[1, k] > 0.0:
                innovation, s = composite.correct(x, p, model, readings[0, k], readings[1, k])
                innovations[n] += innovation
                scores[n] -= 0.5 * (math.log(s) + innovation * innovation / s)
                taken += 1.0
        composite.predict_vehicle(x, p, model, difference)
        degrees[n] = heading_deg(x, model)
    best, floor = scores.max(), math.log(LEAST_WEIGHT)
    for n in range(len(models)):
        scores[n] = max(scores[n] - best, floor)
    return taken
