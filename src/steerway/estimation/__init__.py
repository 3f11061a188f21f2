"""Estimators: the motion of a vessel from measurements."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.course.estimate import choose_profile, estimate
    from steerway.estimation.course.filter import FiveStateFilter
    from steerway.estimation.profiles import Profile
    from steerway.estimation.selection.tuned import tune

__all__ = [
    "FiveStateFilter",
    "Profile",
    "choose_profile",
    "estimate",
    "tune",
]
__getattr__, __dir__ = on_demand(__name__)
