"""One simulated scenario: the run and its numbers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from steerway.control.bandwidth import advice
from steerway.simulation import assembly, outcome
from steerway.simulation.assembly import Assembly, assemble
from steerway.simulation.loop import Run, sail
from steerway.simulation.scenario import Scenario


@dataclass(frozen=True)
class Sailed:
    """A run with its blocks and its flat, named numbers."""

    scenario: Scenario
    assembly: Assembly
    run: Run
    numbers: dict[str, float]

    @property
    def origin(self) -> tuple[float, float]:
        """Latitude and longitude (rad) of north = east = 0."""
        return origin(self.scenario)


def origin(scenario: Scenario) -> tuple[float, float]:
    """Latitude and longitude (rad) of a scenario's north = east = 0."""
    return tuple(np.radians((scenario.origin.latitude_deg, scenario.origin.longitude_deg)).tolist())


def sail_scenario(
    scenario: Scenario, seed: int | None = None, progress: Callable[[float], None] | None = None
) -> Sailed:
    """Simulate a scenario once; `seed` in place of its own."""
    blocks = assemble(scenario)
    run = sail(
        blocks.vessel,
        blocks.pilot,
        blocks.instruments,
        scenario.duration,
        scenario.step,
        start=blocks.start,
        environment=blocks.environment,
        seed=scenario.seed if seed is None else seed,
        progress=progress,
    )
    return Sailed(scenario, blocks, run, outcome.numbers(run, blocks.pilot.mission.passages))


def numbers_of_seed(scenario: Scenario, seed: int) -> dict[str, float]:
    """The numbers of one seed, for campaigns."""
    return sail_scenario(scenario, seed).numbers


def advise(scenario: Scenario) -> tuple[bool, str]:
    """Whether the estimate supports the scenario's autopilot, and a sentence; see `control.bandwidth`.

    The speed is the lowest of the route. With true states, and with a commanded heading, there is no limit.
    """
    if scenario.estimator.kind == "truth":
        return True, "The pilot uses the true motion: the estimate does not limit the autopilot."
    if scenario.guidance.angle == "heading":
        return True, "The pilot controls heading by compass: the course estimate does not limit the autopilot."
    known, profile = assembly.boat(scenario), assembly.profile(scenario)
    commanded = [each.speed for each in scenario.route.waypoints if each.speed is not None]
    speed = min([*commanded, known.cruise])
    interval = 1.0 / scenario.gnss.rate
    return advice(
        known.bandwidth, speed, profile.agility, profile.position_std, interval, known.nomoto_time, known.damping
    )
