"""A simulated scenario with its results; and one function for many seeds, on all cores or a Dask cluster."""

import os
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from steerway.core.workers import in_workers
from steerway.guidance.ordered import Ordered
from steerway.simulation import outcome
from steerway.simulation.assembly import Assembly, assemble, holds_places
from steerway.simulation.loop import Run, sail
from steerway.simulation.manoeuvres import ManoeuvringPilot, measured
from steerway.simulation.responses import responses
from steerway.simulation.scenario import Scenario


@dataclass(frozen=True)
class Sailed:
    """A simulated scenario: its blocks, its run, and its results by name."""

    scenario: Scenario
    assembly: Assembly
    run: Run
    numbers: dict[str, float]

    @property
    def origin(self) -> tuple[float, float]:
        """Latitude and longitude (rad) of north = east = 0."""
        return self.scenario.origin.place


def sail_scenario(
    scenario: Scenario, seed: int | None = None, progress: Callable[[float], None] | None = None
) -> Sailed:
    """Simulate a scenario once; `seed` replaces its own."""
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
    mission = blocks.mission
    numbers = outcome.numbers(run, mission.passages) | outcome.rudder_numbers(run, blocks.vessel.actuators)
    if isinstance(blocks.pilot, ManoeuvringPilot):
        numbers |= measured(run, blocks.pilot, scenario.vessel.length)
    elif holds_places(scenario):
        numbers |= outcome.place_numbers(run)
    elif isinstance(mission, Ordered):
        numbers |= responses(run, mission.orders)
    return Sailed(scenario, blocks, run, numbers)


def numbers_of_seed(scenario: Scenario, seed: int) -> dict[str, float]:
    """The results of one seed, for campaigns."""
    return sail_scenario(scenario, seed).numbers


def over_seeds(
    run: Callable[[int], object],
    seeds: Iterable[int],
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
    dask: str | None = None,
    finished: Callable[[int, object], None] | None = None,
) -> list[Any]:
    """`run(seed)` for every seed, in the order of the seeds.

    `run` is a module-level function or a functools.partial of one. Every seed has a generator of its own: the results
    do not depend on the number of workers. `dask` is the address of a cluster's scheduler, whose workers have this
    package; if a worker dies, another repeats its seed. `finished(seed, result)` is called for every seed as soon as it
    is done. Raises InputError for a cluster that cannot be reached.
    """
    seeds = list(seeds)
    done: dict[int, object] = {}
    with closing(in_workers(run, seeds, min(workers or os.cpu_count() or 1, len(seeds)), dask)) as finished_runs:
        for index, result in finished_runs:
            done[index] = result
            if finished:
                finished(seeds[index], result)
            if progress:
                progress(len(done) / len(seeds))
    return [done[index] for index in range(len(seeds))]
