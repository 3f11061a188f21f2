"""Reasons why the autopilot does not steer, and its reaction to a lost operator or a boat off the route."""

import logging
import socket

import pytest

from steerway.core import InputError
from steerway.live import testing as live
from tests.desk import Desk, led, square
from tests.ports import free_port
from tests.square import OTTER


def afloat(on_stop="stop", **settings):
    limits = live.Limits(operator_lost=10.0)
    return Desk(square(limits=limits, on_stop=live.OnStop(operator=on_stop), **settings), current=0.3).start()


def test_signs_of_life_keep_her_going_and_the_skipper_takes_the_route_up_again():
    desk = afloat("hold")
    controls = live.Controls(desk.autopilot)
    for _ in range(6):
        desk.sail(4.0)
        controls.do("present", None, "a test")
    assert desk.order.state is live.State.RUNNING
    desk.until(lambda: desk.autopilot.guide.mode == "position", 20.0)
    controls.do("route", None, "a test")
    desk.sail(2.0)
    assert desk.order.state is live.State.RUNNING and desk.order.reason == ""


def test_handed_back_once_she_is_not_when_stopped_by_hand():
    desk = afloat("hand-back")
    desk.until(lambda: desk.order.state is live.State.STOPPED, 20.0)
    assert not desk.order.engaged
    desk.until(lambda: not desk.autopilot._obstacle)
    desk.autopilot.start()
    desk.sail(1.0)
    desk.autopilot.stop()
    desk.sail(0.1)
    assert desk.order.engaged


def test_a_boat_off_her_route_holds_or_begins_it_where_the_mission_says_so():
    desk = Desk(square(limits=live.Limits(cross_track=15.0), on_stop=live.OnStop(off_route="hold"))).start()
    desk.sail(2.0)
    led(desk.autopilot, desk.leg._replace(cross_track=-15.5))
    desk.until(lambda: desk.autopilot.guide.mode == "position", 2.0)
    assert desk.order.state is live.State.DEGRADED and "15.5 m off the leg" in desk.order.reason, desk.order
    far = tuple((north + 5000.0, east) for north, east in ((0.0, 0.0), (60.0, 0.0), (60.0, 60.0)))
    desk = Desk(square(far), engage=True, from_here=True)
    desk.sail(20.0)
    assert desk.order.state is live.State.RUNNING


def test_every_reason_is_logged_once_in_five_seconds_and_numbers_alone_are_no_news(caplog):
    desk = Desk(square())
    caplog.set_level(logging.INFO, "steerway.live")
    for now, state, reason in [
        (0.0, live.State.IDLE, "no position yet"),
        (1.0, live.State.IDLE, "the course is not known"),
        (4.0, live.State.IDLE, "no trouble for 0.1 s"),
        (5.5, live.State.IDLE, "no trouble for 1.6 s"),
        (12.0, live.State.IDLE, "no trouble for 8.1 s"),
        (12.1, live.State.READY, ""),
    ]:
        desk.service._say(live.Order(state, reason), now)
    assert [each for each in caplog.messages if each.startswith("autopilot")] == [
        "autopilot idle: no position yet",
        "autopilot idle: no trouble for 1.6 s",
        "autopilot ready",
    ]


def test_after_a_lost_link_is_back_the_reason_says_that_it_can_be_started():
    desk = Desk(square()).start()
    desk.autopilot.link("vehicle", False)
    desk.sail(1.0)
    assert desk.order.reason == "link vehicle is lost"
    desk.autopilot.link("vehicle", True)
    desk.sail(5.0)
    assert desk.order.reason == "link vehicle is lost; it is back, and the autopilot can be started again"
    desk.autopilot.start()
    desk.sail(1.0)
    assert desk.order.state is live.State.RUNNING


@pytest.mark.parametrize(
    ("key", "address", "package"),
    [
        ("from", "udp://{}", None),
        ("from", "mavlink:udpin:{}", "pymavlink"),
        ("missions", "udpin:{}", "pymavlink"),
        ("to", "tcp-server://{}", None),
        ("to", "foxglove://{}", "foxglove"),
        ("helm", "{}", "nicegui"),
    ],
)
def test_a_port_in_use_ends_with_a_sentence(key, address, package):
    if package:
        pytest.importorskip(package)
    kind = socket.SOCK_DGRAM if "udp" in address else socket.SOCK_STREAM
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind(("127.0.0.1", 0))
        if kind is socket.SOCK_STREAM:
            taken.listen()
        place = address.format(f"127.0.0.1:{taken.getsockname()[1]}")
        others = {"from": f"udp://127.0.0.1:{free_port(socket.SOCK_DGRAM)}", "mission": str(OTTER.mission)}
        with pytest.raises(InputError, match="the port is in use by another program, expected a free one"):
            live.build_service.launch(live.Settings(**others | {key: place}))
