"""The whole loop: a scene turned, moved or mirrored changes nothing; a station in current; advice and reality."""

import math

import numpy as np
import pytest

from steerway.control import Rudder
from steerway.control.testing import advice, loop_damping
from steerway.core import wrap
from steerway.estimation import FiveStateFilter, Profile
from steerway.estimation.testing import FilterEstimator
from steerway.guidance import LineOfSight, Mission, Route, TrackingFilter
from steerway.sensors import Gnss, Suite, Truth, low_cost
from steerway.simulation import Start, parse_scenario, sail, sail_scenario
from steerway.testing import Mode, Pilot
from steerway.vessels import Current, Environment, Nomoto, Otter
from steerway.vessels.testing import OTTER_BOAT as OTTER

STEP = 0.02
NORTH, EAST = np.array([0.0, 60.0, 60.0]), np.array([0.0, 0.0, 50.0])


class Moved:
    """Instruments whose errors are turned, moved and mirrored with the scene: a fix is what it was there."""

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
    """The cross-track errors, true positions brought back, and commands of one mission in a moved scene."""
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
    sea = Environment(Current(0.3, scene.angle(1.2)))
    run = sail(Otter(), pilot, scene, 130.0, STEP, start=start, environment=sea, seed=8)
    track = np.array([scene.back(n, e) for n, e in zip(run["true_north"], run["true_east"], strict=True)])
    return run, track


@pytest.fixture(scope="module")
def home():
    return mission(Moved(Suite(low_cost()), 0.0, (0.0, 0.0), False))


@pytest.mark.parametrize("degrees", [90.0, 137.0, 180.0, -61.0])
def test_a_turned_and_moved_scene_is_the_same_mission(home, degrees):
    run, track = mission(Moved(Suite(low_cost()), math.radians(degrees), (250.0, -90.0), False))
    assert len(run) == len(home[0]) and run["mode"][-1] == Mode.STOPPED
    assert np.max(np.abs(track - home[1])) < 1e-9
    assert np.max(np.abs(run["leg_cross_track"][1:] - home[0]["leg_cross_track"][1:])) < 1e-9


def test_a_mirrored_scene_is_the_mirrored_mission(home):
    run, track = mission(Moved(Suite(low_cost()), 0.0, (0.0, 0.0), True))
    assert np.max(np.abs(track - home[1])) < 1e-9
    assert np.max(np.abs(run.command - home[0].command[:, ::-1])) < 1e-6
    assert np.max(np.abs(run["leg_cross_track"][1:] + home[0]["leg_cross_track"][1:])) < 1e-9


STATION = """
duration = 420.0
[environment.current]
speed = 0.3
direction_deg = 120.0
[gnss]
white = 0.05
markov = [[0.5, 300.0], [0.1, 5.0]]
[compass]
[speed]
cruise = 1.0
[route]
at_end = "hold"
waypoints = [{ north = 0, east = 0 }, { north = 40, east = 0, stay = 120 }, { north = 40, east = 60 }]
"""


@pytest.mark.parametrize("seed", [1, 2])
def test_an_otter_holds_station_in_a_current_and_leaves_again_without_chatter(seed):
    sailed = sail_scenario(parse_scenario(STATION), seed)
    run = sailed.run
    holding = run["mode"] == Mode.HOLDING
    edges = np.flatnonzero(np.diff(holding.astype(int))) + 1
    assert len(edges) == 3  # holds, leaves, holds to the end
    assert run.time[edges[1]] - run.time[edges[0]] == pytest.approx(120.0, abs=1.0)
    assert sailed.numbers["hand_overs"] == 4.0  # course takes over twice and gives up twice, no chatter
    assert not run["by_course"][holding].any()
    for first, last, east in ((edges[0], edges[1], 0.0), (edges[2], len(run), 60.0)):
        settled = slice(first + round(60.0 / STEP), last)
        away = np.hypot(run["true_north"] - 40.0, run["true_east"] - east)[settled]
        assert away.max() < 6.0 and np.median(away) < 4.0
        into = np.degrees(np.abs(np.angle(np.exp(1j * (run["true_heading"][settled] - math.radians(300.0))))))
        assert np.median(into) < 20.0  # bow into the current
    leaving = slice(edges[1] + round(25.0 / STEP), edges[2])
    assert np.median(run["by_course"][leaving]) == 1.0 and np.median(run.true_sog[leaving]) == pytest.approx(
        1.0, abs=0.1
    )


def hunting(bandwidth, density, std, nomoto_time, speed=2.0, seed=4):
    """Largest excursion of the true course, rad, on a straight leg with fixes all but free of noise."""
    gain = 0.2
    boat = OTTER.but(
        nomoto_gain=gain, nomoto_time=nomoto_time, bandwidth=bandwidth, yaw_limit=0.6, propulsion=Rudder(0.6)
    )
    profile = Profile(speed_noise=1e-3, course_rate_noise=density, course_rate_decay=0.0, position_std=std)
    pilot = Pilot(
        FilterEstimator(FiveStateFilter(profile)),
        Mission(Route([0.0, 5000.0], [0.0, 0.0], 5.0)),
        LineOfSight(2000.0),
        boat.autopilot(TrackingFilter(0.05)),
        boat.propulsion,
    )
    instruments = Suite(Gnss(rate=5.0, white=0.02 * std))
    run = sail(Nomoto(gain, nomoto_time, speed), pilot, instruments, 500.0, 0.1, start=Start(0.0, 3.0), seed=seed)
    late = run.time > 300.0
    return float(np.max(np.abs(run.true_cog[late])))


@pytest.mark.parametrize(
    ("bandwidth", "nomoto_time", "calm"), [(0.2, 5.0, True), (0.35, 5.0, False), (0.65, 1.0, False), (0.25, 2.0, True)]
)
def test_advice_tells_what_the_loop_then_does(bandwidth, nomoto_time, calm):
    """ω_e is 0.69 rad/s throughout: ω_n ≤ ω_e alone would let all of these sail."""
    circumstances = (2.0, 1.35e-3, 0.5, 0.2)
    fits, sentence = advice(bandwidth, *circumstances, nomoto_time)
    assert fits is calm, sentence
    excursion = hunting(bandwidth, circumstances[1], circumstances[2], nomoto_time)
    assert (excursion < math.radians(1.0)) is calm


def test_a_weakly_damped_loop_is_not_passed():
    """Of 0.17 it does not hunt, but rings; in a head current of 80 % of her speed dχ/dψ is 5, and it does."""
    circumstances = (2.0, 1.35e-3, 0.5, 0.2)
    fits, sentence = advice(0.5, *circumstances, 1.0)
    assert not fits and "a damping of 0.17 with T = 1 s, expected at least 0.2" in sentence
    assert advice(0.25, *circumstances, 2.0)[0]
    fits, sentence = advice(0.25, *circumstances, 2.0, course_gain=5.0, current=1.6)
    assert not fits and "in a current of 1.6 m/s" in sentence
    assert loop_damping(0.25, 0.69, 2.0, course_gain=5.0) < loop_damping(0.25, 0.69, 2.0)


def test_the_damping_of_the_loop():
    # An estimator beyond every measure leaves the autopilot's own poles: 0.13, 0.59 and 1.28 ω_n, all real.
    assert loop_damping(0.5, 500.0, 20.0) == pytest.approx(0.5, abs=0.01)  # the filter's own pair
    assert loop_damping(1.0, 2.05, 1.0) > 0.0 > loop_damping(1.0, 1.95, 1.0)
    assert loop_damping(1.0, 1.0, 0.55) > 0.0 > loop_damping(1.0, 1.0, 0.65)


def test_on_true_states_the_loop_needs_no_filter():
    scenario = parse_scenario(STATION.replace("[compass]", '[estimator]\nkind = "truth"'))
    sailed = sail_scenario(scenario)
    assert isinstance(sailed.assembly.instruments, Truth)
    assert sailed.numbers["position_rms_m"] == 0.0 and sailed.numbers["waypoints_reached"] == 2.0
