"""The closed loop: an Otter mission of 600 s at 50 Hz, against real time."""

import time

from benchmarks.support.harness import Result, interleaved
from steerway.core.reference import TrackingFilter
from steerway.estimation import FiveStateFilter
from steerway.estimation.aboard import FilterEstimator
from steerway.guidance.line_of_sight import LineOfSight
from steerway.guidance.route import Route
from steerway.guidance.waypoints import Mission
from steerway.pilot import Pilot
from steerway.sensors.gnss import low_cost
from steerway.sensors.suite import Suite
from steerway.simulation.loop import sail
from steerway.vessels import Otter
from steerway.vessels.environment import Current, Environment
from steerway.vessels.otter import BOAT as OTTER

_DURATION, _STEP, _ROUNDS = 600.0, 0.02, 5


def mission(seed: int) -> float:
    """Sail a survey in a current; return the last cross-track error, m."""
    pilot = Pilot(
        FilterEstimator(FiveStateFilter("otter")),
        Mission(Route([0.0, 150.0, 150.0, 0.0, 0.0], [0.0, 0.0, 100.0, 100.0, 900.0], 4.0), at_end="continue"),
        LineOfSight(12.0),
        OTTER.autopilot(TrackingFilter(1.0)),
        OTTER.propulsion,
        OTTER.speed_loop(),
        cruise=1.2,
    )
    boat, sea = Otter(25.0, (0.05, 0.0, -0.35)), Environment(current=Current(speed=0.3, direction_deg=90.0))
    run = sail(boat, pilot, Suite(low_cost()), _DURATION, _STEP, environment=sea, seed=seed)
    return float(run["leg_cross_track"][-1])


def run():
    began = time.perf_counter()
    mission(0)
    first = time.perf_counter() - began
    taken = interleaved({"mission": lambda: mission(1)}, _ROUNDS)["mission"]
    yield Result("first mission, with compiling or loading", first, "s")
    per_step = f"{1e6 * taken * _STEP / _DURATION:.1f} µs a step; stretch 1,500"
    yield Result("600 s closed loop / real time, one core", _DURATION / taken, "times", at_least=400.0, note=per_step)
