"""Missions by MAVLink's protocol and QGroundControl's files, changed under way; areas that the boat must not enter."""

import asyncio
import json
import math
import shutil
import signal
import socket
import subprocess

import pytest

from steerway.core import InputError, displacement
from steerway.core.testing import displaced
from steerway.live import testing as live
from tests import hastened
from tests.command_line import STEERWAY
from tests.desk import HOME, Desk, square
from tests.ports import free_port, running, under_way, wait_until
from tests.square import OTTER

pytest.importorskip("pymavlink", reason="pymavlink is not installed")
M = live.dialect("a test")
MAVPROXY = shutil.which("mavproxy.py")
ACCEPTED, DENIED, INVALID = M.MAV_MISSION_ACCEPTED, M.MAV_MISSION_DENIED, M.MAV_MISSION_INVALID


def degrees(north, east):
    return tuple(map(math.degrees, displaced(*HOME, north, east)))


def item(seq, command, north=0.0, east=0.0, *parameters):
    lat, lon = degrees(north, east)
    filled = [*parameters, *[0.0] * (4 - len(parameters))]
    return M.MAVLink_mission_item_int_message(
        1, 1, seq, 3, command, 0, 1, *filled, round(lat * 1e7), round(lon * 1e7), 0.0
    )


def items(*waypoints, speed=1.0):
    made = [item(0, 16), item(1, 178, 0.0, 0.0, 1.0, speed)]
    return [*made, *(item(k, 16, *each) for k, each in enumerate(waypoints, start=2))]


def sent(message):
    """As it arrives from a ground station."""
    codec = M.MAVLink(None, 255, 190)
    return M.MAVLink(None).parse_buffer(message.pack(codec))[0]


class Station:
    """A ground station that talks to a server without a link."""

    def __init__(self, desk):
        self.server = live.MissionServer(M, desk.autopilot, desk.service.controls)

    def ask(self, message, now=0.0):
        return self.server.receive(sent(message), now)

    def upload(self, mission):
        answers = self.ask(M.MAVLink_mission_count_message(1, 1, len(mission)))
        while answers and answers[0].get_type() == "MISSION_REQUEST_INT":
            answers = self.ask(mission[answers[0].seq])
        return answers

    def download(self):
        (count,) = self.ask(M.MAVLink_mission_request_list_message(1, 1))
        return [self.ask(M.MAVLink_mission_request_int_message(1, 1, k))[0] for k in range(count.count)]


def fields(message):
    numbers = message.param1, message.param2, message.x, message.y
    return message.seq, message.frame, message.command, *(round(each, 5) for each in numbers)


def test_a_mission_is_uploaded_and_downloaded_equal_before_it_that_of_the_file():
    station = Station(Desk(square(at_end="hold")).until_ready())
    found = station.download()
    assert [each.command for each in found] == [16, 178, 16, 16, 16, 16, 17]
    assert found[1].param2 == pytest.approx(1.2)
    last = displacement(math.radians(found[4].x * 1e-7), math.radians(found[4].y * 1e-7), *HOME)
    assert last == pytest.approx((60.0, 60.0), abs=0.02)
    mission = items((10.0, 0.0), (50.0, 0.0), (50.0, 40.0))
    assert [each.type for each in station.upload(mission)] == [ACCEPTED]
    assert [fields(each) for each in station.download()] == [fields(sent(each)) for each in mission]


def test_a_mission_changed_under_way_is_sailed_with_the_current_that_is_known():
    desk = Desk(square(), current=0.3).start()
    desk.sail(40.0)
    before = desk.autopilot.pilot.estimator.step(desk.rows[-1], 0.0)
    north, east = desk.state[6:8]
    mission = items((0.0, 0.0), (60.0, 0.0), (north, east - 40.0), (north - 40.0, east - 40.0))
    assert Station(desk).upload(mission)[0].type == ACCEPTED
    desk.sail(1.0)
    after = desk.autopilot.pilot.estimator.step(desk.rows[-1], 0.0)
    assert desk.order.state is live.State.RUNNING and after.knows_current
    assert math.hypot(after.current_north - before.current_north, after.current_east - before.current_east) < 0.1
    assert Station(desk).server.due(0.0)[1].seq in (3, 4)
    desk.until(lambda: desk.order.state not in live.UNDER_WAY, 200.0)
    assert desk.order.state is live.State.FINISHED and desk.order.engaged and desk.order.thrust == 0.0
    assert math.dist(desk.state[6:8], (north - 40.0, east - 40.0)) < 5.0  # its acceptance is 4 m


def test_what_cannot_be_sailed_is_refused_and_the_old_mission_kept(caplog):
    fence = ((-100.0, -100.0), (-100.0, 100.0), (100.0, 100.0), (100.0, -100.0))
    desk = Desk(square(fence=fence)).start()
    route = desk.autopilot.guide.route
    for mission, words in (
        ([item(0, 16), item(1, 16, 10.0, 0.0)], "has 1 waypoints"),
        ([item(0, 16), item(1, 16, 10.0), item(2, 22, 20.0)], "command 22"),
        (items((0.0, 0.0), (500.0, 0.0)), "outside of the fence"),
    ):
        ack, text = Station(desk).upload(mission)
        assert ack.type == INVALID and text.get_type() == "STATUSTEXT" and words in caplog.text
        assert desk.autopilot.guide.route is route
    desk.sail(1.0)
    assert desk.order.state is live.State.RUNNING


def test_a_ground_station_changes_the_speed_pauses_and_goes_on():
    desk = Desk(square()).start()
    station = Station(desk)

    def commanded(command, *parameters):
        filled = [*parameters, *[0.0] * (7 - len(parameters))]
        return station.ask(M.MAVLink_command_long_message(1, 1, command, 0, *filled))[0].result

    speeds = []
    for asked in (1.5, -1.0, 0.9, -2.0):
        assert commanded(M.MAV_CMD_DO_CHANGE_SPEED, 1.0, asked, -1.0) == M.MAV_RESULT_ACCEPTED
        desk.sail(0.1)
        speeds.append(desk.order.speed)
    assert speeds == pytest.approx([1.5, 1.5, 0.9, 1.2])
    assert commanded(M.MAV_CMD_DO_CHANGE_SPEED, 1.0, 9.0, -1.0) == M.MAV_RESULT_DENIED
    assert commanded(M.MAV_CMD_DO_CHANGE_SPEED, 1.0, -1.0, 50.0) == M.MAV_RESULT_DENIED
    assert commanded(M.MAV_CMD_DO_PAUSE_CONTINUE, 0.0) == M.MAV_RESULT_ACCEPTED
    assert desk.autopilot.guide.mode == "position"
    assert commanded(M.MAV_CMD_DO_PAUSE_CONTINUE, 1.0) == M.MAV_RESULT_ACCEPTED
    assert desk.autopilot.guide.mode == "route"
    assert commanded(M.MAV_CMD_NAV_TAKEOFF) == M.MAV_RESULT_UNSUPPORTED


def test_an_item_that_does_not_come_is_asked_for_again_and_one_that_is_no_waypoint_is_not_gone_on_to():
    station = Station(Desk(square()))
    station.ask(M.MAVLink_mission_count_message(1, 1, 3))
    kinds = [[each.get_type() for each in station.server.due(float(now))] for now in range(1, 8)]
    assert sum("MISSION_REQUEST_INT" in each for each in kinds) == 4
    assert sum("MISSION_ACK" in each for each in kinds) == 1
    desk = Desk(square()).start()
    station = Station(desk)
    station.ask(M.MAVLink_mission_set_current_message(1, 1, 4))
    desk.sail(1.0)
    assert desk.autopilot.guide.target == 2
    station.ask(M.MAVLink_mission_set_current_message(1, 1, 1))
    desk.sail(1.0)
    assert desk.autopilot.guide.target == 2
    assert station.ask(M.MAVLink_mission_clear_all_message(1, 1))[0].type == DENIED
    assert station.ask(M.MAVLink_mission_count_message(1, 1, 0))[0].type == DENIED
    assert station.ask(M.MAVLink_mission_request_list_message(1, 1, 1))[0].count == 0


@pytest.mark.parametrize(("ours", "theirs"), [(None, None), ("a", "a"), ("a", "b"), ("a", None)])
def test_over_udp_by_the_command_settings(tmp_path, ours, theirs):
    """Real bytes: a ground station on a socket, and the link as it runs; with a key by signed packets only."""
    port = free_port(socket.SOCK_DGRAM)
    desk = Desk(square())
    for name in "ab":
        (tmp_path / name).write_text(f"a long passphrase {name}")
    here, there = (
        live.addresses.ground_station(f"{via}:127.0.0.1:{port}", key and str(tmp_path / key))
        for via, key in (("udpin", ours), ("udpout", theirs))
    )
    link = live.MissionLink(here, desk.autopilot, desk.service.controls)
    mission, got = items((10.0, 0.0), (50.0, 0.0), (50.0, 40.0)), {}

    def hear(message):
        got[message.get_type()] = message
        if message.get_type() == "MISSION_REQUEST_INT":
            station.send([mission[message.seq]])
        return True

    station = live.MavlinkLink(there, hear, 255, 190)

    async def run():
        async with under_way(link.run(), station.run()):
            await asyncio.sleep(0.1)
            station.send([M.MAVLink_mission_count_message(1, 1, len(mission))])
            await asyncio.sleep(3.0)

    hastened.run(run())
    assert (link.link.broken > 0) == (ours != theirs)
    assert len(desk.autopilot.guide.route.places) == (3 if ours == theirs else 5)
    if ours == theirs:
        assert got["MISSION_ACK"].type == ACCEPTED and "HEARTBEAT" in got
    else:
        assert "MISSION_ACK" not in got


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
    return live.GeodeticRoute.load(path)


def degrees_of(route):
    return [tuple(round(math.degrees(each), 7) for each in place) for place in route.places]


def test_a_plan_is_a_route_with_speeds_fence_rally_and_areas_not_to_enter(tmp_path):
    box = [[53.99, 9.99], [53.99, 10.01], [54.01, 10.01], [54.01, 9.99]]
    shoal = [[54.0001, 10.0014], [54.0001, 10.0018], [54.0002, 10.0018], [54.0002, 10.0014]]
    items = [simple(16, *PLACES[0]), simple(178, 0.0, 0.0, 1.0, 1.5), simple(16, *PLACES[1], 0.0, 3.0)]
    survey = {"type": "ComplexItem", "TransectStyleComplexItem": {"Items": [simple(16, *PLACES[2])]}}
    polygons = [{"inclusion": True, "polygon": box}, {"inclusion": False, "polygon": shoal}]
    route = loaded(tmp_path, plan([*items, survey, simple(20, frame=2)], polygons, [(54.0002, 10.0, 0.0)]))
    assert degrees_of(route) == [*PLACES, (54.0, 9.999)]
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
    assert degrees_of(route) == PLACES and route.settings.at_end == "hold"


def test_a_leg_through_an_area_is_refused_and_a_boat_stops_before_it(tmp_path):
    shoal = [[54.0003, 9.9996], [54.0003, 10.0004], [54.0006, 10.0004], [54.0006, 9.9996]]
    items = [simple(16, *each) for each in PLACES]
    with pytest.raises(InputError, match=r"the leg to waypoint 1 enters no_go\[0\]"):
        loaded(tmp_path, plan(items, [{"inclusion": False, "polygon": shoal}]))
    area = live.NoGo([tuple(map(math.radians, each)) for each in shoal], "no_go[0]")
    guard = live.LimitGuard(live.Limits(), None, no_go=[area])
    here = live.lost(0.0)._replace(latitude=math.radians(54.00025), longitude=math.radians(10.0), sog=1.0, cog=math.pi)
    assert guard.step(here, 0.0, False, 0.1) == ""
    assert guard.step(here._replace(sog=2.0, cog=0.0), 0.0, False, 0.1) == "no_go[0] is about to be entered, within 3 s"
    inside = here._replace(latitude=math.radians(54.0005))
    assert guard.step(inside, 0.0, False, 0.1) == "the boat is inside of no_go[0]"


@pytest.mark.skipif(MAVPROXY is None, reason="MAVProxy is not installed: it is no part of the lock")
def test_mavproxy_uploads_a_mission_and_downloads_it_equal(tmp_path):
    """A separate program, at true pace; and the mission that is changed."""
    port, receiver = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_DGRAM)
    given, got, said = (tmp_path / name for name in ("given.waypoints", "got.waypoints", "said"))
    lines = ["QGC WPL 110", "0\t1\t0\t16\t0\t0\t0\t0\t63.44\t10.4\t0\t1"]
    lines += [f"{k}\t0\t3\t16\t0\t0\t0\t0\t{63.44 + 0.0001 * k:.4f}\t10.4003\t0\t1" for k in (1, 2, 3)]
    given.write_text("\n".join(lines) + "\n")
    command = [*STEERWAY, "live", "--from", f"udp://127.0.0.1:{receiver}", "--missions", f"udpin:127.0.0.1:{port}"]
    program = [MAVPROXY, f"--master=udpout:127.0.0.1:{port}", f"--aircraft={tmp_path / 'x'}"]
    stopped = {"ends": signal.SIGKILL, "stdin": subprocess.PIPE, "cwd": tmp_path, "text": True}  # it takes no SIGTERM
    with (
        open(tmp_path / "log", "w") as log,
        open(said, "w") as out,
        running(*command, "--mission", OTTER.mission, stderr=log),
        running(*program, stdout=out, **stopped) as station,
    ):
        wait_until(lambda: "online system 1" in said.read_text(), 60.0, 0.1)
        for k, way in enumerate((lines, [*lines[:-1], lines[-1].replace("63.4403", "63.4409")]), start=1):
            given.write_text("\n".join(way) + "\n")
            for order, answer in ((f"wp load {given}", "ACCEPTED"), (f"wp save {got}", f"Saved 4 waypoints to {got}")):
                station.stdin.write(order + "\n")
                station.stdin.flush()
                wait_until(lambda answer=answer, k=k: said.read_text().count(answer) >= k, 60.0, 0.1)
            assert _places(got) == _places(given)
    assert (tmp_path / "log").read_text().count("mission of 4 items taken") == 2


def _places(path):
    """Command, latitude and longitude of each item of a file."""
    columns = [line.split("\t") for line in path.read_text().splitlines()[1:]]
    return [(int(each[3]), round(float(each[8]), 6), round(float(each[9]), 6)) for each in columns]
