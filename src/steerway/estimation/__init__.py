"""Estimators: what the vessel does, from what its receivers say."""

from steerway.estimation.course.filter import FiveStateFilter
from steerway.estimation.estimate import choose_profile, estimate
from steerway.estimation.profiles import Profile
from steerway.estimation.selection.tune import tune

__all__ = ["FiveStateFilter", "Profile", "choose_profile", "estimate", "tune"]
