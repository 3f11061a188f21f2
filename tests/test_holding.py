"""A position held by thrust and steering: what is wanted of the boat, and what comes of it in a current."""

import math

import numpy as np
import pytest

from steerway.control.testing import PositionHold
from steerway.core import Estimate
from steerway.core.testing import over_ground
from steerway.simulation import parse_scenario, sail_scenario
from steerway.testing import Mode


def estimate(north, east):
    return Estimate(*[math.nan] * 9, 1.0, 0.0, 0.1, 0.0, north, east, 0.0, 1.0)


def test_in_a_current_she_goes_as_fast_as_the_water_with_her_bow_up_it():
    hold = PositionHold(5.0, 0.8)
    assert hold.step(0.0, 2.0, estimate(0.0, 0.5)) == pytest.approx((-0.5 * math.pi, 0.5))
    for bearing in np.linspace(-3.0, 3.0, 7):
        wanted = hold.step(3.0, bearing, estimate(0.0, 0.5))
        north, east = over_ground(wanted.water_speed, 0.0, wanted.heading)
        nearer = north * math.cos(bearing) + (east + 0.5) * math.sin(bearing)
        assert nearer > 0.15 and math.cos(wanted.heading + 0.5 * math.pi) > 0.7
    assert hold.step(20.0, 0.5 * math.pi, estimate(0.0, 0.5)).heading == pytest.approx(0.5 * math.pi)  # far: back


@pytest.mark.parametrize(("current", "rms", "most"), [(0.3, 0.5, 1.0), (0.0, 3.0, 5.5)])
def test_a_stay_at_a_waypoint_without_a_compass(current, rms, most):
    sailed = sail_scenario(
        parse_scenario(f"""
duration = 260.0
[environment.current]
speed = {current}
direction_deg = 60.0
[estimator]
kind = "steering"
[gnss]
white = 0.05
markov = []
[route]
waypoints = [
    {{ north = 0.0, east = 0.0 }}, {{ north = 40.0, east = 0.0, stay = 120.0 }}, {{ north = 40.0, east = 40.0 }}
]
""")
    )
    run = sailed.run
    holds = run["mode"] == Mode.HOLDING
    since = run.time[holds][0]
    assert run.time[holds][-1] - since == pytest.approx(120.0, abs=0.1)
    off = np.hypot(run["true_north"] - 40.0, run["true_east"])[holds & (run.time > since + 30.0)]
    assert math.sqrt(np.mean(off**2)) < rms and off.max() < most
    assert run["mode"][-1] == Mode.STOPPED  # and she went on
