"""The closed loop: invariance to rotation, translation and mirroring; a quick boat; the least possible error."""

import cmath
import math

import numpy as np
import pytest

from steerway.core import wrap
from steerway.estimation import FiveStateFilter
from steerway.estimation.testing import FilterEstimator
from steerway.guidance import LineOfSight, Mission, Route, TrackingFilter
from steerway.pilot import Mode, Pilot
from steerway.sensors import Suite, low_cost
from steerway.simulation import Start, parse_scenario, sail, sail_scenario
from steerway.simulation.testing import course_bound, errors, evaluated
from steerway.vessels import Current, Environment, Otter
from steerway.vessels.testing import OTTER_BOAT as OTTER

STEP = 0.02
CORNERS = 0.0, 60.0, 60.0 + 50.0j


class Moved:
    """Instruments whose errors are rotated, translated and mirrored with the scene; a place is north + i east."""

    def __init__(self, suite, turn=0.0, shift=0.0j, mirrored=False):
        self.suite, self.turned, self.shift, self.mirrored = suite, cmath.rect(1.0, turn), shift, mirrored

    def start(self, seed):
        self.stream = self.suite.start(seed)
        return self

    def step(self, time, motion, waves):
        readings = self.stream.step(time, placed(motion, self.back(complex(motion.north, motion.east))), waves)
        return placed(readings, self.there(complex(readings.north, readings.east)))

    def there(self, place):
        return self.turned * (place.conjugate() if self.mirrored else place) + self.shift

    def back(self, place):
        place = (place - self.shift) / self.turned
        return place.conjugate() if self.mirrored else place

    def angle(self, angle):
        return wrap((-angle if self.mirrored else angle) + cmath.phase(self.turned))


def placed(row, place):
    return row._replace(north=place.real, east=place.imag)


def mission(scene):
    """The cross-track errors, true positions moved back, and commands of one mission in a moved scene."""
    corners = [scene.there(each) for each in CORNERS]
    pilot = Pilot(
        FilterEstimator(FiveStateFilter("otter")),
        Mission(Route(np.real(corners), np.imag(corners), 5.0)),
        LineOfSight(12.0),
        OTTER.autopilot(TrackingFilter(1.0)),
        OTTER.propulsion,
        OTTER.speed_loop(),
        cruise=1.2,
    )
    start = scene.there(-3.0 + 4.0j)
    start = Start(start.real, start.imag, scene.angle(0.5), 0.5)
    sea = Environment(current=Current(speed=0.3, direction_deg=math.degrees(scene.angle(1.2))))
    run = sail(Otter(), pilot, scene, 130.0, STEP, start=start, environment=sea, seed=8)
    return run, [scene.back(each) for each in (run["true_north"] + 1j * run["true_east"]).tolist()]


@pytest.fixture(scope="module")
def home():
    return mission(Moved(Suite(low_cost())))


def test_a_turned_and_moved_scene_is_the_same_mission(home):
    run, track = mission(Moved(Suite(low_cost()), math.radians(137.0), 250.0 - 90.0j))
    assert len(run) == len(home[0]) and run["mode"][-1] == Mode.STOPPED
    assert np.max(np.abs(np.subtract(track, home[1]))) < 1e-9
    assert np.max(np.abs(run["leg_cross_track"][1:] - home[0]["leg_cross_track"][1:])) < 1e-9


def test_a_mirrored_scene_is_the_mirrored_mission(home):
    run, track = mission(Moved(Suite(low_cost()), mirrored=True))
    assert np.max(np.abs(np.subtract(track, home[1]))) < 1e-9
    assert np.max(np.abs(run.command - home[0].command[:, ::-1])) < 1e-6
    assert np.max(np.abs(run["leg_cross_track"][1:] + home[0]["leg_cross_track"][1:])) < 1e-9


@pytest.mark.parametrize("gain, time, speed", [(0.5, 4.0, 2.0), (0.3, 6.0, 1.5)])
def test_a_quick_boat_keeps_to_a_square_with_the_reference_filter_it_gets(gain, time, speed):
    boat = f'[vessel]\nkind = "nomoto"\ngain = {gain}\ntime_constant = {time}\nspeed = {speed}\n'
    corners = "[route]\nwaypoints = [{north = 0, east = 0}, {north = 200, east = 0}, {north = 200, east = 200}]"
    text = f'duration = 400.0\nstep = 0.1\n{boat}[estimator]\nkind = "truth"\n{corners}'
    assert sail_scenario(parse_scenario(text)).numbers["cross_track_rms_m"] < 9.0


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
