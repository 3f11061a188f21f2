"""The loop with its pilot: repeatability, the record of a run, and runs without fixes."""

import math

import numpy as np
import pytest

from steerway.core import InputError
from steerway.estimation import FiveStateFilter
from steerway.estimation.testing import FilterEstimator
from steerway.guidance import LineOfSight, Mission, ReferenceModel, Route
from steerway.pilot import Mode, Pilot
from steerway.sensors import Gnss, Suite, low_cost
from steerway.sensors.testing import Fault
from steerway.simulation import sail
from steerway.vessels import Current, Environment, Otter
from steerway.vessels.testing import OTTER_BOAT as OTTER

STEP = 0.02
CROSSING = Environment(current=Current(speed=0.3, direction_deg=90.0))


def otter_pilot(**more):
    return Pilot(
        FilterEstimator(FiveStateFilter("otter")),
        Mission(Route([0.0, 60.0, 60.0], [0.0, 0.0, 60.0], 5.0)),
        LineOfSight(12.0),
        OTTER.autopilot(ReferenceModel(0.5, max_rate=math.radians(15.0))),
        OTTER.propulsion,
        OTTER.speed_loop(),
        cruise=1.2,
        **more,
    )


def mission(gnss=None, duration=150.0, seed=3, **pilot):
    suite = Suite(gnss or low_cost())
    return sail(Otter(), otter_pilot(**pilot), suite, duration, STEP, environment=CROSSING, seed=seed)


def test_an_otter_sails_her_route_and_stops():
    run = mission()
    assert run["mode"][-1] == Mode.STOPPED and 90.0 < run.time[-1] < 150.0
    assert np.array_equal(run.command[-1], (0.0, 0.0))
    sailing = (run.time > 30.0) & (run["leg_remaining"] > 10.0)
    assert abs(np.median(run.true_sog[sailing]) - 1.2) < 0.1
    leg = (run.time > 30.0) & (run["leg_target"] == 1.0)
    crab = np.degrees(run.true_cog - run["true_heading"])[leg]
    assert 8.0 < np.median(crab) < 20.0  # set to starboard by the current, not measured
    assert abs(np.median(run["true_east"][leg])) < 4.0  # within the receiver's own error
    across = np.where(run["leg_target"] == 1.0, run["true_east"], 60.0 - run["true_north"])
    np.testing.assert_allclose(run.true_cross_track[sailing], across[sailing], atol=1e-9)


def test_the_same_seed_is_the_same_run_and_another_is_not():
    one, again, other = (mission(duration=8.0, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(one.values, again.values, equal_nan=True)
    assert not np.array_equal(one["read_north"], other["read_north"], equal_nan=True)


def test_a_boat_without_fixes_switches_off_and_goes_on_when_they_return():
    gnss = Gnss(white=0.1, faults=(Fault(kind="dropout", start=20.0, duration=12.0),))
    run = mission(gnss, duration=60.0, max_dead_reckoning=8.0)
    blind = run["mode"] == Mode.BLIND
    assert run.time[blind][0] == pytest.approx(27.8, abs=0.3) and run.time[blind][-1] == pytest.approx(32.0, abs=0.3)
    assert not run.command[blind].any()
    assert np.hypot(*run.command[(run.time > 25.0) & (run.time < 27.0)].T).min() > 10.0  # until then the boat goes on
    back = run.time > 47.0
    assert np.all(run["mode"][back] == Mode.UNDER_WAY) and abs(run.true_sog[-1] - 1.2) < 0.2


def test_nothing_is_done_before_the_first_fix():
    run = mission(Gnss(white=0.1, faults=(Fault(kind="dropout", start=0.0, duration=5.0),)), duration=8.0)
    waiting = run.time < 4.9
    assert np.all(run["mode"][waiting] == Mode.WAITING) and not run.command[waiting].any()
    assert run["mode"][-1] == Mode.UNDER_WAY and run.command[-1].all()


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of kernels that run as Python
def test_what_cannot_be_sailed_is_said():
    with pytest.raises(InputError, match="step is 0, expected a number above 0"):
        sail(Otter(), otter_pilot(), Suite(low_cost()), 10.0, 0.0)
    with pytest.raises(InputError, match=r"not finite after [\d.]+ s, expected a smaller step than 1 s"):
        sail(Otter(method="euler"), otter_pilot(), Suite(low_cost()), 100.0, 1.0)
