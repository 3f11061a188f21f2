"""The loop with its pilot: repeatability, the record of a run, runs without fixes; turned and mirrored scenes."""

import cmath
import math

import numpy as np
import pytest

from steerway.core import InputError, wrap
from steerway.estimation import FiveStateFilter
from steerway.estimation.testing import FilterEstimator
from steerway.guidance import LineOfSight, Mission, ReferenceModel, Route
from steerway.pilot import Mode, Pilot
from steerway.sensors import Gnss, Suite, low_cost
from steerway.sensors.testing import Fault
from steerway.simulation import Start, parse_scenario, sail, sail_scenario
from steerway.simulation.testing import course_bound, errors, evaluated
from steerway.vessels import Current, Environment, Otter
from steerway.vessels.testing import OTTER_BOAT as OTTER

STEP = 0.02
CORNERS = 0.0, 60.0, 60.0 + 60.0j
CROSSING = Environment(current=Current(speed=0.3, direction_deg=90.0))


def otter_pilot(corners=CORNERS, **more):
    return Pilot(
        FilterEstimator(FiveStateFilter("otter")),
        Mission(Route(np.real(corners), np.imag(corners), 5.0)),
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


def sailed_in(scene):
    """The cross-track errors, true positions moved back, and commands of one mission in a moved scene."""
    start = scene.there(-3.0 + 4.0j)
    start = Start(start.real, start.imag, scene.angle(0.5), 0.5)
    sea = Environment(current=Current(speed=0.3, direction_deg=math.degrees(scene.angle(1.2))))
    pilot = otter_pilot([scene.there(each) for each in CORNERS])
    run = sail(Otter(), pilot, scene, 150.0, STEP, start=start, environment=sea, seed=8)
    return run, [scene.back(each) for each in (run["true_north"] + 1j * run["true_east"]).tolist()]


def test_a_turned_moved_or_mirrored_scene_is_the_same_mission():
    home, track = sailed_in(Moved(Suite(low_cost())))
    turned, there = sailed_in(Moved(Suite(low_cost()), math.radians(137.0), 250.0 - 90.0j))
    mirrored, beyond = sailed_in(Moved(Suite(low_cost()), mirrored=True))
    assert len(turned) == len(home) and home["mode"][-1] == Mode.STOPPED
    for run, moved, side in ((turned, there, 1.0), (mirrored, beyond, -1.0)):
        assert np.max(np.abs(np.subtract(moved, track))) < 1e-9
        assert np.max(np.abs(run["leg_cross_track"][1:] - side * home["leg_cross_track"][1:])) < 1e-9
    assert np.max(np.abs(mirrored.command - home.command[:, ::-1])) < 1e-6


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
