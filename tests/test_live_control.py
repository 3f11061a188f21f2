"""Requests to a running service: hold a course or a position, change legs, set marks; and the control port."""

import asyncio
import contextlib
import json
import math

import pytest

from steerway.core import InputError, displacement, wrap
from steerway.core.testing import displaced
from steerway.live.testing import Address, ControlPort, Controls, Limits, State, Supervisor, control_address
from tests import hastened
from tests.desk import HOME, OTTER, SQUARE, Desk, square
from tests.ports import free_port, under_way

TOKEN = "a token for programs"


def holding_desk(corners=SQUARE, limits=None, at_end="stop", **settings):
    """A desk with a boat that can hold a position."""
    return Desk(square(corners, limits=limits, at_end=at_end), noise=0.2, **settings)


def asks(desk, what, value=None):
    desk.service.controls.do(what, value, "a test")


def test_a_course_is_held_and_adjusted_and_the_route_goes_on_from_any_leg():
    desk = holding_desk().start()
    desk.sail(5.0)
    asks(desk, "hold-course", math.radians(60.0))
    desk.sail(5.0)
    assert desk.order.state is State.RUNNING
    asks(desk, "adjust", math.radians(10.0))
    assert desk.service.controls.state()["target"] == pytest.approx(math.radians(70.0))
    desk.sail(20.0)
    errors = [abs(wrap(row.cog - math.radians(70.0))) for row in desk.rows[-500:]]
    assert sum(errors) / len(errors) < math.radians(4.0)
    asks(desk, "route")
    desk.sail(1.0)
    assert desk.leg.destination == "WP1" and desk.service.controls.state()["mode"] == "route"
    asks(desk, "leg", 3)
    desk.sail(0.5)
    assert desk.leg.destination == "WP3" and desk.order.state is State.RUNNING
    for leg in (0, 5, "2", True):
        with pytest.raises(InputError, match="expected 1 to 4"):
            asks(desk, "leg", leg)


def test_dodging_leads_off_the_leg_and_back_to_it():
    """While the boat dodges and returns, a cross-track error beyond the mission's limit does not stop it."""
    desk = holding_desk(((0.0, 0.0), (200.0, 0.0), (200.0, 60.0)), Limits(cross_track=12.0)).start()
    desk.sail(15.0)
    asks(desk, "dodge", math.radians(30.0))
    asks(desk, "dodge", math.radians(20.0))
    desk.sail(30.0)
    assert desk.service.controls.state()["dodging"]
    assert desk.service.controls.state()["target"] == pytest.approx(math.radians(50.0))
    assert desk.state[7] > 18.0 and desk.order.state is State.RUNNING
    asks(desk, "dodge", None)
    assert not desk.service.controls.state()["dodging"]
    desk.sail(45.0)
    assert desk.order.state is State.RUNNING and desk.leg.destination == "WP1" and abs(desk.state[7]) < 1.5
    asks(desk, "hold-position")
    with pytest.raises(InputError, match="the route is not followed"):
        asks(desk, "dodge", 0.1)


def test_the_boat_follows_the_route_from_beside_it():
    """Also after a corner; the leg shown is the shifted one, so its cross-track error is small."""
    desk = holding_desk(((0.0, 0.0), (80.0, 0.0), (80.0, 80.0)), current=0.3, limits=Limits(cross_track=12.0)).start()
    asks(desk, "offset", -4.0)
    assert desk.service.controls.state()["offset"] == -4.0
    desk.sail(45.0)
    assert desk.state[7] == pytest.approx(-4.0, abs=1.0) and abs(desk.leg.cross_track) < 1.0
    desk.until(lambda: desk.leg.destination == "WP2")
    desk.sail(25.0)
    assert desk.state[6] == pytest.approx(84.0, abs=1.0)
    destination = displacement(desk.leg.latitude, desk.leg.longitude, *HOME)
    assert destination == pytest.approx((84.0, 80.0), abs=0.01)
    asks(desk, "offset", None)
    desk.sail(25.0)
    assert desk.state[6] == pytest.approx(80.0, abs=1.0) and desk.order.state is State.RUNNING
    with pytest.raises(InputError, match="the offset is 7 m, expected at most 6 m"):
        asks(desk, "offset", 7.0)


def test_the_boat_goes_faster_and_slower_than_the_route_says():
    desk = holding_desk(((0.0, 0.0), (300.0, 0.0))).start()
    for by, speed in ((0.5, 1.7), (-0.8, 0.9), (None, 1.2)):
        asks(desk, "faster", by)
        desk.sail(25.0)
        mean = sum(row.sog for row in desk.rows[-250:]) / 250
        assert mean == pytest.approx(speed, abs=0.15) and desk.order.speed == pytest.approx(speed)
    for by, why in ((2.0, "is 3.20 m/s"), (-1.2, "is 0.00 m/s"), ("1", "a number in m/s")):
        with pytest.raises(InputError, match=why):
            asks(desk, "faster", by)


def from_place(desk, rows):
    place = desk.autopilot.guide.place
    return [math.hypot(*displacement(row.latitude, row.longitude, *place)) for row in rows]


@pytest.mark.parametrize(("by", "kind"), [("propellers", "pole-placement"), ("yaw-rate", "lqg")])
def test_a_position_is_held_by_thrust(by, kind):
    """In a current of 0.4 m/s, bow into the current. The limits of speed and cross-track error do not apply."""
    desk = holding_desk(by=by, kinds=(kind, "pi"), current=0.4, limits=Limits(min_sog_mps=0.6)).start()
    desk.sail(10.0)
    asks(desk, "hold-position")
    desk.sail(90.0)
    assert desk.order.state is State.RUNNING
    assert max(from_place(desk, desk.rows[-1500:])) < 5.0
    asks(desk, "route")
    desk.sail(20.0)
    assert desk.order.state is State.RUNNING and desk.rows[-1].sog > 0.6 and desk.leg.destination == "WP1"


def test_other_autopilots_are_led_round_a_circle_and_a_man_overboard_is_marked():
    """The course to steer leads clockwise about the position."""
    desk = holding_desk().start()
    asks(desk, "hold-position")
    guide, here = desk.autopilot.guide, desk.rows[-1]
    asks(desk, "mob")
    assert desk.service.controls.mark[1:] == (here.latitude, here.longitude)
    asks(desk, "mob-over")
    assert desk.service.controls.mark is None
    for bearing in (0.0, 2.0, -1.0):
        north, east = guide.radius * math.cos(bearing), guide.radius * math.sin(bearing)
        latitude, longitude = displaced(*guide.place, north, east)
        guide.row = here._replace(latitude=latitude, longitude=longitude)
        leg = guide.shown(guide.step(*displacement(latitude, longitude, *HOME), 0.0), guide.given_course)
        assert leg.is_held and leg.distance == pytest.approx(guide.radius, rel=1e-3)
        assert wrap(leg.course_to_steer - bearing) == pytest.approx(0.5 * math.pi, abs=0.01)


def test_the_end_of_a_route_is_held():
    desk = holding_desk(corners=((0.0, 0.0), (40.0, 0.0)), at_end="hold", current=0.4).start()
    desk.sail(100.0)
    assert desk.order.state is State.RUNNING and desk.service.controls.state()["mode"] == "position"
    assert displacement(*desk.autopilot.guide.place, *HOME) == pytest.approx((40.0, 0.0), abs=1e-6)
    assert max(from_place(desk, desk.rows[-1000:])) < 5.0


@pytest.mark.parametrize(("current", "stops"), [(0.0, True), (0.9, False)])
def test_a_boat_that_can_turns_on_the_spot_unless_the_current_carries_it_off(current, stops):
    """With compass and gyro, because at rest positions do not show the heading."""
    boat = OTTER.model_copy(update={"pivot_angle_deg": 60.0, "max_yaw_rate_dps": 30.0})
    desk = Desk(square(((0.0, 0.0), (50.0, 0.0), (50.0, 60.0)), boat=boat), current=current, seed=3)
    desk.alter(lambda row: row._replace(heading=wrap(desk.state[11]), yaw_rate=desk.state[5]))
    desk.start()
    desk.until(lambda: math.dist(desk.state[6:8], (50.0, 0.0)) < 8.0)
    closest, slowest, turned = 8.0, 2.0, False
    while math.dist(desk.state[6:8], (50.0, 0.0)) < 8.0:
        desk.sail(0.1)
        closest = min(closest, math.dist(desk.state[6:8], (50.0, 0.0)))
        slowest = min(slowest, math.hypot(*desk.state[:2]))
        turned |= desk.autopilot.pilot.spot_turn.turns
    assert desk.order.state is State.RUNNING and desk.leg.destination == "WP2"
    assert turned == stops
    assert not stops or (slowest < 0.3 and closest < 0.5)


def test_what_cannot_be_done_is_refused_in_a_sentence():
    desk = holding_desk()
    for what, value, why in (
        ("fly", None, "request is 'fly', expected one of start, stop"),
        ("adjust", 2.0, "adjustment is 115°, expected at most 90°"),
        ("hold-position", None, "the position is not known"),
    ):
        with pytest.raises(InputError, match=why):
            asks(desk, what, value)
    with pytest.raises(InputError, match="this run has no autopilot"):
        Controls().do("start", None, "a test")
    fence = ((-40.0, -3.0), (-40.0, 50.0), (70.0, 50.0), (70.0, -3.0))
    desk = Desk(square(((0.0, 0.0), (60.0, 0.0), (60.0, 10.0), (0.0, 10.0)), fence))
    for offset, why in (
        (-4.0, "waypoint 0 lies outside of the fence"),
        (4.0, "4 m to starboard, the leg to waypoint 2"),
    ):
        with pytest.raises(InputError, match=why):
            asks(desk, "offset", offset)
    assert desk.service.controls.state()["offset"] == 0.0


def at_port(conversation, controls=None):
    """The result of `conversation(port)` with an open control port."""

    async def run():
        port = free_port()
        address = Address("127.0.0.1", port, TOKEN)
        async with under_way(ControlPort(controls or Controls(Supervisor(square())), address).run()):
            await asyncio.sleep(0.1)
            return await conversation(port)

    return hastened.run(run())


async def talk(port, *lines):
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    for line in lines:
        writer.write(line if isinstance(line, bytes) else json.dumps(line).encode() + b"\n")
    answers = []
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(1.3):
            while line := await reader.readline():
                answers.append(json.loads(line))
    writer.close()
    return answers


KNOWN, STOP = {"token": TOKEN}, {"id": 1, "do": "stop"}


def test_the_port_answers_who_knows_the_token_and_sends_the_state():
    controls = Controls(Supervisor(square()))
    requests = {"id": 1, "do": "hold-course", "value": 0.1}, {"id": 2, "do": "start"}, [1]
    strangers = ({"token": "another"}, STOP), (STOP,), (b"x" * 9000 + b"\n",), (KNOWN, b"no json\n", STOP)

    async def converse(port):
        return await asyncio.gather(*(talk(port, *lines) for lines in ((KNOWN, *requests), *strangers)))

    known, *others = at_port(converse, controls)
    assert [each for each in known if "id" in each] == [
        {"id": 1, "ok": True},
        {"id": 2, "error": "the autopilot cannot be started: no position yet"},
    ]
    assert sum("state" in each for each in known) >= 2 and controls.state()["target"] == 0.1
    assert not any("ok" in answer for answers in others for answer in answers)


@pytest.mark.parametrize(("count", "seconds"), [(30, 30.0), (40, 0.0)], ids=["silent", "again and again"])
def test_strangers_at_the_port_do_not_keep_others_out(count, seconds):
    async def converse(port):
        strangers = [await asyncio.open_connection("127.0.0.1", port) for _ in range(count)]
        await asyncio.sleep(seconds)
        answers = await talk(port, KNOWN, STOP)
        for _, writer in strangers:
            writer.close()
        return answers

    assert {"id": 1, "ok": True} in at_port(converse)


def test_deep_json_and_a_client_that_does_not_read_end_their_connection_to_the_port_only(caplog):
    deep = b'{"token": ' + b"[" * 4000 + b"\n"
    request = json.dumps({"id": "x" * 3000, "do": "stop"}).encode() + b"\n"

    async def converse(port):
        assert await talk(port, deep) == []
        assert not any("id" in each for each in await talk(port, KNOWN, deep))
        _, writer = await asyncio.open_connection("127.0.0.1", port, limit=1024)
        writer.transport.pause_reading()
        writer.write(json.dumps(KNOWN).encode() + b"\n")
        with pytest.raises(ConnectionError):
            for _ in range(20_000):
                writer.write(request)
                await writer.drain()
        return await talk(port, KNOWN, STOP)

    assert {"id": 1, "ok": True} in at_port(converse)
    assert not [each for each in caplog.records if each.exc_info]


def test_only_this_computer_and_with_a_token_that_is_secret(tmp_path, monkeypatch, caplog):
    monkeypatch.delenv("STEERWAY_CONTROL_TOKEN", raising=False)
    (tmp_path / "token").write_text(TOKEN)
    found = control_address("127.0.0.1:10120", str(tmp_path / "token"))
    assert found == Address("127.0.0.1", 10120, TOKEN)
    with pytest.raises(InputError, match="expected host:port on this computer"):
        control_address("0.0.0.0:10120", str(tmp_path / "token"))
    with pytest.raises(InputError, match="expected a token"):
        control_address("127.0.0.1:10120", None)
    for mode, warned in ((0o644, True), (0o640, True), (0o600, False)):
        caplog.clear()
        (tmp_path / "token").chmod(mode)
        control_address("127.0.0.1:10120", str(tmp_path / "token"))
        assert (f"other users can read it (mode {mode:o})" in caplog.text) == warned
    (tmp_path / "token").write_text("short")
    with pytest.raises(InputError, match="control's token has 5 characters"):
        control_address("127.0.0.1:10120", str(tmp_path / "token"))
