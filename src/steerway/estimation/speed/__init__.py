"""Speed along the hull from several instruments, and the isolation of a faulty one."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.speed.fault_vote import FaultVote
    from steerway.estimation.speed.fusion import FaultEvent, SurgeFusion
    from steerway.estimation.speed.surge import SurgeFilter, SurgeTuning

__all__ = ["FaultEvent", "FaultVote", "SurgeFilter", "SurgeFusion", "SurgeTuning"]
__getattr__, __dir__ = on_demand(__name__)
