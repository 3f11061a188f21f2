"""Simulation: the loop around a vessel model, scenarios and many seeds."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.simulation.assembly import Assembly, assemble, steering_pilot
    from steerway.simulation.corners import short_leg
    from steerway.simulation.loop import Run, Start, sail
    from steerway.simulation.reading import load_scenario, parse_scenario
    from steerway.simulation.responses import settling
    from steerway.simulation.run import Sailed, numbers_of_seed, over_seeds, sail_scenario
    from steerway.simulation.scenario import Scenario
    from steerway.simulation.unfinished import Unfinished

__all__ = [
    "Assembly",
    "Run",
    "Sailed",
    "Scenario",
    "Start",
    "Unfinished",
    "assemble",
    "load_scenario",
    "numbers_of_seed",
    "over_seeds",
    "parse_scenario",
    "sail",
    "sail_scenario",
    "settling",
    "short_leg",
    "steering_pilot",
]
__getattr__, __dir__ = on_demand(__name__)
