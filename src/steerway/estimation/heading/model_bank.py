"""A bank of composite filters, one a compass: their hull, and their blend by likelihood (Magill 1965, MMAE)."""

import itertools
import math

import numpy as np

from steerway.core.compiled import kernel
from steerway.estimation.heading import composite
from steerway.estimation.heading.composite import START_VARIANCE, composite_model, heading_deg, start_covariance
from steerway.sensors.tcm2 import TCM2, TICKS, CompassModel
from steerway.vessels.springer import PAPER_YAW, HeadingModel

LEAST_WEIGHT = 1e-12
"""No filter is ever given up for good."""


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
    """Filters side by side. `headings` (m,), their hull `low` and `high`, and their blend `heading`; all rad.

    innovation (deg) is the last filter's mean over the last second: of `corners`, the nominal one's.
    """

    def __init__(self, compasses, yaw: HeadingModel = PAPER_YAW, vehicle_variance: float = START_VARIANCE):
        self._models = np.array([composite_model(each, yaw) for each in compasses])
        m = len(self._models)
        self._states = np.zeros((m, 4))
        self._covariances = np.repeat(start_covariance(vehicle_variance)[None], m, axis=0)
        self._scores = np.zeros(m)
        self._innovations = np.full(m, math.nan)
        self._degrees = np.zeros(m)

    @property
    def headings(self) -> np.ndarray:
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
    def weights(self) -> np.ndarray:
        """(m,) probabilities, given that one of the compasses is the true one."""
        likely = np.exp(self._scores - self._scores.max())
        return likely / likely.sum()

    @property
    def heading(self) -> float:
        return math.radians(float(self.weights @ self._degrees))

    def second(self, difference: float, readings) -> float:
        """Take (40,) readings (rad) and go one second on with n_d (rad/s); returns the blend (rad)."""
        _second(
            self._states,
            self._covariances,
            self._models,
            difference,
            np.degrees(readings),
            self._scores,
            self._innovations,
            self._degrees,
        )
        return self.heading


@kernel
def _second(states, covariances, models, difference, readings_deg, scores, innovations, degrees):
    for n in range(len(models)):
        x, p, model = states[n], covariances[n], models[n]
        total = 0.0
        for k in range(TICKS):
            composite.predict_compass(x, p, model)
            innovation, s = composite.correct(x, p, model, readings_deg[k])
            total += innovation
            scores[n] -= 0.5 * (math.log(s) + innovation * innovation / s)
        innovations[n] = total / TICKS
        composite.predict_vehicle(x, p, model, difference)
        degrees[n] = heading_deg(x, model)
    best, floor = scores.max(), math.log(LEAST_WEIGHT)
    for n in range(len(models)):
        scores[n] = max(scores[n] - best, floor)
