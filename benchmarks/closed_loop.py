"""The whole loop: an Otter mission of 600 s at 50 Hz, her equations against another package, many seeds."""

import os
import time

import numpy as np

from benchmarks.support.harness import Result, interleaved, progress_of
from steerway.estimation import FiveStateFilter
from steerway.estimation.aboard import FilterEstimator
from steerway.guidance.line_of_sight import LineOfSight
from steerway.guidance.reference import TrackingFilter
from steerway.guidance.route import Route
from steerway.guidance.waypoints import Mission
from steerway.pilot import Pilot
from steerway.sensors.gnss import low_cost
from steerway.sensors.suite import Suite
from steerway.simulation.campaign import over_seeds
from steerway.simulation.loop import sail
from steerway.vessels import Otter, otter
from steerway.vessels.environment import Current, Environment
from steerway.vessels.otter import BOAT as OTTER

_DURATION, _STEP, _ROUNDS, _SEEDS = 600.0, 0.02, 5, 1000
_PEER_US = 324.0  # a call of PythonVehicleSimulator's Otter where it was first measured


def mission(seed: int) -> float:
    """Sail a survey in a current; returns the last cross-track error."""
    pilot = Pilot(
        FilterEstimator(FiveStateFilter("otter")),
        Mission(Route([0.0, 150.0, 150.0, 0.0, 0.0], [0.0, 0.0, 100.0, 100.0, 900.0], 4.0), at_end="continue"),
        LineOfSight(12.0),
        OTTER.autopilot(TrackingFilter(1.0)),
        OTTER.propulsion,
        OTTER.speed_loop(),
        cruise=1.2,
    )
    boat, sea = Otter(25.0, (0.05, 0.0, -0.35)), Environment(Current(0.3, np.pi / 2.0))
    run = sail(boat, pilot, Suite(low_cost()), _DURATION, _STEP, environment=sea, seed=seed)
    return float(run["leg_cross_track"][-1])


def run():
    began = time.perf_counter()
    mission(0)
    first = time.perf_counter() - began
    taken = interleaved({"mission": lambda: mission(1)}, _ROUNDS)["mission"]
    yield Result("first mission, with what had to be compiled or loaded", first, "s")
    per_step = f"{1e6 * taken * _STEP / _DURATION:.1f} µs a step; stretch 1,500"
    yield Result("600 s closed loop / real time, one core", _DURATION / taken, "times", at_least=400.0, note=per_step)
    yield from _derivatives()
    yield from _seeds(taken)


def _derivatives():
    state = np.array([1.0, 0.1, 0.0, 0.01, 0.02, 0.1, 0.0, 0.0, 0.1, 0.01, 0.02, 0.5])

    def ours():
        for _ in range(2000):
            otter.derivatives(state, (60.0, 50.0), 25.0, (0.05, 0.0, -0.35), 0.3, 0.5)

    contenders = {"ours": ours}
    try:
        from python_vehicle_simulator.vehicles import otter as peer_module
    except ImportError:
        peer_module = None
    else:
        peer = peer_module.otter("headingAutopilot", 0.0, 0.3, 30.0, 0.0)
        position, velocity = np.zeros(6), state[:6].copy()

        def theirs():
            for _ in range(100):
                peer.dynamics(position, velocity, np.array([60.0, 50.0]), np.array([60.0, 50.0]), _STEP)

        contenders["PythonVehicleSimulator"] = theirs
    taken = interleaved(contenders, _ROUNDS)
    each = taken["ours"] / 2000
    yield Result("one call of the Otter's derivatives", 1e6 * each, "µs")
    what = "PythonVehicleSimulator / ours"
    if peer_module is None:
        note = f"not installed; against its {_PEER_US:g} µs elsewhere: {_PEER_US * 1e-6 / each:,.0f} times"
        yield Result(what, None, "times", at_least=150.0, note=note)
    else:
        yield Result(what, taken["PythonVehicleSimulator"] / 100 / each, "times", at_least=150.0)


def _seeds(alone):
    """Efficiency: seeds × the time of one alone ÷ (cores × the time all took), start of the workers included."""
    cores = os.cpu_count() or 1
    took = _timed(mission, _SEEDS, cores)
    idle = _timed(_idle, _SEEDS // 10, cores)
    began = time.process_time()
    _idle(0)
    idle_alone = time.process_time() - began
    efficiency = 100.0 * _SEEDS * alone / (cores * took)
    free = 100.0 * (_SEEDS // 10) * idle_alone / (cores * idle)
    note = f"{took:.0f} s for all, load {os.getloadavg()[0]:.1f}"
    yield Result(f"efficiency of {_SEEDS:,} seeds on {cores} cores", efficiency, "%", at_least=80.0, note=note)
    yield Result(
        "… of arithmetic in the same workers just after", free, "%", note="what other work leaves of the cores"
    )


def _timed(work, n, cores) -> float:
    began = time.perf_counter()
    over_seeds(work, range(n), workers=cores, progress=progress_of(f"{n:,} × {work.__name__} on {cores} cores"))
    return time.perf_counter() - began


def _idle(seed: int) -> float:
    """As long as a mission or so, in Python, without memory."""
    x = 1.0
    for _ in range(15_000_000):
        x = x * 1.0000001 + 1e-9
    return x
