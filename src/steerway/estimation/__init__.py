"""Estimators: the motion of a vessel from measurements."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.aboard import AtFaceValue, FilterEstimator
    from steerway.estimation.fit.tune import log_likelihood, tune
    from steerway.estimation.learning import LearningFilter
    from steerway.estimation.log.compare import Agreement, compare
    from steerway.estimation.log_estimate import choose_profile, estimate
    from steerway.estimation.prediction import Prediction, hindcast, predict
    from steerway.estimation.stream import FiveStateFilter, InferredFilter
    from steerway.estimation.vessel.profile import InferredProfile, Profile, load_profile

__all__ = [
    "Agreement",
    "AtFaceValue",
    "FilterEstimator",
    "FiveStateFilter",
    "InferredFilter",
    "InferredProfile",
    "LearningFilter",
    "Prediction",
    "Profile",
    "choose_profile",
    "compare",
    "estimate",
    "hindcast",
    "load_profile",
    "log_likelihood",
    "predict",
    "tune",
]
__getattr__, __dir__ = on_demand(__name__)
