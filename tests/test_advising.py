"""What is advised of a loop — of the steering filter, of a course estimate — against what the loop then does."""

import math
import re

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from steerway.control import carried_bandwidth
from steerway.control.testing import advice
from steerway.estimation import Profile
from steerway.sensors.testing import GnssTable
from steerway.simulation import parse_scenario, sail, sail_scenario
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
    """Swing of the heading (rad) from 80 s after the last corner on; the filter treats the perfect fixes as poor."""
    scenario = parse_scenario(SCENARIO % (0.3, 0.0, 0.0))
    known = assembly.boat(scenario).but(yaw_doubt=doubt)
    law = scenario.guidance.design(known.lookahead, known.cruise)
    pilot = assembly.steering_pilot(known, assembly.voyage(scenario, known), law, (white, slow), learn=False)
    pilot.estimator.filter.slow_std = slow
    vessel, _, instruments, start, environment = assembly.assemble(scenario)
    run = sail(vessel, pilot, instruments, 300.0, 0.02, start=start, environment=environment)
    corner = run.time[np.argmax(run["leg_target"] == 3)]
    return np.ptp(run["true_heading"][run.time > corner + 80.0])


@pytest.mark.parametrize(("white", "slow", "doubt", "fits"), [(0.02, 0.01, 0.2, True), (1.5, 1.0, 1.0, False)])
def test_the_damping_is_that_of_the_loop(white, slow, doubt, fits, monkeypatch):
    """A turn of 90° leaves, by exp(−ζ ω 80 s), 1° for ζ of 0.2 and ω of 0.3 rad/s, and 27° for a quarter of it."""
    scenario = parse_scenario(SCENARIO % (0.3, white, slow))
    boat = assembly.boat(scenario).but(yaw_doubt=doubt)
    monkeypatch.setattr(assembly, "boat", lambda scenario: boat)
    assert advise(scenario)[0] is fits
    damping = steering_loop(boat, scenario.gnss, 1.2, 0.3, 0.5 * math.pi).damping
    assert (damping >= 0.2) is fits
    assert bool(swing(white, slow, doubt) < math.radians(5.0)) is fits


def test_the_current_that_is_tolerated_and_another_autopilot_than_that_assessed_are_named():
    fits, sentence = advise(parse_scenario(SCENARIO % (1.3, 0.02, 0.01)))
    assert not fits and sentence.startswith("The boat cannot follow the route in a current of 1.3 m/s: the boat")
    boat = assembly.boat(parse_scenario(SCENARIO % (0.3, 0.02, 0.01)))
    most = tolerated_current(boat)
    gnss = GnssTable(white=0.02, markov=())
    assert steering_loop(boat, gnss, 1.2, 0.99 * most, math.pi).speed > 0.0
    assert steering_loop(boat, gnss, 1.2, 1.01 * most, math.pi).speed == 0.0
    scenario = parse_scenario(SCENARIO % (0.3, 0.3, 0.2) + '[autopilot]\nkind = "lqg"\n')
    assert "with pole-placement in place of lqg and fixes" in advise(scenario)[1]


CORNER = """
vessel.kind = "motorboat"
estimator.kind = "steering"
route.acceptance = %g
route.waypoints = [{ north = 0.0, east = 0.0 }, { north = 150.0, east = 0.0 }, { north = 75.0, east = 130.0 }]
"""


def test_a_turn_wider_than_the_acceptance_is_named_with_the_distance_that_it_then_has():
    wide = parse_scenario(CORNER % 4.0)
    run = sail_scenario(wide, 3).run
    sailed = np.min(np.hypot(run["true_north"] - 150.0, run["true_east"]))
    (advised,) = re.findall(
        r"turn at route.waypoints\[1\] passes it at ([\d.]+) m .* acceptance is 4 m", advise(wide)[1]
    )
    assert sailed > 4.0 and float(advised) == pytest.approx(sailed, rel=0.1)
    assert "turn" not in advise(parse_scenario(CORNER % 5.0))[1]


def test_ordered_courses_are_steered_over_ground_in_a_current():
    orders = "orders = [{ time = 0.0, course_deg = 30.0, speed = 1.0 }, { time = 60.0, course_deg = 90.0 }]\n"
    current = "environment.current = { speed = 0.4, direction_deg = 200.0 }\n"
    scenario = parse_scenario(f'duration = 140.0\nestimator.kind = "steering"\n{orders}{current}')
    run = sail_scenario(scenario, 3).run
    last = run.time > 90.0
    assert np.degrees(np.mean(run.true_cog[last])) == pytest.approx(90.0, abs=6.0)
    assert np.degrees(np.mean(run["true_heading"][last])) < 80.0
    assert advise(scenario)[0] and "turn" not in advise(scenario)[1]


def test_what_is_carried_is_the_natural_frequency_of_the_steady_kalman_filter():
    """All three poles of the Kalman filter of cross-track, course and course rate have this magnitude."""
    speed, density, std, interval = case = (1.3, 7.8e-3, 0.5, 0.2)
    dynamics = np.array([[0.0, speed, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    seen = np.array([[1.0, 0.0, 0.0]])
    noise = np.diag([0.0, 0.0, density])
    covariance = solve_continuous_are(dynamics.T, seen.T, noise, np.array([[std**2 * interval]]))
    poles = np.linalg.eigvals(dynamics - covariance @ seen.T @ seen / (std**2 * interval))
    np.testing.assert_allclose(np.abs(poles), carried_bandwidth(*case), rtol=1e-6)


def test_the_papers_otter_autopilot_is_too_quick_for_half_a_metre():
    fits, sentence = advice(1.5, 1.3, 7.8e-3, 0.5, 0.2)
    assert not fits and "An autopilot of 1.5 rad/s will hunt: the bandwidth of the course estimate is 0.8" in sentence
    fits, sentence = advice(0.5, 1.3, 7.8e-3, 0.5, 0.2)
    assert fits and sentence.startswith("An autopilot of 0.5 rad/s fits")


HUNTING = """
duration = 500.0
step = 0.1
estimator.profile = "%s"
autopilot.bandwidth = %g
reference = { kind = "tracking", bandwidth = 0.05 }
guidance.lookahead = 2000.0
gnss = { white = %g, markov = [] }
vessel = { kind = "nomoto", gain = 0.2, time_constant = %g, speed = 2.0 }
start.east = 3.0
route.waypoints = [{ north = 0.0, east = 0.0 }, { north = 5000.0, east = 0.0 }]
"""


def hunting(path, bandwidth, density, std, nomoto_time):
    """Largest excursion of the true course, rad, on a straight leg with fixes all but free of noise."""
    Profile(speed_noise=1e-3, course_rate_noise=density, course_rate_decay=0.0, position_std=std).save(path)
    run = sail_scenario(parse_scenario(HUNTING % (path, bandwidth, 0.02 * std, nomoto_time)), 4).run
    return float(np.max(np.abs(run.true_cog[run.time > 300.0])))


@pytest.mark.parametrize(
    ("bandwidth", "nomoto_time", "calm"), [(0.2, 5.0, True), (0.35, 5.0, False), (0.65, 1.0, False)]
)
def test_advice_tells_what_the_loop_then_does(bandwidth, nomoto_time, calm, tmp_path):
    """ω_e is 0.69 rad/s throughout: ω_n ≤ ω_e alone would let all of these sail."""
    circumstances = (2.0, 1.35e-3, 0.5, 0.2)
    fits, sentence = advice(bandwidth, *circumstances, nomoto_time)
    assert fits is calm, sentence
    excursion = hunting(tmp_path / "boat.toml", bandwidth, circumstances[1], circumstances[2], nomoto_time)
    assert (excursion < math.radians(1.0)) is calm
