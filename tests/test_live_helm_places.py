"""Limits on connections to the page: idle ones lock nobody out, and clients with a login keep their connections."""

import contextlib
import socket
import time
import urllib.request

import pytest

from steerway.live.testing import Places
from tests.browser import helm_page
from tests.ports import free_port


class Transport:
    """A connection of a client."""

    def __init__(self, address, port):
        self._peer, self._closing = (address, port), False

    def get_extra_info(self, name):
        return self._peer

    def is_closing(self):
        return self._closing

    def abort(self):
        self._closing = True


def crowd(places, address, count, now=0.0, first=1000):
    found = [Transport(address, first + k) for k in range(count)]
    return found, [places.admit(each, now) for each in found]


def test_idle_connections_are_closed_and_those_with_requests_are_not():
    places = Places(idle=5.0)
    (busy, idle, asked), _ = crowd(places, "10.0.0.1", 3)
    places.begin(("10.0.0.1", 1000), True)
    places.begin(("10.0.0.1", 1002), False)
    places.end(("10.0.0.1", 1002), 3.0)
    places.close_idle(5.1)
    assert (busy.is_closing(), idle.is_closing(), asked.is_closing()) == (False, True, False)
    places.close_idle(8.1)
    assert asked.is_closing() and not busy.is_closing() and len(places) == 1


def test_who_has_not_logged_in_gives_way():
    places = Places(most=20, from_one=8)
    known, _ = crowd(places, "10.0.0.1", 4)
    for k in range(4):
        places.begin(("10.0.0.1", 1000 + k), True)
    for other in range(2, 12):
        assert all(crowd(places, f"10.0.0.{other}", 4)[1])
    assert not any(each.is_closing() for each in known) and len(places) == 20
    assert all(crowd(places, "10.0.0.9", 30, first=3000)[1]) and len(places) <= 20
    assert not any(each.is_closing() for each in known)


def test_when_all_have_logged_in_nobody_is_closed():
    places = Places(most=6, from_one=6)
    known, _ = crowd(places, "10.0.0.1", 6)
    for k in range(6):
        places.begin(("10.0.0.1", 1000 + k), True)
    assert crowd(places, "10.0.0.2", 1)[1] == [False] and not any(each.is_closing() for each in known)


def test_three_hundred_idle_connections_lock_nobody_out():
    pytest.importorskip("nicegui", reason="nicegui is not installed")
    page = free_port()
    with helm_page(page, "correct horse"), contextlib.ExitStack() as idle:
        for k in range(300):
            each = idle.enter_context(socket.socket())
            each.bind((f"127.0.0.{2 + k % 10}", 0))
            each.connect(("127.0.0.1", page))
            if k % 2:
                each.sendall(b"GET /login HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ")  # headers that never end
        begun = time.monotonic()
        with urllib.request.urlopen(f"http://127.0.0.1:{page}/login", timeout=3.0) as reply:
            assert reply.status == 200 and time.monotonic() - begun < 3.0
