"""The least possible error of the course of a run: below what the steering filter has, larger for poorer receivers."""

import numpy as np

from steerway.simulation import parse_scenario, sail_scenario
from steerway.simulation.testing import course_bound, errors, evaluated

SCENARIO = """
duration = 150.0
[environment.current]
speed = 0.3
direction_deg = 90.0
[estimator]
kind = "steering"
[gnss]
markov = %s
[route]
waypoints = [{ north = 0.0, east = 0.0 }, { north = 60.0, east = 0.0 }, { north = 60.0, east = 90.0 }]
"""


def test_no_estimate_is_better_and_a_poorer_receiver_allows_less():
    bounds = []
    for markov in ("[]", "[[0.25, 5.0]]", "[[0.25, 5.0], [1.5, 300.0]]"):
        scenario = parse_scenario(SCENARIO % markov)
        run = sail_scenario(scenario).run
        course = errors(run)["cog"][evaluated(run)]
        bounds.append(course_bound(scenario, run))
        assert bounds[-1] < 1.2 * np.sqrt(np.mean(course**2))
    assert bounds[0] < 0.5 * bounds[1] and bounds[1] < 0.9 * bounds[2]
