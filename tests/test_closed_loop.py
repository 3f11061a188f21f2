"""The closed loop: invariance to rotation, translation and mirroring; a quick boat; the least possible error."""

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
NORTH, EAST = np.array([0.0, 60.0, 60.0]), np.array([0.0, 0.0, 50.0])


class Moved:
    """Instruments whose errors are rotated, translated and mirrored with the scene."""

    def __init__(self, suite, turn, shift, mirrored):
        self.suite, self.turn, self.shift, self.mirrored = suite, turn, shift, mirrored

    def start(self, seed):
        self.stream = self.suite.start(seed)
        return self

    def step(self, time, motion, waves):
        home = motion._replace(**dict(zip(("north", "east"), self.back(motion.north, motion.east), strict=True)))
        readings = self.stream.step(time, home, waves)
        if math.isnan(readings.north):
            return readings
        north, east = self.there(readings.north, readings.east)
        return readings._replace(north=north, east=east)

    def there(self, north, east):
        east = -east if self.mirrored else east
        c, s = math.cos(self.turn), math.sin(self.turn)
        return c * north - s * east + self.shift[0], s * north + c * east + self.shift[1]

    def back(self, north, east):
        c, s = math.cos(self.turn), math.sin(self.turn)
        north, east = north - self.shift[0], east - self.shift[1]
        north, east = c * north + s * east, c * east - s * north
        return north, -east if self.mirrored else east

    def angle(self, angle):
        return wrap((-angle if self.mirrored else angle) + self.turn)


def mission(scene):
    """The cross-track errors, true positions moved back, and commands of one mission in a moved scene."""
    route = np.array([scene.there(n, e) for n, e in zip(NORTH, EAST, strict=True)]).T
    pilot = Pilot(
        FilterEstimator(FiveStateFilter("otter")),
        Mission(Route(*route, 5.0)),
        LineOfSight(12.0),
        OTTER.autopilot(TrackingFilter(1.0)),
        OTTER.propulsion,
        OTTER.speed_loop(),
        cruise=1.2,
    )
    start = Start(*scene.there(-3.0, 4.0), scene.angle(0.5), 0.5)
    sea = Environment(current=Current(speed=0.3, direction_deg=math.degrees(scene.angle(1.2))))
    run = sail(Otter(), pilot, scene, 130.0, STEP, start=start, environment=sea, seed=8)
    track = np.array([scene.back(n, e) for n, e in zip(run["true_north"], run["true_east"], strict=True)])
    return run, track


@pytest.fixture(scope="module")
def home():
    return mission(Moved(Suite(low_cost()), 0.0, (0.0, 0.0), False))


def test_a_turned_and_moved_scene_is_the_same_mission(home):
    run, track = mission(Moved(Suite(low_cost()), math.radians(137.0), (250.0, -90.0), False))
    assert len(run) == len(home[0]) and run["mode"][-1] == Mode.STOPPED
    assert np.max(np.abs(track - home[1])) < 1e-9
    assert np.max(np.abs(run["leg_cross_track"][1:] - home[0]["leg_cross_track"][1:])) < 1e-9


def test_a_mirrored_scene_is_the_mirrored_mission(home):
    run, track = mission(Moved(Suite(low_cost()), 0.0, (0.0, 0.0), True))
    assert np.max(np.abs(track - home[1])) < 1e-9
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
