"""Heading from compasses, a gyro and GNSS."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.heading.aided import SCALE_ONLY, AidedHeadingFilter, HeadingTuning
    from steerway.estimation.heading.composite import START_VARIANCE, WAVES, CompositeFilter, composite_model
    from steerway.estimation.heading.interval.deviation import DeviationBounds
    from steerway.estimation.heading.interval.filter import IntervalFilter, box_of
    from steerway.estimation.heading.interval.weighting import (
        WEIGHTS,
        Features,
        LearnedHeading,
        Network,
        ideal_weight,
        weighted,
    )
    from steerway.estimation.heading.model_bank import ModelBank, corners, grid, outside
    from steerway.estimation.heading.readings import Ticks, checked_difference

__all__ = [
    "SCALE_ONLY",
    "START_VARIANCE",
    "WAVES",
    "WEIGHTS",
    "AidedHeadingFilter",
    "CompositeFilter",
    "DeviationBounds",
    "Features",
    "HeadingTuning",
    "IntervalFilter",
    "LearnedHeading",
    "ModelBank",
    "Network",
    "Ticks",
    "box_of",
    "checked_difference",
    "composite_model",
    "corners",
    "grid",
    "ideal_weight",
    "outside",
    "weighted",
]
__getattr__, __dir__ = on_demand(__name__)
