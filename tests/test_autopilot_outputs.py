"""What outputs say of the autopilot: propellers, sentences, Signal K, columns; and the mission file."""

import json
import math

import polars as pl
import pytest

from steerway.core import InputError
from steerway.live.testing import (
    Deltas,
    Fence,
    GeodeticRoute,
    Guide,
    JsonLines,
    Order,
    PropellerCommands,
    SentenceOutput,
    State,
    TableFile,
    addresses,
)
from tests.desk import HOME, NOON, OTTER, SQUARE, Desk, corner, dock_all, square
from tests.recording_sink import RecordingSink


@pytest.fixture(scope="module")
def voyage(tmp_path_factory):
    """Ready, running, stopped; received by every output."""
    path = tmp_path_factory.mktemp("voyage") / "run.parquet"
    sinks = {name: RecordingSink() for name in ("propellers", "sentences", "deltas", "json")}
    outputs = [
        PropellerCommands(sinks["propellers"]),
        SentenceOutput(sinks["sentences"]),
        Deltas(sinks["deltas"]),
        JsonLines(sinks["json"]),
        TableFile(path),
    ]
    desk = Desk(square(boat=OTTER), outputs=outputs).until_ready()
    desk.sail(1.0)
    desk.start().sail(10.0)
    desk.autopilot.stop("enough")
    desk.sail(5.0)
    dock_all()
    return sinks, path, desk


def test_propeller_commands(voyage):
    lines = voyage[0]["propellers"].lines()
    assert [list(line) for line in lines] == [["time", "state", "port", "starboard"]] * len(lines)
    running = [line for line in lines if line["state"] == "running"]
    assert len(running) == pytest.approx(101, abs=2)
    assert all(-1.0 <= line[side] <= 1.0 for line in running for side in ("port", "starboard"))
    assert any(line["port"] > 0.1 for line in running)
    assert {line["port"] for line in lines if line["state"] in ("idle", "ready")} == {None}
    assert {(line["port"], line["starboard"]) for line in lines if line["state"] == "stopped"} == {(0.0, 0.0)}


def test_a_boat_handed_back_is_commanded_nothing():
    sinks = RecordingSink()
    PropellerCommands(sinks).tick(at_home(), None, Order(State.STOPPED, "enough", False))
    assert sinks.lines()[0]["port"] is None


def at_home(**more):
    desk = Desk(square())
    desk.sail(10.0)
    dock_all()
    return desk.service.latest.row._replace(**more)


def test_steering_sentences_are_valid_while_it_is_fit_to_steer():
    row = at_home()
    leg = Guide(square()).step(row)
    for state in State:
        valid = state not in (State.IDLE, State.STOPPED)
        apb, xte, rmb = SentenceOutput(None).sentences(row, leg, Order(state))[3:]
        assert (apb.startswith("$SWAPB,A,A,"), xte.startswith("$SWXTE,A,A,"), rmb[:8]) == (
            (True, True, "$SWRMB,A") if valid else (False, False, "$SWRMB,V")
        )


def test_signal_k_says_route_target_and_alarm(voyage):
    updates = [each["updates"][0] for each in voyage[0]["deltas"].lines()]
    values = [{each["path"]: each["value"] for each in update["values"]} for update in updates]
    running = next(each for each in values if each.get("steering.autopilot.state") == "route")
    course = "navigation.courseGreatCircle"
    assert abs(running[f"{course}.crossTrackError"]) < 5.0
    assert running[f"{course}.bearingTrackTrue"] == pytest.approx(0.0, abs=1e-6)
    assert running[f"{course}.nextPoint.position"]["latitude"] == pytest.approx(54.0 + 60.0 / 111_300.0, abs=1e-4)
    assert 0.0 <= running["steering.autopilot.target.headingTrue"] < 2.0 * math.pi
    alarms = [each["notifications.steering.autopilot"] for each in values if "notifications.steering.autopilot" in each]
    assert [(each["state"], each["message"]) for each in alarms] == [("alarm", "Autopilot stopped: enough")]
    stopped = {path: value for each in values for path, value in each.items()}  # as a server holds them
    assert stopped["steering.autopilot.state"] == "alarm"
    assert stopped["steering.autopilot.target.headingTrue"] is None and stopped[f"{course}.crossTrackError"] is None
    assert stopped["navigation.speedOverGround"] > 0.0


def test_rows_and_tables_tell_the_state(voyage):
    sinks, path, desk = voyage
    lines = sinks["json"].lines()
    frame = pl.read_parquet(path)
    for states, reasons in (
        ([line.get("state") for line in lines], [line.get("reason") for line in lines]),
        (frame["state"].to_list(), frame["reason"].to_list()),
    ):
        assert states[0] is None and states[-1] == "stopped" and reasons[-1] == "enough"
        assert [each for k, each in enumerate(states) if k and each != states[k - 1]] == [
            "idle", "ready", "running", "stopped",
        ]  # fmt: skip
        assert reasons[states.index("running") + 2] is None
    assert frame.height == len(lines) == desk.navigator.counts["used"]


def test_addresses_of_propellers(tmp_path):
    output, _ = addresses.output("udp://127.0.0.1:1234?format=propellers")
    assert isinstance(output, PropellerCommands)
    assert isinstance(addresses.output("stdout:?format=propellers")[0], PropellerCommands)
    assert isinstance(addresses.output("stdout:")[0], JsonLines)
    assert isinstance(addresses.output("udp://127.0.0.1:1234?format=json")[0], JsonLines)
    with pytest.raises(InputError, match="option 'period' is unknown, expected format"):
        addresses.output("udp://127.0.0.1:1234?format=json&period=1")
    with pytest.raises(InputError, match="format is 'hello', expected one of nmea, json, propellers"):
        addresses.output("udp://127.0.0.1:1234?format=hello")


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
    assert route.lookahead == 12.0 and route.safe == "hand-back" and route.limits.max_sog_mps == 2.0
    assert route.boat.reverse and route.boat.top_speed_mps == 3.0
    assert route.fence.holds(*HOME) and not route.fence.holds(math.radians(54.2), HOME[1])


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("[boat]", "[boats]", "unknown key boats, expected perhaps boat"),
        ("speed_mps = 0.8", "speed_mps = nan", r"waypoint\[1\].speed_mps is nan, expected a finite number"),
        ("lat_deg = 54.1", "lat_deg = 53.95", "waypoint 0 lies outside of the fence"),
        (", { lat_deg = 54.1, lon_deg = 10.0 }", "", "the fence has 2 corners, expected at least 3"),
    ],
)
def test_a_wrong_mission_is_refused_in_a_sentence(tmp_path, old, new, why):
    path = tmp_path / "m.toml"
    assert old in MISSION
    path.write_text(MISSION.replace(old, new))
    with pytest.raises(InputError, match=why) as refused:
        GeodeticRoute.load(path)
    assert str(refused.value).startswith(f"route {path}: ") and "\n" not in str(refused.value)


def test_a_fence_in_geojson(tmp_path):
    path = tmp_path / "m.geojson"
    line = {"type": "LineString", "coordinates": [[10.0, 54.0], [10.01, 54.0]]}
    ring = {"type": "Polygon", "coordinates": [[[9.9, 53.9], [10.1, 53.9], [10.1, 54.1], [9.9, 54.1], [9.9, 53.9]]]}
    features = [{"type": "Feature", "properties": {}, "geometry": each} for each in (ring, line)]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    route = GeodeticRoute.load(path)
    assert len(route.latitude) == 2 and route.fence.holds(*HOME)
    ring["coordinates"].append([[9.95, 53.95], [10.05, 53.95], [10.0, 54.05]])
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    with pytest.raises(InputError, match="the fence has holes"):
        GeodeticRoute.load(path)


def places(*corners):
    return [corner(*each).place for each in corners]


def test_a_fence_knows_inside_and_ahead():
    fence = Fence(places((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (50.0, 50.0), (0.0, 100.0)))
    inside, notch = places((50.0, 20.0), (50.0, 80.0))
    assert fence.holds(*inside) and not fence.holds(*notch)
    assert fence.trouble(*inside) == "" and fence.trouble(*notch) == "the fence is left"
    assert fence.trouble(*inside, 8.0, -math.pi / 2.0).startswith("the fence is about to be left")
    assert fence.trouble(*inside, 6.0, -math.pi / 2.0) == ""
    assert fence.trouble(*inside, math.nan, math.nan) == ""
    assert fence.leg_leaves(*places((90.0, 80.0), (10.0, 80.0))) and not fence.leg_leaves(
        *places((90.0, 20.0), (5.0, 5.0))
    )
    with pytest.raises(InputError, match="crosses itself between corners 0 and 2"):
        Fence(places((0.0, 0.0), (100.0, 100.0), (100.0, 0.0), (0.0, 100.0)))


def test_a_leg_that_crosses_a_notch_is_refused():
    notched = (
        (-10.0, -10.0),
        (70.0, -10.0),
        (70.0, 70.0),
        (50.0, 70.0),
        (50.0, 30.0),
        (20.0, 30.0),
        (20.0, 70.0),
        (-10.0, 70.0),
    )
    with pytest.raises(InputError, match="the leg to waypoint 3 crosses the fence"):
        square(SQUARE, fence=notched)


def test_she_slows_down_before_the_end():
    guide = Guide(square(((0.0, 0.0), (60.0, 0.0))))
    asked = []
    for north in (10.0, 40.0, 50.0, 54.0):
        lat, lon = corner(north, 0.0).place
        asked.append(guide.step(at_home(time=NOON + north, latitude=lat, longitude=lon)).speed)
    assert asked[0] == asked[1] == 1.2 and 1.2 > asked[2] > asked[3] == pytest.approx(0.72)
