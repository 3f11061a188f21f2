"""Estimators: what the vessel does, from what its receivers say."""

from steerway.estimation.estimate import choose_profile, estimate
from steerway.estimation.filter import FiveStateFilter
from steerway.estimation.profiles import Profile
from steerway.estimation.tuning.tuned import tune

__all__ = ["FiveStateFilter", "Profile", "choose_profile", "estimate", "tune"]
