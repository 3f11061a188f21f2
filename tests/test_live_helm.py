"""The helm page without a browser: access control, limits on connections, and the pipe to the service."""

import asyncio
import contextlib
import socket
import time
import urllib.request
from unittest import mock

import httpx
import pytest

from steerway.core import InputError
from steerway.live import testing as live
from tests import hastened
from tests.browser import helm_page
from tests.ports import free_port, under_way, until

TOKEN = "a long enough token"


def test_this_computer_needs_no_token_and_others_need_one():
    for text, found in (("localhost", ("localhost", 8080)), ("[::1]:9000", ("::1", 9000))):
        assert live.address(text) == live.Address(*found)
    for text in ("0.0.0.0:8080", "boat.local:80", "[::]:8080"):
        with pytest.raises(InputError, match="can be reached from other computers, expected a token"):
            live.address(text)
        assert live.address(text, TOKEN).token == TOKEN
    for text in ("", ":8080", "host:99999", "http://127.0.0.1:8080"):
        with pytest.raises(InputError, match="expected host:port"):
            live.address(text, TOKEN)


def test_a_token_is_long_enough_and_never_printed(tmp_path, monkeypatch):
    for token in ("short", "x" * 300, "a\nb" * 8):
        with pytest.raises(InputError) as refused:
            live.checked(token)
        assert token not in str(refused.value)
    monkeypatch.setenv("STEERWAY_HELM_TOKEN", TOKEN)
    assert live.address_token_of(None) == TOKEN
    (tmp_path / "token").write_text("another token\n")
    assert live.address_token_of(str(tmp_path / "token")) == "another token"
    with pytest.raises(InputError, match="cannot be read"):
        live.address_token_of(str(tmp_path / "none"))
    assert [name for name in live.Settings.model_fields if "token" in name] == ["helm_token_file", "control_token_file"]


def test_the_page_asks_for_nothing_else(monkeypatch):
    """The page's process can only send requests of `Controls`; this test lists all of them."""
    service, asked_for = live.Service(live.Navigator(), []), []
    monkeypatch.setattr(service.controls, "do", lambda *given: asked_for.append(given))
    helm = live.HelmPage(service, live.Address("127.0.0.1", 8080))
    for what in ("settings", "record", "stop"):
        helm._do(what, "/etc/passwd", "10.0.0.7")
    assert asked_for == [(what, "/etc/passwd", "the helm page") for what in ("settings", "record", "stop")]
    with pytest.raises(InputError) as refused:
        live.Controls().do("settings", None, "a test")
    named = str(refused.value).partition("expected one of ")[2].split(", ")
    steering = {"start", "stop", "hold-course", "adjust", "hold-position", "route", "leg", "dodge", "offset", "faster"}
    assert set(named) == steering | {"mob", "mob-over"}


# --- access control


async def _inside(scope, receive, send):
    """A substitute for the page that answers every request."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"inside"})


def asked(gate, method="GET", path="/", host="127.0.0.1:8080", **options):
    async def ask():
        transport = httpx.ASGITransport(gate, client=(options.pop("client", "10.0.0.7"), 5))
        async with httpx.AsyncClient(transport=transport, base_url=f"http://{host}") as client:
            return await client.request(method, path, **options)

    return hastened.run(ask())


def knocked(gate, headers):
    """The answer to a WebSocket."""
    kinds = []

    async def send(message):
        kinds.append(message["type"])

    raw = [(name.encode(), value.encode()) for name, value in headers.items()]
    scope = {"type": "websocket", "path": "/_nicegui_ws/socket.io/", "headers": raw, "scheme": "ws"}
    asyncio.run(gate(scope, None, send))
    return kinds


@pytest.fixture
def guarded():
    return live.Gate(_inside, live.Address("0.0.0.0", 8080, TOKEN))


HERE, BOAT = "127.0.0.1:8080", "boat.local:8080"
BOATS = {"origin": f"http://{BOAT}"}


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        *(
            (HERE, origin)
            for origin in (f"http://{HERE}", None, "null", "http://evil.example", "http://127.0.0.1:3000")
        ),
        *((host, f"http://{host}") for host in ("evil.example:8080", "192.168.1.4:8080", "127.0.0.1.evil.example")),
    ],
)
def test_only_the_page_itself_passes(host, origin):
    """Not another page, nor a foreign name for this computer; nothing is framed or loaded from elsewhere."""
    gate, headers = live.Gate(_inside, live.Address("127.0.0.1", 8080)), {} if origin is None else {"origin": origin}
    is_own = origin == f"http://{HERE}"
    assert asked(gate, "POST", host=host, headers=headers).status_code == (200 if is_own else 403)
    assert knocked(gate, {"host": host} | headers) == ["websocket.accept" if is_own else "websocket.close"]
    assert asked(gate, host=host, headers=headers).status_code == (200 if is_own or origin is None else 403)
    reply = asked(gate, host="localhost:9000")
    assert reply.text == "inside" and reply.headers["x-frame-options"] == "DENY"
    assert "default-src 'self'" in reply.headers["content-security-policy"]


@pytest.mark.parametrize("host", ["boat.example", "127.0.0.1:8080"])
def test_behind_a_tls_proxy_browsers_see_another_origin(host):
    """Some proxies pass on the host that browsers name, others their own name for the computer."""
    gate = live.Gate(_inside, live.address("127.0.0.1:8080", TOKEN, "https://boat.example"))
    here = {"origin": "https://boat.example"}
    reply = asked(gate, "POST", "/login", host, headers=here, data={"token": TOKEN})
    assert reply.status_code == 303 and "; secure" in reply.headers["set-cookie"].lower()
    kept = {"cookie": reply.headers["set-cookie"].partition(";")[0]}
    assert asked(gate, host=host, headers=kept).text == "inside"
    assert knocked(gate, {"host": host} | kept | here) == ["websocket.accept"]
    assert knocked(gate, {"host": host, "origin": "https://evil.example"} | kept) == ["websocket.close"]
    assert asked(gate, host="evil.example", headers=kept).status_code == 403
    with pytest.raises(InputError, match=r"'https://boat\.example' can be reached from other computers"):
        live.address("127.0.0.1:8080", None, "https://boat.example")
    with pytest.raises(InputError, match=r"helm-origin is 'boat\.example', expected the address for browsers"):
        live.address("127.0.0.1:8080", TOKEN, "boat.example")


def test_the_token_opens_and_without_it_there_is_only_the_login(guarded):
    assert asked(guarded, host=BOAT).headers["location"] == "/login"
    assert "token" in asked(guarded, path="/login", host=BOAT).text
    for method, path in (("GET", "/_nicegui/x.js"), ("POST", "/"), ("GET", "/_nicegui_ws/socket.io/?EIO=4")):
        assert asked(guarded, method, path, BOAT, headers=BOATS).status_code == 401
    for kept in ({}, {"cookie": f"{live.COOKIE}=9999999999.00"}):
        assert knocked(guarded, {"host": BOAT} | kept | BOATS) == ["websocket.close"]
    reply = asked(guarded, "POST", "/login", BOAT, headers=BOATS, data={"token": TOKEN})
    assert reply.status_code == 303 and reply.headers["location"] == "/"
    cookie = reply.headers["set-cookie"]
    assert "httponly" in cookie.lower() and "samesite=strict" in cookie.lower() and TOKEN not in cookie
    kept = {"cookie": cookie.partition(";")[0]}
    assert knocked(guarded, {"host": BOAT} | kept | BOATS) == ["websocket.accept"]
    assert knocked(guarded, {"host": BOAT, "origin": "http://evil.example"} | kept) == ["websocket.close"]
    for token, status in ((TOKEN, 200), ("another long token", 303)):  # nobody has to log in again after a restart
        gate = live.Gate(_inside, live.Address("0.0.0.0", 8080, token))
        assert asked(gate, host=BOAT, headers=kept).status_code == status


def test_a_wrong_token_costs_time(guarded):

    def login(token, client="10.0.0.7"):
        return asked(guarded, "POST", "/login", BOAT, headers=BOATS, data={"token": token}, client=client).status_code

    assert login("wrong") == 401 and login("") in (401, 429)

    async def many():
        transport = httpx.ASGITransport(guarded, client=("10.0.0.9", 5))
        async with httpx.AsyncClient(transport=transport, base_url="http://boat.local:8080", headers=BOATS) as client:
            tries = [client.post("/login", data={"token": each}) for each in ["a", "b", TOKEN]]
            return [reply.status_code for reply in await asyncio.gather(*tries)]

    assert sorted(hastened.run(many())) == [401, 429, 429]  # only one of simultaneous attempts is checked
    assert login("x" * 10000, "10.0.0.8") == 401
    assert asked(guarded, "GET", f"/login?token={TOKEN}", "boat.local:8080").status_code == 200  # a GET does not log in


def test_cookies_are_not_forged():
    sessions = live.Sessions(TOKEN)
    cookie = sessions.cookie()
    expiry, _, seal = cookie.partition(".")
    assert sessions.knows(cookie)
    for forged in ("", ".", "x.y", expiry, f"{int(expiry) + 1}.{seal}", f"{expiry}.{seal[:-1]}0x", "²." + seal):
        assert not sessions.knows(forged)
    with mock.patch("time.time", lambda: int(expiry) + 1.0):
        assert not sessions.knows(cookie)  # expired


def crowd(places, host, count):
    """(Connections of clients at this address, whether each was admitted)."""
    found = []
    for k in range(count):
        each = mock.Mock(client=(host, 1000 + k))
        each.get_extra_info.return_value = each.client
        each.is_closing.side_effect = lambda each=each: each.abort.called
        found.append(each)
    return found, [places.admit(each, 0.0) for each in found]


def test_idle_connections_are_closed_and_who_has_not_logged_in_gives_way():
    places = live.Places(idle=5.0, most=20, from_one=8)
    (busy, idle, asking), _ = crowd(places, "10.0.0.1", 3)
    places.begin(busy.client, True)
    places.begin(asking.client, False)
    places.end(asking.client, 3.0)
    for now, closed in ((5.1, (False, True, False)), (8.1, (False, True, True))):
        places.close_idle(now)
        assert tuple(each.abort.called for each in (busy, idle, asking)) == closed
    assert all(all(crowd(places, f"10.0.0.{other}", 4)[1]) for other in range(2, 12)) and len(places) == 20
    assert all(crowd(places, "10.0.0.13", 30)[1]) and len(places) <= 20 and not busy.abort.called
    places = live.Places(most=6, from_one=6)
    known, _ = crowd(places, "10.0.0.1", 6)
    for each in known:
        places.begin(each.client, True)
    assert crowd(places, "10.0.0.2", 1)[1] == [False] and not any(each.abort.called for each in known)


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


# --- the pipe to the service


def test_a_page_that_fails_is_begun_again(caplog):
    """Any failure of the page is logged, and the service goes on."""
    service = live.Service(live.Navigator(), [])
    service.latest = None
    helm = live.HelmPage(service, live.Address("127.0.0.1", 0))

    async def shown():
        async with under_way(helm.run()):
            await until(lambda: caplog.text.count("restarted") >= 2, 20.0)

    asyncio.run(shown())


def test_a_page_that_hangs_delays_nothing_and_misses_views(tmp_path, monkeypatch):
    """This page neither reads its input nor ends."""
    hung = tmp_path / "hung"
    hung.write_text("#!/bin/sh\nexec sleep 60\n")
    hung.chmod(0o700)
    monkeypatch.setattr(live.page_process.sys, "executable", str(hung))
    monkeypatch.setattr(live.page_process, "RATE", 1e4)
    send, sent = live.page_process._send, []
    monkeypatch.setattr(live.page_process, "_send", lambda *given: sent.append(send(*given)))
    helm = live.HelmPage(live.Service(live.Navigator(), []), live.Address("127.0.0.1", 0))

    async def shown():
        running, longest, before = asyncio.create_task(helm.run()), 0.0, -1
        while len(sent) != before or not sent:
            before, loop = len(sent), asyncio.get_running_loop()
            begun = loop.time()
            await asyncio.sleep(0.1)
            longest = max(longest, loop.time() - begun)
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
        return longest

    assert asyncio.run(shown()) < 1.0 and 50 < len(sent) < 1000
