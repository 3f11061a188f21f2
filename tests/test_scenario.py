"""Scenarios: examples, dynamic positioning, weather; an error is one sentence with the key's path."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from steerway.control import Thrusters
from steerway.core import InputError
from steerway.estimation import Profile
from steerway.simulation import assemble, load_scenario, parse_scenario, sail_scenario
from steerway.simulation.testing import advise, boat, pilot
from steerway.vessels import (
    CALM,
    CYBERSHIP2_DAMPING,
    CYBERSHIP2_INERTIA,
    Current,
    CyberShip2,
    Environment,
    LowSpeedVessel,
    Nomoto,
    Otter,
    conditions,
)
from steerway.vessels.testing import AIR_DENSITY, Waves, Wind

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.toml"))
P2 = (EXAMPLES[0].parent / "p2.toml").read_text(encoding="utf-8")
ROUTE = "[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 200, east = 0 }]\n"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_can_be_built(path):
    assemble(load_scenario(path))


def test_a_route_alone_is_a_scenario_and_angles_are_degrees_in_the_file_and_radians_behind_it():
    scenario = parse_scenario(ROUTE)
    assert scenario.vessel.kind == "otter" and scenario.gnss.rate == 5.0 and boat(scenario).cruise == 1.2
    blocks = assemble(
        parse_scenario(
            ROUTE + "[start]\nheading_deg = 90\n[environment.waves]\nroll_std_deg = 5\n[compass]\nstd_deg = 2"
        )
    )
    assert blocks.start.heading == pytest.approx(math.pi / 2.0)
    assert blocks.environment.waves.roll_std_deg == 5.0
    assert blocks.instruments.compass.instrument.white == pytest.approx(math.radians(2.0))


def test_the_slowest_leg_is_what_the_autopilot_is_judged_by():
    slow = ROUTE.replace("north = 200, east = 0", "north = 200, east = 0, speed = 0.6")
    assert "at 0.6 m/s" in advise(parse_scenario(slow))[1] and "at 1.2 m/s" in advise(parse_scenario(ROUTE))[1]


def test_waypoints_in_latitude_and_longitude():
    text = """
    origin = { latitude_deg = 63.0, longitude_deg = 10.0 }
    [route]
    waypoints = [{ latitude_deg = 63.0, longitude_deg = 10.0 }, { latitude_deg = 63.001, longitude_deg = 10.0 }]
    """
    (mission,) = pilot(parse_scenario(text)).mission.missions
    assert mission.route.north[1] == pytest.approx(111.5, abs=0.1) and mission.route.east[1] == 0.0


@pytest.mark.parametrize("place", ["north = 100.0, east = 50.0", "latitude_deg = 63.44, longitude_deg = 10.40"])
def test_a_survey_comes_after_the_waypoints(place):
    """Lines to the east, spaced by 20 m to starboard and so to the south; the turns are 5 m outside the area."""
    survey = f"{{ {place}, direction_deg = 90.0, length = 80.0, spacing = 20.0, lines = 2, run_in = 5.0 }}"
    scenario = parse_scenario(f"[route]\nwaypoints = [{{ north = -30.0, east = 9.0 }}]\nsurvey = {survey}")
    (mission,) = pilot(scenario).mission.missions
    north, east = (100.0, 50.0) if "east" in place else (0.0, 0.0)
    sailed = [(-30.0, 9.0), (0.0, -5.0), (0.0, 85.0), (-20.0, 85.0), (-20.0, -5.0)]
    expected = [sailed[0], *((north + n, east + e) for n, e in sailed[1:])]
    assert list(zip(mission.route.north, mission.route.east, strict=True)) == [
        pytest.approx(each, abs=0.2) for each in expected
    ]


WRONG = {
    "unknown key gnss.rat, expected perhaps rate": ROUTE + "[gnss]\nrat = 5",
    "gnss.rate is 0, expected more than 0": ROUTE + "[gnss]\nrate = 0",
    "gnss.rate is 100 Hz, expected at most the step rate, 50 Hz": ROUTE + "[gnss]\nrate = 100",
    "vessel.kind is 'boat', expected one of otter, mariner, nomoto": ROUTE + '[vessel]\nkind = "boat"',
    "unknown key vessel.gain for kind otter, expected one of method, kind, payload_mass": ROUTE + "[vessel]\ngain = 1",
    "step is 'fast', expected a number": 'step = "fast"\n' + ROUTE,
    "duration of 1e+07 s in steps of 0.02 s is 5e+08 steps, expected at most 2e+07": "duration = 1e7\n" + ROUTE,
    "route.waypoints is [], expected at least 2 entries, a table [route.survey] or [[orders]]": "step = 0.02",
    'route.corner_radius has no effect on exact corners, expected corners = "arc" or': ROUTE + "corner_radius = 5",
    "corners with a radius of 9 m take 18 m of the leg to route.waypoint[2], which has 15 m": (
        '[route]\ncorners = "arc"\ncorner_radius = 9\n'
        "survey = { north = 0, east = 0, length = 80, spacing = 15, lines = 2 }"
    ),
    "route.waypoints[1] is 10000 km from the origin at 63.44°, 10.4°, expected at most 500 km": (
        "[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 1e7, east = 0 }]"
    ),
    "route.waypoints[1] gives north, expected north and east in m, or latitude_deg and longitude_deg": (
        "[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 5 }]"
    ),
    "route.waypoint[1] is 3 m from waypoint 0, expected more than the acceptance radius of route.waypoint[1], 4 m": (
        "[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 3, east = 0 }]"
    ),
    "speed.cruise is 0 m/s, expected more than 0.5 m/s: below steerageway course is undefined": (
        ROUTE + "[speed]\ncruise = 0"
    ),
    "speed.cruise has no effect on a vessel of kind mariner, which has no speed control": ROUTE
    + '[vessel]\nkind = "mariner"\n[speed]\ncruise = 5',
    "guidance.law adaptive-line-of-sight commands a heading, expected a table [compass]": (
        ROUTE + '[guidance]\nlaw = "adaptive-line-of-sight"'
    ),
    'route.at_end is "hold", expected a table [compass]: at rest only a compass measures heading': ROUTE
    + 'at_end = "hold"',
    "route needs station keeping, which a vessel of kind mariner cannot do, expected one of otter": (
        ROUTE + 'at_end = "hold"\nacceptance = 50\n[vessel]\nkind = "mariner"\n[compass]'
    ),
    "autopilot.bandwidth is 0.1 rad/s, expected at least 0.5 rad/s": ROUTE + "[autopilot]\nbandwidth = 0.1",
    "estimator.aid names yaw_rate, expected a table [gyro]": ROUTE + '[estimator]\naid = ["yaw_rate"]',
    "profile 'oter' is unknown, expected one of": ROUTE + '[estimator]\nprofile = "oter"',
    "gnss.faults[0]: kind jump has both or neither of start": ROUTE + '[[gnss.faults]]\nkind = "jump"\nsize = 5',
    "environment.current.speed is nan, expected": ROUTE + "[environment.current]\nspeed = nan",
    "begins is 'noon', expected ISO 8601 such as": 'begins = "noon"\n' + ROUTE,
    "scenario test.toml is not valid TOML": "route = [",
    "orders hold a position, which a vessel of kind otter cannot, expected one of": P2.replace(
        '"cybership2"', '"otter"'
    ),
    'estimator.kind is "five-state", expected one of vessel-filter': P2.replace('"tekf"', '"five-state"'),
    'estimator.kind "tekf" needs a compass': P2.replace("[compass]\nrate = 10.0\nstd_deg = 0.5", ""),
    "orders[1].speed has no effect where orders hold a position": P2.replace("course_deg = 45.0", "speed = 1.0", 1),
    "speed.cruise has no effect where orders hold": P2 + "\n[speed]\ncruise = 1.0\n",
    'estimator.kind "tekf" needs positions to hold': re.sub(r"(?m)^(north|east) = ", r"# \1 = ", P2),
    "expected a positive definite matrix": (
        "[[orders]]\nnorth = 0.0\n[estimator]\nkind = 'truth'\n"
        '[vessel]\nkind = "low-speed"\ninertia = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]\n'
    ),
}


@pytest.mark.parametrize("expected", WRONG)
def test_what_is_wrong_is_one_sentence(expected):
    with pytest.raises(InputError) as caught:
        parse_scenario(WRONG[expected], "scenario test.toml")
    sentence = str(caught.value)
    assert sentence.startswith("scenario test.toml") and expected in sentence.replace(".0,", ",")
    assert "\n" not in sentence and "pydantic" not in sentence


def test_a_file_that_is_not_there_and_a_profile_beside_the_scenario(tmp_path):
    with pytest.raises(InputError, match=r"scenario .*none\.toml cannot be read: No such file"):
        load_scenario(tmp_path / "none.toml")
    Profile.named("otter").model_copy(update={"position_std": 0.123}).save(tmp_path / "mine.toml")
    (tmp_path / "scene.toml").write_text(ROUTE + '[estimator]\nprofile = "mine.toml"', encoding="utf-8")
    assert pilot(load_scenario(tmp_path / "scene.toml")).estimator.filter.profile.position_std == 0.123


SHORT_LEGS = """
duration = 60.0
[vessel]
kind = "motorboat"
[estimator]
kind = "steering"
[environment.current]
speed = {current}
direction_deg = 90.0
[route]
waypoints = [{{ north = 0.0, east = 0.0 }}, {{ north = 80.0, east = 0.0 }}, {{ north = 80.0, east = 9.0 }},
             {{ north = 0.0, east = 9.0 }}]
"""


def test_a_leg_shorter_than_its_turns_in_the_current_is_refused_by_name():
    parse_scenario(SHORT_LEGS.format(current=0.0).replace("east = 9.0", "east = 40.0"))
    with pytest.raises(
        InputError, match=r"leg to route.waypoints\[2\] is 9 m long, expected at least \d+ m, the length"
    ):
        parse_scenario(SHORT_LEGS.format(current=1.0))


HOLD = "duration = 120.0\nstep = 0.1\n[compass]\n[gnss]\nrate = 1.0\nwhite = 0.1\nmarkov = []\n"
ORDERS = "[[orders]]\nnorth = 0.0\neast = 0.0\n[[orders]]\ntime = 5.0\nnorth = 6.0\neast = -4.0\ncourse_deg = 170.0\n"


def test_a_vessel_by_its_matrices_is_the_vessel_whose_they_are():
    limits = [2.0, 1.5, 1.5]
    same = LowSpeedVessel(CYBERSHIP2_INERTIA, CYBERSHIP2_DAMPING, Thrusters(np.eye(3), np.negative(limits), limits))
    ship, weather = CyberShip2(), conditions((0.1, -0.05), (0.3, 0.1), 0.02)
    states = [ship.start(1.0, 2.0, 0.4, 0.2), same.start(1.0, 2.0, 0.4, 0.2)]
    for k in range(200):
        command = (3.0 * np.sin(0.1 * k), np.cos(0.07 * k), -0.2)
        states = [each.step(state, command, weather, 0.1) for each, state in zip((ship, same), states, strict=True)]
    np.testing.assert_allclose(*states, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(ship.motion(states[0], CALM), same.motion(states[1], CALM), atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "method"),
    [("vessel-filter", "rk4"), ("tekf", "euler"), ("passive-observer", "rk4"), ("truth", "euler")],
)
def test_every_estimator_holds_a_place_with_thrusters(kind, method):
    text = f'{HOLD}[vessel]\nkind = "low-speed"\nmethod = "{method}"\n[estimator]\nkind = "{kind}"\n{ORDERS}'
    run = sail_scenario(parse_scenario(text)).run
    late = run.time > 90.0
    assert np.hypot(run["true_north"] - 6.0, run["true_east"] + 4.0)[late].max() < 0.5
    assert np.abs(np.degrees(run["true_heading"])[late] - 170.0).max() < 5.0
    assert run.command.shape[1] == 4


def test_a_steady_force_is_held_against_and_estimated():
    sea = "[environment]\nforce = [20.0, -10.0]\n"
    kind = '[vessel]\nkind = "low-speed"\n[estimator]\nkind = "vessel-filter"\n'
    noise = "[estimator.positioning]\nforce_std = [30.0, 30.0, 5.0]\n"
    text = HOLD.replace("120.0", "300.0") + kind + noise + sea + ORDERS
    sailed = sail_scenario(parse_scenario(text))
    known = sailed.assembly.pilot.estimator.observer
    std = np.sqrt(np.diag(known.covariance)[6:8])
    assert (
        np.abs(np.subtract(known.motion.force[:2], (20.0, -10.0))) < 3.0 * std
    ).all() and std.max() < 15.0  # half of its initial value
    assert np.hypot(sailed.numbers["final_north_m"] - 6.0, sailed.numbers["final_east_m"] + 4.0) < 0.5


def test_a_filter_that_knows_the_waves_does_not_follow_them():
    waves = "[environment.waves]\ndisplacement_std = 0.3\nfrequency = 0.8\n"
    kind = '[vessel]\nkind = "low-speed"\n[estimator]\nkind = "vessel-filter"\n'
    text = HOLD.replace("rate = 1.0", "rate = 5.0") + kind + waves + "[[orders]]\nnorth = 0.0\neast = 0.0\n"
    known = "[estimator.positioning]\nwave_std = 0.3\n"
    knowing, ignorant = (sail_scenario(parse_scenario(text + each)) for each in (known, ""))
    spread = [np.std(each.run["estimated_north"]) for each in (knowing, ignorant)]
    assert spread[0] < 0.7 * spread[1]


@pytest.mark.parametrize("kind", ["low-speed", "cybership2"])
def test_these_vessels_follow_a_route_too(kind):
    corner = "[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 60, east = 0 }, { north = 60, east = 40 }]\n"
    numbers = sail_scenario(parse_scenario(f'step = 0.1\n[vessel]\nkind = "{kind}"\n{corner}')).numbers
    assert (numbers["waypoints_reached"], numbers["waypoints_missed"]) == (2.0, 0.0)


def run(environment, n, step=0.1, seed=0, motion=None):
    """Conditions (n, 5) and wave motions (n, 4)."""
    sea = environment.start(seed, step)
    conditions, waves = np.empty((n, 5)), np.empty((n, 4))
    for k in range(n):
        conditions[k], waves[k] = sea.conditions, sea.waves
        sea.advance(motion)
    return conditions, waves


def test_constant_parts_are_constant_and_point_where_they_go():
    environment = Environment(current=Current(speed=0.5, direction_deg=90.0), force=(3.0, -4.0), moment=2.0)
    conditions, _ = run(environment, 5)
    np.testing.assert_allclose(conditions, np.tile([0.0, 0.5, 3.0, -4.0, 2.0], (5, 1)), atol=1e-15)


def test_a_wandering_current_and_a_varying_force_have_their_spread_and_memory():
    current = Current(speed=0.5, std=0.1, time_constant=20.0)
    environment = Environment(current=current, force=(0.3, 0.0), force_std=(2.0, 1.0), moment_std=0.5, force_time=5.0)
    conditions, _ = run(environment, 60_000)
    assert (np.abs(conditions.mean(axis=0) - [0.5, 0.0, 0.3, 0.0, 0.0]) < [0.02, 0.02, 0.2, 0.1, 0.05]).all()
    np.testing.assert_allclose(conditions.std(axis=0), [0.1, 0.1, 2.0, 1.0, 0.5], rtol=0.1)
    for part, lag in zip(conditions.T, (200, 200, 50, 50, 50), strict=True):
        assert np.corrcoef(part[lag:], part[:-lag])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.1)


@pytest.mark.parametrize("before_the_wind", [True, False])
def test_a_vessel_before_the_wind_feels_less_of_it(before_the_wind):
    blows_from, sailing = 2.5, Nomoto(1.0, 1.0, speed=4.0)
    motion = sailing.motion(sailing.start(heading=blows_from + math.pi * before_the_wind), np.zeros(5))
    wind = Wind(speed=10.0, direction_deg=math.degrees(blows_from), drag_area=0.5)
    conditions, _ = run(Environment(wind=wind), 2, motion=motion)
    over_deck = np.array([10.0, 6.0 if before_the_wind else 14.0])  # before the first step the vessel lies still
    push = 0.5 * AIR_DENSITY * 0.5 * over_deck**2
    expected = np.outer(push, [-math.cos(blows_from), -math.sin(blows_from)])
    np.testing.assert_allclose(conditions[:, 2:4], expected, atol=1e-12)


def test_wind_on_a_forward_arm_turns_the_bow_away():
    boat = Otter()
    motion = boat.motion(boat.start(heading=0.0), np.zeros(5))
    wind = Wind(speed=10.0, direction_deg=90.0, drag_area=0.5, arm=0.3)
    conditions, _ = run(Environment(wind=wind), 2, motion=motion)
    assert conditions[1, 4] == pytest.approx(0.3 * conditions[1, 3])
    assert conditions[1, 4] < 0.0  # wind from the east, heading north: the bow falls off to port


def test_waves_have_their_spread_and_period_and_go_one_way():
    frequency = 1.5
    waves = Waves(
        direction_deg=math.degrees(0.7), frequency=frequency, displacement_std=0.3, roll_std_deg=6.0, pitch_std_deg=3.0
    )
    _, motion = run(Environment(waves=waves), 60_000)
    away = motion[:, 0] * math.cos(0.7) + motion[:, 1] * math.sin(0.7)
    across = motion[:, 1] * math.cos(0.7) - motion[:, 0] * math.sin(0.7)
    np.testing.assert_allclose([away.std(), *np.degrees(motion[:, 2:].std(axis=0))], [0.3, 6.0, 3.0], rtol=0.08)
    np.testing.assert_allclose(across, 0.0, atol=1e-15)
    spectrum = np.abs(np.fft.rfft(away)) ** 2
    omega = 2.0 * math.pi * np.fft.rfftfreq(len(away), 0.1)
    near = (omega > frequency - 0.5) & (omega < frequency + 0.5)
    assert spectrum[near].sum() > 0.75 * spectrum.sum()
    assert omega[near] @ spectrum[near] / spectrum[near].sum() == pytest.approx(frequency, abs=0.05)
