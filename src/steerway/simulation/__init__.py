"""Simulation: the loop around a vessel model, scenarios and many seeds."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.simulation.campaign import over_seeds
    from steerway.simulation.loop import Run, Start, sail

__all__ = [
    "Run",
    "Start",
    "over_seeds",
    "sail",
]
__getattr__, __dir__ = on_demand(__name__)
