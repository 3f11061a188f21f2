"""Why the autopilot does not steer: every reason is logged, far routes are asked for, ports in use are said."""

import logging
import socket

import pytest

from steerway.core import InputError
from steerway.live.testing import Order, Settings, State, build_service
from tests.desk import Desk, square
from tests.ports import free_port
from tests.square import OTTER


def test_every_reason_is_logged_once_in_five_seconds_and_numbers_alone_are_no_news(caplog):
    desk = Desk(square())
    caplog.set_level(logging.INFO, "steerway.live")
    for now, state, reason in [
        (0.0, State.IDLE, "no position yet"),
        (1.0, State.IDLE, "the course is not known"),
        (4.0, State.IDLE, "no trouble for 0.1 s"),
        (5.5, State.IDLE, "no trouble for 1.6 s"),
        (12.0, State.IDLE, "no trouble for 8.1 s"),
        (12.1, State.READY, ""),
    ]:
        desk.service._say(Order(state, reason), now)
    assert [each for each in caplog.messages if each.startswith("autopilot")] == [
        "autopilot idle: no position yet",
        "autopilot idle: no trouble for 1.6 s",
        "autopilot ready",
    ]


def test_a_route_that_begins_far_away_is_not_begun_unless_asked_for():
    far = tuple((north + 5000.0, east) for north, east in ((0.0, 0.0), (60.0, 0.0), (60.0, 60.0)))
    desk = Desk(square(far), engage=True)
    desk.sail(20.0)
    assert desk.order.state is State.IDLE
    assert desk.order.reason == "the route begins 5.0 km away, expected at most 2 km, or --from-here"
    asked = Desk(square(far), engage=True, from_here=True)
    asked.sail(20.0)
    assert asked.order.state is State.RUNNING


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
    assert desk.order.state is State.RUNNING


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
            build_service.launch(Settings(**others | {key: place}))
