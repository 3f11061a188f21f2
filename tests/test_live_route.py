"""Steering sentences on a route: sides, bearings, arrival, and that nothing is said which is not known."""

import math
from pathlib import Path

import pytest

from steerway.core import OK, InputError
from steerway.core.testing import NAUTICAL_MILE, Leg, displaced
from steerway.formats.testing import apb, rmb, sealed, xte
from steerway.live.testing import GeodeticRoute, Guide, Row, SentenceOutput, lost, pilot_of

EXAMPLES = Path(__file__).parent.parent / "examples" / "live"
HOME = (math.radians(54.0), math.radians(10.0))
NOON = 1_719_835_200.0
STARBOARD = Leg(18.52, 0.0, math.radians(350.0), 1852.0, math.radians(-10.0), 2.0, *HOME, "WP0", "WP1")


def at(north, east, time=NOON, cog=0.0, sog=2.0):
    return Row(time, *displaced(*HOME, north, east), sog, cog, 0.0, 0.1, 0.02, 0.01, 0.3, 1.0, OK)


@pytest.fixture
def guide(tmp_path):
    path = tmp_path / "route.toml"
    points = [displaced(*HOME, *point) for point in ((0.0, 0.0), (200.0, 0.0), (200.0, 200.0))]
    tables = [
        f"[[waypoint]]\nlat_deg = {math.degrees(lat)!r}\nlon_deg = {math.degrees(lon)!r}\n" for lat, lon in points
    ]
    path.write_text("lookahead = 20.0\nacceptance = 5.0\n" + "".join(tables))
    return Guide(GeodeticRoute.load(path))


def test_the_letter_is_the_side_to_steer_to():
    assert xte(STARBOARD) == sealed("SWXTE,A,A,0.0100,L,N,A")
    assert xte(STARBOARD._replace(cross_track=-18.52)) == sealed("SWXTE,A,A,0.0100,R,N,A")
    assert apb(STARBOARD) == sealed("SWAPB,A,A,0.0100,L,N,V,V,0.00,T,WP1,350.00,T,350.00,T,A")
    assert rmb(STARBOARD) == sealed("SWRMB,A,0.01,L,WP0,WP1,5400.0000000,N,01000.0000000,E,1.000,350.00,3.89,V,A")
    assert rmb(STARBOARD._replace(cross_track=-30.0 * NAUTICAL_MILE)).startswith("$SWRMB,A,9.99,R,")
    assert ",A,A,0.00,T," in apb(STARBOARD._replace(is_arrived=True, is_passed=True))


def test_what_is_not_valid_says_nothing():
    assert xte(STARBOARD, valid=False) == sealed("SWXTE,V,V,,,N,N")
    assert apb(STARBOARD, valid=False) == sealed("SWAPB,V,V,,,N,V,V,,T,WP1,,T,,T,N")
    assert rmb(STARBOARD._replace(cross_track=math.nan)).startswith("$SWRMB,V,,,WP0,WP1,5400")


def test_a_boat_is_led_back_to_the_line(guide):
    leg = guide.step(at(50.0, 10.0))
    assert leg.cross_track == pytest.approx(10.0, abs=1e-3) and leg.direction == pytest.approx(0.0, abs=1e-6)
    assert leg.course_to_steer == pytest.approx(-math.atan(0.5), abs=1e-4)
    assert leg.distance == pytest.approx(math.hypot(150.0, 10.0), abs=1e-2)
    assert leg.closing_speed == pytest.approx(2.0 * math.cos(math.atan2(10.0, 150.0)), abs=1e-4)
    assert math.degrees(leg.latitude) == pytest.approx(54.0 + 200.0 / 111_300.0, abs=1e-4)


def test_the_route_is_sailed_to_its_end(guide):
    legs = [guide.step(at(float(k), 0.0, NOON + k)) for k in range(0, 210, 2)]
    assert (legs[0].destination, legs[-1].destination) == ("WP1", "WP2")
    assert legs[-1].direction == pytest.approx(math.pi / 2.0, abs=1e-6)
    legs = [guide.step(at(200.0, float(k), NOON + 300.0 + k, cog=math.pi / 2.0)) for k in range(0, 210, 2)]
    assert guide.finished and legs[-1] is None
    assert any(leg is not None and leg.is_arrived for leg in legs)


def test_sentences_on_a_route(guide):
    row = at(50.0, 10.0)
    output = SentenceOutput(None).sentences(row, guide.step(row))
    assert [sentence[3:6] for sentence in output] == ["RMC", "VTG", "ROT", "APB", "XTE", "RMB"]
    assert ",L,N," in output[4]
    blind = SentenceOutput(None).sentences(lost(NOON), guide.step(lost(NOON)))
    assert all(",V," in sentence for sentence in (*blind[3:], blind[0]))
    drifting = SentenceOutput(None).sentences(row._replace(cog=math.nan), guide.step(row._replace(cog=math.nan)))
    assert drifting[3].startswith("$SWAPB,V,V,") and drifting[0].startswith("$SWRMC,120000.000,A")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("r.gpx", '<gpx xmlns="http://www.topografix.com/GPX/1/1"><rte><rtept lat="54" lon="10"/>'
                  '<rtept lat="54.01" lon="10.01"/></rte></gpx>'),
        ("r.geojson", '{"type": "Feature", "geometry": {"type": "LineString",'
                      '"coordinates": [[10, 54], [10.01, 54.01]]}}'),
    ],
)  # fmt: skip
def test_routes_of_other_programs(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    route = GeodeticRoute.load(tmp_path / name)
    assert route.latitude.tolist() == [math.radians(54.0), math.radians(54.01)]
    assert route.longitude.tolist() == [math.radians(10.0), math.radians(10.01)]


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("a.kml", "", "ending"),
        ("a.toml", "[[waypoint]]\nlat_deg = 54.0\nlon_deg = 1.0", "has 1 waypoints"),
        ("a.toml", "sped_mps = 3", "unknown key sped_mps, expected perhaps speed_mps"),
        ("a.json", '{"type": "Point", "coordinates": [1, 2]}', "no LineString"),
        ("a.gpx", "<gpx>", "malformed"),
        (
            "a.gpx",
            "<gpx><rtept lat='99' lon='0'/><rtept lat='9' lon='0'/></gpx>",
            "0].lat_deg is 99.0, expected at most 89.0",
        ),
    ],
)
def test_wrong_routes_are_refused_in_a_sentence(tmp_path, name, text, why):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=why):
        GeodeticRoute.load(tmp_path / name)


def test_a_survey_aboard_is_followed_round_its_corners(tmp_path):
    """The example: a waypoint, then eight of four lines; its corners are curves, and the fence holds it."""
    text = (EXAMPLES / "survey.toml").read_text()
    path = tmp_path / "survey.toml"
    path.write_text(text)
    line = GeodeticRoute.load(path)
    mission = pilot_of(line).mission
    north, east = mission.route.north - mission.route.north[1], mission.route.east - mission.route.east[1]
    towards = math.radians(20.0)
    along = north * math.cos(towards) + east * math.sin(towards)
    assert list(along[1:]) == [pytest.approx(each, abs=0.2) for each in (0, 104, 104, 0, 0, 104, 104, 0)]
    assert mission.route.curves[2].before == pytest.approx(1.5 * 1.2 / math.radians(12.0), rel=0.01)
    path.write_text(text.replace("spacing = 25.0", "spacing = 90.0"))
    with pytest.raises(InputError, match="lies outside of the fence"):
        GeodeticRoute.load(path)
    path.write_text(text.replace("lines = 4", "lines = 0"))
    with pytest.raises(InputError, match=r"survey\.lines is 0"):
        GeodeticRoute.load(path)
    path.write_text("speed_mps = 1.0")
    with pytest.raises(InputError, match=r"has 0 waypoints, expected at least 2, or a table \[survey\]"):
        GeodeticRoute.load(path)
