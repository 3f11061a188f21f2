"""Estimators of Springer's heading, by name: the paper's filters, its weighted bounds, the rivals and the product."""

import math

from steerway.estimation.heading import (
    SCALE_ONLY,
    AidedHeadingFilter,
    CompositeFilter,
    HeadingTuning,
    IntervalFilter,
    LearnedHeading,
    ModelBank,
    box_of,
    composite_model,
    corners,
    grid,
    ideal_weight,
    weighted,
)
from steerway.sensors import TCM2, CompassModel
from steerway.vessels import SPRINGER_PAPER_YAW as PAPER_YAW
from steerway.vessels import SPRINGER_PHYSICAL_YAW as PHYSICAL_YAW
from steerway.vessels import HeadingModel
from steerway_studies.springer_mission.world import Blind, HeadingSource


def ideal(compass: CompassModel, yaw: HeadingModel = PAPER_YAW) -> Blind:
    """The filter that knows the true compass."""
    return Blind(CompositeFilter(composite_model(compass, yaw)))


def nominal(yaw: HeadingModel = PAPER_YAW) -> Blind:
    """The filter of P4 (7)."""
    return Blind(CompositeFilter(composite_model(TCM2, yaw)))


class WeightedBounds:
    """P4's estimate: bounds of an interval filter and a weight, from the ideal filter (20) or fixed.

    Once the bounds are lost so is the estimate: NaN, which the autopilot predicts over.
    """

    def __init__(self, bounds: IntervalFilter, compass: CompassModel | None = None, weight: float = 0.5):
        self.bounds = bounds
        self.ideal = None if compass is None else CompositeFilter(composite_model(compass))
        self._fixed = weight
        self.heading = 0.0
        self.record = []

    def step(self, difference, readings, velocity) -> float:
        low, high = self.bounds.step(difference, readings)
        weight, truth = self._fixed, math.nan
        if self.ideal is not None:
            truth = self.ideal.step(difference, readings)
            weight = ideal_weight(low, high, truth)
        self.heading = weighted(low, high, weight)
        self.record.append((low, high, weight, truth))
        return self.heading


class HalfBank(Blind):
    """The middle of the hull of a bank."""

    def __init__(self):
        super().__init__(ModelBank(corners(0.01)))

    @property
    def heading(self) -> float:
        return 0.5 * (self.estimator.low + self.estimator.high)


def interval_box(tolerance: float, shift_too: bool = False):
    return box_of(composite_model(), tolerance, shift_too)


def scale_state() -> Blind:
    """The aided filter with the compass's scale for its one unknown, and no GNSS velocity."""
    return Blind(AidedHeadingFilter(SCALE_ONLY, TCM2, PAPER_YAW))


KNOWN_SPEED = HeadingTuning(current=(0.3, 2e-3), water_speed=(0.0, 0.0))
"""For worlds (a) to (d), in which the speed through the water is known."""


class ByBearing:
    """The aided filter where the speed through the water is known, steering for a waypoint by its bearing."""

    def __init__(self, has_compass: bool = True):
        self.estimator, self._has_compass = AidedHeadingFilter(KNOWN_SPEED), has_compass

    @property
    def heading(self) -> float:
        return self.estimator.heading

    def step(self, difference, readings, velocity) -> float:
        return self.estimator.step(difference, readings if self._has_compass else None, velocity)


def product() -> HeadingSource:
    """The aided filter as in worlds (a) to (d)."""
    return ByBearing()


def gnss_alone() -> HeadingSource:
    """The same without its compass."""
    return ByBearing(has_compass=False)


def physical_nominal() -> Blind:
    return nominal(PHYSICAL_YAW)


RIVALS = {
    "nominal": nominal,
    "weight_net": lambda: Blind(LearnedHeading("weight")),
    "innovations_net": lambda: Blind(LearnedHeading("innovations")),
    "correction_net": lambda: Blind(LearnedHeading("correction")),
    "half_bank": HalfBank,
    "mmae": lambda: Blind(ModelBank(grid(0.01))),
    "scale_state": scale_state,
}
"""Estimators that know the box but not the compass in it, by the prefix of their keys."""
