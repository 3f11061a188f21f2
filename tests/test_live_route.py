"""Routes, missions, fences and steering sentences; unknown values are never sent as known."""

import math
from pathlib import Path

import pytest

from steerway.core import OK, InputError
from steerway.core.testing import NAUTICAL_MILE, Leg, displaced
from steerway.formats.testing import apb, rmb, sealed, xte
from steerway.guidance.testing import GuidanceTable, WaypointTable
from steerway.live.testing import Fence, GeodeticRoute, MissionTable, Row, Supervisor, pilot_of
from tests.desk import HOME, NOON, SQUARE, corner, square

EXAMPLES = Path(__file__).parent.parent / "examples" / "live"
STARBOARD = Leg(18.52, 0.0, math.radians(350.0), 1852.0, math.radians(-10.0), 2.0, *HOME, "WP0", "WP1")


def at(north, east, time=NOON, cog=0.0, sog=2.0):
    return Row(time, *displaced(*HOME, north, east), sog, cog, 0.0, 0.1, 0.02, 0.01, 0.3, 0.3, 1.0, OK)


def legs(route, rows):
    """The legs that a supervisor shows, without being started."""
    supervisor, shown = Supervisor(route), []
    for row in rows:
        supervisor.step(row, 1.0)
        shown.append(supervisor.leg)
    return shown


CORNER = GeodeticRoute.of(
    [corner(*each, WaypointTable) for each in ((0.0, 0.0), (200.0, 0.0), (200.0, 200.0))],
    [],
    MissionTable(lookahead=20.0, acceptance=5.0),
)


def test_the_letter_is_the_side_to_steer_to():
    assert xte(STARBOARD) == sealed("SWXTE,A,A,0.0100,L,N,A")
    assert xte(STARBOARD._replace(cross_track=-18.52)) == sealed("SWXTE,A,A,0.0100,R,N,A")
    assert apb(STARBOARD) == sealed("SWAPB,A,A,0.0100,L,N,V,V,0.00,T,WP1,350.00,T,350.00,T,A")
    assert rmb(STARBOARD) == sealed("SWRMB,A,0.01,L,WP0,WP1,5400.0000000,N,01000.0000000,E,1.000,350.00,3.89,V,A")
    assert rmb(STARBOARD._replace(cross_track=-30.0 * NAUTICAL_MILE)).startswith("$SWRMB,A,9.99,R,")
    assert ",A,A,0.00,T," in apb(STARBOARD._replace(is_arrived=True, is_passed=True))


def test_a_boat_is_led_back_to_the_line_and_along_the_route_to_its_end():
    (leg,) = legs(CORNER, [at(50.0, 10.0)])
    assert leg.cross_track == pytest.approx(10.0, abs=1e-3) and leg.direction == pytest.approx(0.0, abs=1e-6)
    assert leg.course_to_steer == pytest.approx(-math.atan(0.5), abs=1e-4)
    assert leg.distance == pytest.approx(math.hypot(150.0, 10.0), abs=1e-2)
    assert leg.closing_speed == pytest.approx(2.0 * math.cos(math.atan2(10.0, 150.0)), abs=1e-4)
    assert math.degrees(leg.latitude) == pytest.approx(54.0 + 200.0 / 111_300.0, abs=1e-4)
    rows = [at(float(k), 0.0, NOON + k) for k in range(0, 210, 2)]
    rows += [at(200.0, float(k), NOON + 300.0 + k, cog=math.pi / 2.0) for k in range(0, 210, 2)]
    found = legs(CORNER, rows)
    assert (found[0].destination, found[104].destination, found[-1]) == ("WP1", "WP2", None)
    assert found[104].direction == pytest.approx(math.pi / 2.0, abs=1e-6)
    assert any(leg is not None and leg.is_arrived for leg in found[105:])
    found = legs(
        square(((0.0, 0.0), (60.0, 0.0))), [at(north, 0.0, NOON + north) for north in (10.0, 40.0, 50.0, 54.0)]
    )
    asked = [leg.speed for leg in found]  # slower before the end
    assert asked[0] == asked[1] == 1.2 and 1.2 > asked[2] > asked[3] == pytest.approx(0.72)


POINTS = '<rtept lat="54" lon="10"/><rtept lat="54.01" lon="10.01"/>'
LINE = '{"type": "LineString", "coordinates": [[10, 54], [10.01, 54.01]]}'
RING = '{"type": "Polygon", "coordinates": [[[9.9, 53.9], [10.1, 53.9], [10.1, 54.1], [9.9, 54.1], [9.9, 53.9]]]}'
FEATURES = ", ".join(f'{{"type": "Feature", "properties": {{}}, "geometry": {each}}}' for each in (RING, LINE))
ROUTES = {
    "r.gpx": f'<gpx xmlns="http://www.topografix.com/GPX/1/1"><rte>{POINTS}</rte></gpx>',
    "r.geojson": f'{{"type": "FeatureCollection", "features": [{FEATURES}]}}',
}


@pytest.mark.parametrize("name", ROUTES)
def test_routes_of_other_programs(tmp_path, name):
    (tmp_path / name).write_text(ROUTES[name])
    route = GeodeticRoute.load(tmp_path / name)
    assert route.latitude.tolist() == [math.radians(54.0), math.radians(54.01)]
    assert route.longitude.tolist() == [math.radians(10.0), math.radians(10.01)]
    if name == "r.geojson":
        assert route.fence.holds(*HOME)
        (tmp_path / name).write_text(
            ROUTES[name].replace("[[[9.9", "[[[9.95, 53.95], [10.05, 53.95], [10, 54]], [[9.9")
        )
        with pytest.raises(InputError, match="the fence has holes"):
            GeodeticRoute.load(tmp_path / name)


MISSION = """
name = "harbour"
lookahead = 12.0
speed_mps = 1.5
safe = "hand-back"
waypoint = [{ lat_deg = 54.0, lon_deg = 10.0 }, { lat_deg = 54.001, lon_deg = 10.0, speed_mps = 0.8, acceptance = 3 }]
fence = [{ lat_deg = 53.9, lon_deg = 9.9 }, { lat_deg = 53.9, lon_deg = 10.1 }, { lat_deg = 54.1, lon_deg = 10.0 }]
[limits]
max_sog_mps = 2.0
[boat]
reverse = true
"""


def test_a_mission_file(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(MISSION)
    route = GeodeticRoute.load(path)
    assert route.speed.tolist() == [1.5, 0.8] and route.acceptance.tolist() == [10.0, 3.0]
    assert route.settings.guided.lookahead == 12.0 and route.settings.safe == "hand-back"
    assert route.settings.limits.max_sog_mps == 2.0
    assert route.settings.boat.reverse and route.settings.boat.top_speed_mps == 3.0
    assert route.fence.holds(*HOME) and not route.fence.holds(math.radians(54.2), HOME[1])


def test_a_mission_is_guided_as_a_scenario_is():
    """With the same guidance law and gains."""
    table = GuidanceTable(law="integral-line-of-sight", integral_gain=0.25)
    assert Supervisor(square(guidance=table)).pilot.law == table.design(8.0, 1.2)


ORIGIN = "origin = { latitude_deg = 54.0, longitude_deg = 10.0 }\n"
PLACES = """
waypoint = [{ north = 0.0, east = 0.0 }, { north = 100.0, east = 0.0, speed = 0.8 }]
fence = [{ north = -9, east = -9 }, { north = -9, east = 9 }, { north = 200, east = 9 }, { north = 200, east = -9 }]
"""
SURVEY = (EXAMPLES / "survey.toml").read_text()


def items(*frame_command_stay, home="54"):
    """A `.waypoints` file with these items, northwards from 54° N."""
    lines = ["QGC WPL 110", f"0 1 0 16 0 0 0 0 {home} 10 0 1"]
    for k, (frame, command, stay) in enumerate(frame_command_stay, start=1):
        lines.append(f"{k} 0 {frame} {command} {stay} 0 0 0 54.00{k} 10 0 1")
    return "\n".join(lines)


SAILED, RALLY = (3, 16, 0), "rally = { lat_deg = 54.2, lon_deg = 10.0 }\n"


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("a.kml", "", "ending"),
        ("a.plan", "[]", "route"),
        ("a.plan", "{}", "its fileType is not Plan"),
        ("a.waypoints", "nonsense", "its first line is not QGC WPL 110"),
        ("a.waypoints", "QGC WPL 110\n1 2", "line 2 has 2 columns and not 12"),
        ("a.waypoints", items(SAILED, (1, 16, 0)), "item 1 has frame 1, expected a global frame: any of"),
        ("a.waypoints", items(SAILED, (3, 16, 5)), "item 1 stays for 5 s, expected 0 s"),
        ("a.waypoints", items((3, 17, 0), SAILED), "item 1 follows one that loiters"),
        ("a.waypoints", items(SAILED, (3, 20, 0), home="0"), "item 1 returns, and there is no home position"),
        ("a.toml", MISSION + "[guidance]\nlookahead = 9.0", "lookahead and guidance.lookahead are both given"),
        ("a.toml", MISSION + "[guidance]\nlaw = 'ilos'", "guidance.law is 'ilos', expected one of line-of-sight"),
        ("a.toml", "[[waypoint]]\nlat_deg = 54.0\nlon_deg = 1.0", "has 1 waypoints"),
        ("a.toml", MISSION.replace("[boat]", "[boats]"), "unknown key boats, expected perhaps boat"),
        ("a.toml", MISSION.replace("= 0.8", "= nan"), r"waypoint\[1\].speed_mps is nan, expected a finite number"),
        ("a.toml", MISSION.replace("lat_deg = 54.1", "lat_deg = 53.95"), "waypoint 0 lies outside of the fence"),
        ("a.toml", MISSION.replace("lookahead", RALLY + "lookahead"), "rally place lies outside of the fence"),
        (
            "a.toml",
            ORIGIN + PLACES.replace("north = 100.0, ", ""),
            r"1\] gives east, expected north and east in m",
        ),
        ("a.toml", PLACES, "gives north and east, expected lat_deg"),
        ("a.toml", ORIGIN + PLACES.replace("= 0.8", "= 0.8, speed_mps = 1.0"), "expected one of speed and speed_mps"),
        ("a.toml", SURVEY.replace("spacing = 25.0", "spacing = 90.0"), "lies outside of the fence"),
        ("a.toml", SURVEY.replace("lines = 4", "lines = 0"), r"survey\.lines is 0"),
        ("a.toml", "speed_mps = 1.0", r"has 0 waypoints, expected at least 2, or a table \[survey\]"),
        ("a.json", '{"type": "Point", "coordinates": [1, 2]}', "no LineString"),
        ("a.gpx", "<gpx>", "malformed"),
        ("a.gpx", f"<gpx>{POINTS.replace('54', '99')}</gpx>", r"0\].lat_deg is 99.0, expected at most 89.0"),
    ],
)
def test_wrong_routes_are_refused_in_a_sentence(tmp_path, name, text, why):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=why) as refused:
        GeodeticRoute.load(tmp_path / name)
    assert str(refused.value).startswith(f"route {tmp_path / name}") and "\n" not in str(refused.value)


def test_places_in_metres_are_those_in_degrees(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text(ORIGIN + PLACES)
    route = GeodeticRoute.load(path)
    assert route.places[1] == pytest.approx(displaced(*HOME, 100.0, 0.0), abs=1e-12)
    assert route.speed.tolist() == [1.0, 0.8] and route.fence.holds(*displaced(*HOME, 50.0, 5.0))


def places(*corners):
    return [corner(*each).globe(None, "corner") for each in corners]


def test_a_fence_knows_inside_and_ahead():
    fence = Fence(places((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (50.0, 50.0), (0.0, 100.0)))
    inside, notch = places((50.0, 20.0), (50.0, 80.0))
    assert fence.holds(*inside) and not fence.holds(*notch)
    assert fence.trouble(*inside) == "" and fence.trouble(*notch) == "the fence is left"
    assert fence.trouble(*inside, 8.0, -math.pi / 2.0).startswith("the fence is about to be left")
    assert fence.trouble(*inside, 6.0, -math.pi / 2.0) == ""
    assert fence.trouble(*inside, math.nan, math.nan) == ""
    assert fence.is_crossed_by(*places((90.0, 80.0), (10.0, 80.0))) and not fence.is_crossed_by(
        *places((90.0, 20.0), (5.0, 5.0))
    )
    with pytest.raises(InputError, match="crosses itself between corners 0 and 2"):
        Fence(places((0.0, 0.0), (100.0, 100.0), (100.0, 0.0), (0.0, 100.0)))
    notched = [(-10.0, -10.0), (70.0, -10.0), (70.0, 70.0), (50.0, 70.0), (50.0, 30.0), (20.0, 30.0), (20.0, 70.0)]
    with pytest.raises(InputError, match="the leg to waypoint 3 crosses the fence"):
        square(SQUARE, fence=[*notched, (-10.0, 70.0)])


def test_a_survey_aboard_is_followed_round_its_corners():
    """The example route: one waypoint, then four lines with eight waypoints; the boat stays inside the fence."""
    mission = pilot_of(GeodeticRoute.load(EXAMPLES / "survey.toml"))[1].mission
    north, east = mission.route.north - mission.route.north[1], mission.route.east - mission.route.east[1]
    towards = math.radians(20.0)
    along = north * math.cos(towards) + east * math.sin(towards)
    assert list(along[1:]) == [pytest.approx(each, abs=0.2) for each in (0, 104, 104, 0, 0, 104, 104, 0)]
    assert mission.route.curves[2].before == pytest.approx(1.5 * 1.2 / math.radians(12.0), rel=0.01)
