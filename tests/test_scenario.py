"""Scenarios: the examples run, defaults work, and an error is one sentence with the key's path."""

import math
from pathlib import Path

import pytest

from steerway.core import InputError
from steerway.simulation import assemble, load_scenario, parse_scenario
from steerway.simulation.testing import advise, boat, pilot

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.toml"))
ROUTE = "[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 200, east = 0 }]\n"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_can_be_built(path):
    assemble(load_scenario(path))


def test_a_route_alone_is_a_scenario():
    scenario = parse_scenario(ROUTE)
    assert scenario.vessel.kind == "otter" and scenario.gnss.rate == 5.0 and boat(scenario).cruise == 1.2


def test_angles_are_degrees_in_the_file_and_radians_behind_it():
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
    from steerway.estimation import Profile

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
