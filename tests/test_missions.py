"""Missions by MAVLink's protocol: uploaded, downloaded equal, changed under way with what is learned of the current."""

import asyncio
import math
import socket

import pytest

from steerway.core import InputError, displacement
from steerway.core.testing import displaced
from steerway.live.testing import MissionLink, MissionServer, Settings, State, addresses, build_service, dialect, key_of
from tests import hastened
from tests.desk import HOME, Desk, square
from tests.mavlink_wire import signed
from tests.ports import free_port, until

pytest.importorskip("pymavlink", reason="pymavlink is not installed")
M = dialect("a test")
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

    def __init__(self, routed):
        self.server = MissionServer(M, routed)

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
    return tuple(
        round(each, 5) if isinstance(each, float) else each
        for each in (message.seq, message.frame, message.command, message.param1, message.param2, message.x, message.y)
    )


def test_a_mission_is_uploaded_and_downloaded_equal():
    station = Station(Desk(square()).until_ready().autopilot)
    mission = items((10.0, 0.0), (50.0, 0.0), (50.0, 40.0))
    assert [each.type for each in station.upload(mission)] == [ACCEPTED]
    assert [fields(each) for each in station.download()] == [fields(sent(each)) for each in mission]


def test_before_an_upload_the_mission_of_the_file_is_downloaded():
    desk = Desk(square())
    found = Station(desk.autopilot).download()
    assert [each.command for each in found] == [16, 178, 16, 16, 16, 16, 16]
    last = displacement(math.radians(found[4].x * 1e-7), math.radians(found[4].y * 1e-7), *HOME)
    assert last == pytest.approx((60.0, 60.0), abs=0.02)


def test_a_mission_changed_under_way_is_sailed_with_the_current_that_is_known():
    desk = Desk(square(), current=0.3).start()
    desk.sail(40.0)
    before = desk.autopilot.pilot.estimator.step(desk.rows[-1], 0.0)
    north, east = desk.state[6:8]
    mission = items((0.0, 0.0), (60.0, 0.0), (north, east - 40.0), (north - 40.0, east - 40.0))
    assert Station(desk.autopilot).upload(mission)[0].type == ACCEPTED
    desk.sail(1.0)
    after = desk.autopilot.pilot.estimator.step(desk.rows[-1], 0.0)
    assert desk.order.state is State.RUNNING and after.knows_current
    assert math.hypot(after.current_north - before.current_north, after.current_east - before.current_east) < 0.1
    assert Station(desk.autopilot).server.due(0.0)[1].seq in (3, 4)
    desk.until(lambda: desk.order.state is State.STOPPED, 200.0)
    assert desk.order.reason == "the route is finished"
    assert math.dist(desk.state[6:8], (north - 40.0, east - 40.0)) < 5.0  # its acceptance is 4 m


@pytest.mark.parametrize(
    ("mission", "words"),
    [
        ([item(0, 16), item(1, 16, 10.0, 0.0)], "has 1 waypoints"),
        ([item(0, 16), item(1, 16, 10.0), item(2, 22, 20.0)], "command 22"),
        (items((0.0, 0.0), (500.0, 0.0)), "outside of the fence"),
    ],
)
def test_what_cannot_be_sailed_is_refused_and_the_old_mission_kept(mission, words, caplog):
    fence = ((-100.0, -100.0), (-100.0, 100.0), (100.0, 100.0), (100.0, -100.0))
    desk = Desk(square(fence=fence)).start()
    route = desk.autopilot.guide.route
    ack, text = Station(desk.autopilot).upload(mission)
    assert ack.type == INVALID and text.get_type() == "STATUSTEXT" and words in caplog.text
    assert desk.autopilot.guide.route is route
    desk.sail(1.0)
    assert desk.order.state is State.RUNNING


def test_an_item_is_gone_on_to_and_one_that_is_no_waypoint_is_not():
    desk = Desk(square()).start()
    station = Station(desk.autopilot)
    station.ask(M.MAVLink_mission_set_current_message(1, 1, 4))
    desk.sail(1.0)
    assert desk.autopilot.guide.target == 2
    station.ask(M.MAVLink_mission_set_current_message(1, 1, 1))
    desk.sail(1.0)
    assert desk.autopilot.guide.target == 2
    assert station.ask(M.MAVLink_mission_clear_all_message(1, 1))[0].type == DENIED
    assert station.ask(M.MAVLink_mission_count_message(1, 1, 0))[0].type == DENIED
    assert station.ask(M.MAVLink_mission_request_list_message(1, 1, 1))[0].count == 0


def test_an_item_that_does_not_come_is_asked_for_again_and_then_no_more():
    station = Station(Desk(square()).autopilot)
    station.ask(M.MAVLink_mission_count_message(1, 1, 3))
    kinds = [[each.get_type() for each in station.server.due(float(now))] for now in range(1, 8)]
    assert sum("MISSION_REQUEST_INT" in each for each in kinds) == 4
    assert sum("MISSION_ACK" in each for each in kinds) == 1


@pytest.mark.parametrize(("ours", "theirs"), [(None, None), ("a", "a"), ("a", "b"), ("a", None)])
def test_over_udp_by_the_command_settings(tmp_path, ours, theirs):
    """Real bytes: a ground station on a socket, and the link as it runs; with a key by signed packets only."""
    port = free_port(socket.SOCK_DGRAM)
    desk = Desk(square())
    for name in "ab":
        (tmp_path / name).write_text(f"a long passphrase {name}")
    address = addresses.ground_station(f"udpin:127.0.0.1:{port}", ours and str(tmp_path / ours))
    link = MissionLink(address, desk.autopilot)
    mission, got = items((10.0, 0.0), (50.0, 0.0), (50.0, 40.0)), []
    codec = M.MAVLink(None, 255, 190)
    if theirs:
        signed(codec, key_of(str(tmp_path / theirs)))

    async def run():
        running = asyncio.create_task(link.run())
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
            station.setblocking(False)
            station.connect(("127.0.0.1", port))

            def hear():
                try:
                    while True:
                        for message in codec.parse_buffer(station.recv(4096)) or ():
                            got.append(message)
                            if message.get_type() == "MISSION_REQUEST_INT":
                                station.send(mission[message.seq].pack(codec))
                except BlockingIOError:
                    return any(each.get_type() == "MISSION_ACK" for each in got)

            await asyncio.sleep(0.1)
            station.send(M.MAVLink_mission_count_message(1, 1, len(mission)).pack(codec))
            if ours == theirs:
                await until(hear, 5.0)
            else:
                await asyncio.sleep(3.0)
                assert not hear()
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    hastened.run(run())
    assert (link.link.broken > 0) == (ours != theirs)
    if ours != theirs:
        assert len(desk.autopilot.guide.route.places) == 5
        return
    assert next(each for each in got if each.get_type() == "MISSION_ACK").type == ACCEPTED
    assert any(each.get_type() == "HEARTBEAT" for each in got)
    assert len(desk.autopilot.guide.route.places) == 3


def test_without_a_mission_file_there_is_nothing_to_change():
    settings = Settings(**{"from": ["udp://:10110"], "missions": "udpin:127.0.0.1:14560"})
    with pytest.raises(InputError, match="--missions changes the route"):
        build_service.launch(settings)
