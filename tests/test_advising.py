"""What `advise` says of the loop of the steering filter, against what the loop then does."""

import math

import numpy as np
import pytest

from steerway.sensors.testing import GnssTable
from steerway.simulation import parse_scenario, sail
from steerway.simulation.testing import advise, assembly, steering_loop, tolerated_current

SCENARIO = """
duration = 300.0
[environment.current]
speed = %g
direction_deg = 90.0
[estimator]
kind = "steering"
[gnss]
white = %g
markov = [[%g, 5.0]]
[speed]
cruise = 1.2
[route]
acceptance = 4.0
waypoints = [{ north = 0.0, east = 0.0 }, { north = 150.0, east = 0.0 }, { north = 150.0, east = 60.0 },
    { north = 900.0, east = 60.0 }]
"""


def swing(white, slow, doubt):
    """Swing of the heading (rad) from 80 s on after the last corner, with perfect fixes that the filter takes for poor
    ones."""
    scenario = parse_scenario(SCENARIO % (0.3, 0.0, 0.0))
    known = assembly.boat(scenario).but(yaw_doubt=doubt)
    law = scenario.guidance.design(known.lookahead, known.cruise)
    pilot = assembly.steering_pilot(known, assembly.voyage(scenario, known), law, white, learn=False)
    pilot.estimator.filter.slow_std = slow
    vessel, _, instruments, start, environment = assembly.assemble(scenario)
    run = sail(vessel, pilot, instruments, 300.0, 0.02, start=start, environment=environment)
    corner = run.time[np.argmax(run["leg_target"] == 3)]
    return np.ptp(run["true_heading"][run.time > corner + 80.0])


@pytest.mark.parametrize(
    ("white", "slow", "doubt", "fits"), [(0.02, 0.01, 0.2, True), (1.5, 1.0, 1.0, False), (1.5, 1.0, 0.2, True)]
)
def test_the_damping_is_that_of_the_loop(white, slow, doubt, fits, monkeypatch):
    """Of a turn of 90° exp(−ζ ω 80 s) leaves 1° for ζ of 0.2 and ω of 0.3 rad/s, and 27° for a quarter of it."""
    scenario = parse_scenario(SCENARIO % (0.3, white, slow))
    boat = assembly.boat(scenario).but(yaw_doubt=doubt)
    monkeypatch.setattr(assembly, "boat", lambda scenario: boat)
    assert advise(scenario)[0] is fits
    damping = steering_loop(boat, scenario.gnss, 1.2, 0.3, 0.5 * math.pi).damping
    assert (damping >= 0.2) is fits
    assert bool(swing(white, slow, doubt) < math.radians(5.0)) is fits


def test_the_current_that_is_tolerated():
    fits, sentence = advise(parse_scenario(SCENARIO % (1.3, 0.02, 0.01)))
    assert not fits and sentence.startswith("The boat cannot follow the route in a current of 1.3 m/s: she makes way")
    boat = assembly.boat(parse_scenario(SCENARIO % (0.3, 0.02, 0.01)))
    most = tolerated_current(boat)
    gnss = GnssTable(white=0.02, markov=())
    assert steering_loop(boat, gnss, 1.2, 0.99 * most, math.pi).speed > 0.0
    assert steering_loop(boat, gnss, 1.2, 1.01 * most, math.pi).speed == 0.0


def test_better_fixes_and_a_measured_velocity_damp_the_loop():
    boat = assembly.boat(parse_scenario(SCENARIO % (0.3, 0.02, 0.01)))
    damping = lambda **keys: steering_loop(boat, GnssTable(markov=(), **keys), 1.2, 0.3, 1.0).damping  # noqa: E731
    assert damping(white=0.02) > damping(white=0.3) and damping(white=0.3, velocity_std=0.05) > damping(white=0.3)
    mirrored = [steering_loop(boat, GnssTable(), 1.2, 0.5, side).damping for side in (1.0, -1.0)]
    assert mirrored[0] == pytest.approx(mirrored[1], abs=1e-9)


def test_another_autopilot_than_that_assessed_is_named():
    scenario = parse_scenario(SCENARIO % (0.3, 0.3, 0.2) + '[autopilot]\nkind = "lqg"\n')
    assert "with pole-placement in place of lqg and fixes" in advise(scenario)[1]
