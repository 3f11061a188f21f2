"""QGroundControl's files and mission items as missions; areas that the boat must not enter."""

import json
import math

import pytest

from steerway.core import InputError
from steerway.live.testing import GeodeticRoute, LimitGuard, Limits, MissionItem, NoGo, items_of, lost, mission_of

PLACES = [(54.0, 10.0), (54.001, 10.0), (54.001, 10.002)]


def simple(command, latitude=0.0, longitude=0.0, *parameters, frame=3):
    filled = [*parameters, *[0.0] * (4 - len(parameters))]
    return {"type": "SimpleItem", "command": command, "frame": frame, "params": [*filled, latitude, longitude, 0.0]}


def plan(items, polygons=(), rally=()):
    return {
        "fileType": "Plan",
        "mission": {"items": items, "plannedHomePosition": [54.0, 9.999, 0.0]},
        "geoFence": {"circles": [], "polygons": list(polygons), "version": 2},
        "rallyPoints": {"points": [list(each) for each in rally]},
        "version": 1,
    }


def loaded(tmp_path, text, name="route.plan"):
    path = tmp_path / name
    path.write_text(text if isinstance(text, str) else json.dumps(text))
    return GeodeticRoute.load(path)


def degrees(route):
    return [tuple(round(math.degrees(each), 7) for each in place) for place in route.places]


def test_a_plan_is_a_route_with_speeds_fence_rally_and_areas_not_to_enter(tmp_path):
    box = [[53.99, 9.99], [53.99, 10.01], [54.01, 10.01], [54.01, 9.99]]
    shoal = [[54.0001, 10.0014], [54.0001, 10.0018], [54.0002, 10.0018], [54.0002, 10.0014]]
    items = [simple(16, *PLACES[0]), simple(178, 0.0, 0.0, 1.0, 1.5), simple(16, *PLACES[1], 0.0, 3.0)]
    survey = {"type": "ComplexItem", "TransectStyleComplexItem": {"Items": [simple(16, *PLACES[2])]}}
    polygons = [{"inclusion": True, "polygon": box}, {"inclusion": False, "polygon": shoal}]
    route = loaded(tmp_path, plan([*items, survey, simple(20)], polygons, [(54.0002, 10.0, 0.0)]))
    assert degrees(route) == [*PLACES, (54.0, 9.999)]
    assert route.speed.tolist() == [1.0, 1.5, 1.5, 1.5] and route.acceptance.tolist() == [10.0, 3.0, 10.0, 10.0]
    assert route.fence is not None and len(route.no_go) == 1
    assert math.degrees(route.rally[0]) == pytest.approx(54.0002)


def test_a_file_of_waypoints_begins_with_home_and_may_loiter_at_its_end(tmp_path):
    lines = ["QGC WPL 110", "0 1 0 16 0 0 0 0 54.0 9.999 0 1"]
    lines += [
        f"{k} 0 3 {command} 0 0 0 0 {lat} {lon} 0 1"
        for k, command, (lat, lon) in zip((1, 2, 3), (16, 16, 17), PLACES, strict=True)
    ]
    route = loaded(tmp_path, "\n".join(lines).replace(" ", "\t").replace("QGC\tWPL\t110", "QGC WPL 110"), "a.waypoints")
    assert degrees(route) == PLACES and route.settings.at_end == "hold"


@pytest.mark.parametrize(
    ("items", "words"),
    [
        ([simple(16, *PLACES[0]), simple(22, *PLACES[1])], "item 1 has command 22 in frame 3, expected a waypoint"),
        ([simple(16, *PLACES[0], 5.0), simple(16, *PLACES[1])], "item 0 stays for 5 s, expected 0 s"),
        ([simple(17, *PLACES[0]), simple(16, *PLACES[1])], "item 1 follows one that loiters"),
        ([simple(16, *PLACES[0])], "has 1 waypoints, expected at least 2"),
    ],
)
def test_what_cannot_be_sailed_is_refused_by_its_item(tmp_path, items, words):
    with pytest.raises(InputError, match=words):
        loaded(tmp_path, plan(items))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.plan", "{}"),
        ("a.plan", "[]"),
        ("a.plan", "nonsense"),
        ("a.waypoints", "nonsense"),
        ("a.waypoints", "QGC WPL 110\n1 2"),
    ],
)
def test_damaged_files_are_refused_with_their_name(tmp_path, name, text):
    with pytest.raises(InputError, match=r"route .*a\.(plan|waypoints)"):
        loaded(tmp_path, text, name)


def test_items_of_a_route_are_the_route():
    places = [tuple(map(math.radians, each)) for each in PLACES]
    keys = mission_of(items_of(places, [1.0, 1.0, 1.5], "hold")[1:])
    assert keys["at_end"] == "hold"
    given = [round(each[key], 9) for each in keys["waypoint"] for key in ("lat_deg", "lon_deg")]
    assert given == [number for place in PLACES for number in place]
    assert [each["speed_mps"] for each in keys["waypoint"]] == [1.0, 1.0, 1.5]
    with pytest.raises(InputError, match="no home position"):
        mission_of([MissionItem(20, 0, (0.0,) * 4, 0.0, 0.0)])


def test_a_leg_through_an_area_is_refused_and_a_boat_stops_before_it(tmp_path):
    shoal = [[54.0003, 9.9996], [54.0003, 10.0004], [54.0006, 10.0004], [54.0006, 9.9996]]
    items = [simple(16, *each) for each in PLACES]
    with pytest.raises(InputError, match=r"the leg to waypoint 1 enters no_go\[0\]"):
        loaded(tmp_path, plan(items, [{"inclusion": False, "polygon": shoal}]))
    area = NoGo([tuple(map(math.radians, each)) for each in shoal], "no_go[0]")
    guard = LimitGuard(Limits(), None, no_go=[area])
    here = lost(0.0)._replace(latitude=math.radians(54.00025), longitude=math.radians(10.0), sog=1.0, cog=math.pi)
    assert guard.step(here, 0.0, False, 0.1) == ""
    assert guard.step(here._replace(sog=2.0, cog=0.0), 0.0, False, 0.1) == "no_go[0] is about to be entered, within 3 s"
    inside = here._replace(latitude=math.radians(54.0005))
    assert guard.step(inside, 0.0, False, 0.1) == "the boat is inside of no_go[0]"
