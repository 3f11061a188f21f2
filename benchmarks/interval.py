"""Interval Kalman filters and the heading MPC; the printed step compared with codac's, in a process of its own."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.support.harness import Result
from steerway.estimation.heading.composite import START_VARIANCE, composite_model
from steerway.estimation.heading.interval.filter import IntervalFilter, box_of
from steerway.estimation.heading.models import TRUE_TCM2
from steerway.sensors.tcm2 import DynamicCompass
from steerway_studies.papers import interval_filter as printed
from steerway_studies.springer_mission.navigators import WeightedBounds, interval_box
from steerway_studies.springer_mission.world import World, paper_mpc, sail

_STEPS, _ROUNDS = 200, 7
_PROGRAM = Path(__file__).parent / "support" / "codac_step.py"


def run():
    compass = DynamicCompass(TRUE_TCM2).start(0.0, 0)
    readings = np.concatenate([compass.second(0.1 * k) for k in range(_STEPS // 40)])
    box = box_of(composite_model(), 0.01)

    bounds = IntervalFilter(box)
    second = _best(lambda: bounds.step(0.0, readings[:40]))
    yield Result("sharpened interval step, 4 states", 1e6 * second / 40, "µs", at_most=15.0)
    mpc = paper_mpc()
    mpc.step(0.1, 0.0)
    yield Result("MPC step through DAQP", 1e6 * _best(lambda: _steer(mpc, 500)) / 500, "µs", at_most=15.0)
    taken = _best(lambda: sail(World(), WeightedBounds(IntervalFilter(interval_box(0.01)), TRUE_TCM2), 0))
    yield Result("mission of 870 s, interval filter at 40 Hz", taken, "s", at_most=1.0)

    degrees = np.degrees(readings)
    ours = _best(lambda: _printed(box, degrees)) / len(degrees)
    yield Result("printed interval step", 1e6 * ours, "µs")
    theirs = _codac(box, degrees)
    if theirs is None:
        yield Result("codac / ours", None, "times", at_least=20.0, note="codac is not installed")
        return
    yield Result(
        "codac / ours", theirs["seconds"] / ours, "times", at_least=20.0, note=f"{1e6 * theirs['seconds']:.0f} µs"
    )
    bounds, state = np.array(theirs["state"]), _printed(box, degrees)
    yield Result(
        "largest relative difference of the bounds", float(np.max(np.abs(bounds / state - 1.0))), "", at_most=1e-9
    )


def _best(work) -> float:
    work()
    times = []
    for _ in range(_ROUNDS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def _steer(mpc, steps):
    for k in range(steps):
        mpc.step(0.3, 1e-3 * k)


def _printed(box, readings_deg):
    x, p, work = np.zeros((4, 2)), np.empty((4, 4, 2)), printed.workspace()
    printed.start(p, START_VARIANCE, 1.0)
    for reading in readings_deg:
        printed.tick(x, p, box, reading, work)
    return x


def _codac(box, readings_deg):
    given = json.dumps({"box": box.tolist(), "readings": readings_deg.tolist()})
    done = subprocess.run([sys.executable, str(_PROGRAM)], input=given, capture_output=True, text=True, check=False)
    if done.returncode:
        return None if "No module named 'codac'" in done.stderr else sys.exit(done.stderr)
    return json.loads(done.stdout)
