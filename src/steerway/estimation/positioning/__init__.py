"""Estimators of a vessel whose forces are known: dynamic positioning."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.positioning.changing_noise import (
        SpeedDependentFixNoise,
        TimeVaryingNoise,
        VariationalNoise,
        saturated,
    )
    from steerway.estimation.positioning.passive import DEMO_GAINS, ObserverGains, PassiveObserver
    from steerway.estimation.positioning.vessel_filter import VesselFilter, VesselMotion, VesselNoise
    from steerway.estimation.positioning.vessel_smoother import VesselRecord, smooth

__all__ = [
    "DEMO_GAINS",
    "ObserverGains",
    "PassiveObserver",
    "SpeedDependentFixNoise",
    "TimeVaryingNoise",
    "VariationalNoise",
    "VesselFilter",
    "VesselMotion",
    "VesselNoise",
    "VesselRecord",
    "saturated",
    "smooth",
]
__getattr__, __dir__ = on_demand(__name__)
