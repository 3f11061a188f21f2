"""The helm page without a browser: its view, its drawings, access control, and the pipe to the service."""

import asyncio
import importlib.util
import json
import math
import xml.etree.ElementTree as ElementTree
from types import SimpleNamespace
from unittest import mock

import httpx
import numpy as np
import pytest

from steerway.core import OK, REJECTED, InputError
from steerway.core.testing import KNOT, LOST, PREDICTED, Leg
from steerway.live.testing import (
    COOKIE,
    UNKNOWN,
    Address,
    ChartPlane,
    Controls,
    Gate,
    GeodeticRoute,
    HelmPage,
    History,
    Navigator,
    Order,
    PropellerCommands,
    Row,
    SentenceOutput,
    Service,
    Sessions,
    Settings,
    State,
    Supervisor,
    View,
    address,
    chart,
    checked,
    ellipse,
    lost,
    page_process,
    tone,
    view,
    words,
)
from steerway.live.testing import address_token_of as token_of
from tests import hastened
from tests.ports import under_way, until

NOON = 1_719_835_200.0
PLACE = (math.radians(54.0), math.radians(10.0))
ROW = Row(NOON, *PLACE, 2.0, -math.pi / 2.0, math.radians(-1.0), 0.1, 0.02, 0.01, 0.3, 0.3, math.nan, PREDICTED)
FIX = ROW._replace(time=NOON - 0.2, nis=1.2, status=OK)
LEG = Leg(-3.0, 0.0, 0.1, 40.0, 0.2, 1.5, *PLACE, "WP0", "WP1")
ORDER = Order(State.RUNNING, "", True, 0.1, 0.5, 0.6, 0.4, 0.2, 2.0)
ROUTE = GeodeticRoute(np.radians([54.0, 54.001, 54.001]), np.radians([10.0, 10.0, 10.002]))
TOKEN = "a long enough token"


# --- the view


def known(row=ROW, leg=LEG, fix=FIX):
    """A service in this state."""
    navigator = SimpleNamespace(last_fix=fix, position_covariance=(4.0, 0.0, 1.0), counts={"taken": 7, "late": 1})
    navigator.choice = SimpleNamespace(present="GP")
    latest, controls = SimpleNamespace(row=row, leg=leg, order=ORDER), Controls()
    return SimpleNamespace(navigator=navigator, latest=latest, controls=controls, unreachable=lambda: "")


def test_a_view_is_in_the_skippers_units():
    shown = view(known(), ChartPlane.of(ROUTE))
    assert shown.sog_kn == pytest.approx(2.0 / KNOT) and shown.sog_within_kn == pytest.approx(0.196 / KNOT, rel=1e-3)
    assert shown.cog_deg == pytest.approx(270.0) and shown.cog_within_deg == pytest.approx(2.246, rel=1e-3)
    assert shown.rate_dps == pytest.approx(-1.0) and shown.age == pytest.approx(0.2) and shown.nis == 1.2
    assert (shown.north, shown.east) == pytest.approx((0.0, 0.0))
    assert shown.cross_track == -3.0 and shown.target == 1 and shown.steer_deg == pytest.approx(math.degrees(0.2))
    assert shown.left == pytest.approx(40.0 + math.dist(*ChartPlane.of(ROUTE).route[1:]), rel=1e-9)
    assert (shown.state, shown.is_engaged, shown.thrust) == ("running", True, 0.5)
    shown = view(known(leg=None), ChartPlane.of(ROUTE))
    assert (shown.done, shown.left, shown.target) == (1.0, 0.0, None), "a finished route"


def test_what_is_unknown_is_none_and_a_dash():
    shown = view(Service(Navigator(), []), ChartPlane())
    assert {name: value for name, value in shown._asdict().items() if value} == {"status": "lost"}
    output = words(shown)
    assert {output[name] for name in ("sog", "cog", "rate", "age", "nis", "cross_track", "distance")} == {UNKNOWN}
    assert tone(shown) == "bad" and "nan" not in json.dumps([shown._asdict(), output]).lower()


def test_the_status_between_fixes_is_that_of_the_last_one_until_it_is_old():
    for status, gap, expected in ((OK, 0.2, "ok"), (REJECTED, 0.2, "rejected"), (OK, 5.0, "predicted")):
        shown = view(known(fix=FIX._replace(time=NOON - gap, status=status)), ChartPlane())
        assert shown.status == expected
    assert view(known(row=lost(NOON)), ChartPlane()).status == "lost" and LOST == lost(NOON).status


def test_words_name_the_side():
    output = words(view(known(), ChartPlane.of(ROUTE)))
    assert (output["cog"], output["rate"], output["cross_track"]) == ("270°", "1.0", "3.0 m")
    assert output["rate_within"].startswith("port ±") and output["cross_track_side"] == "to port of track"
    assert words(View(sog_kn=3.456, sog_within_kn=0.3))["sog"] == "3.5"
    assert words(View(sog_kn=3.456, sog_within_kn=0.05))["sog"] == "3.46"
    assert words(View(rate_dps=2.0))["rate_within"] == "stbd" and words(View(cog_deg=359.7))["cog"] == "000°"
    assert words(View(cross_track=2.0))["cross_track_side"] == "to starboard of track"
    assert words(View(lat_deg=-54.25, lon_deg=9.999))["position"] == "54° 15.000′ S  009° 59.940′ E"
    assert words(View(is_engaged=False, thrust=0.0))["thrust"] == UNKNOWN


def test_why_no_order_reaches_the_boat():
    deaf, heard = SimpleNamespace(has_peer=False), SimpleNamespace(has_peer=True)
    for outputs, why in (
        ((), "no output carries orders"),
        ((PropellerCommands(deaf), SentenceOutput(heard)), "no motor driver is connected"),
        ((PropellerCommands(deaf), PropellerCommands(heard)), ""),
        ((SentenceOutput(deaf),), "no receiver of the sentences is connected"),
        ((SentenceOutput(heard),), ""),
    ):
        assert Service(Navigator(), outputs, supervisor=Supervisor(ROUTE)).unreachable() == why
    assert Service(Navigator(), ()).unreachable() == ""


def test_the_ellipse_lies_as_the_covariance_does():
    angle = math.radians(135.0)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    (north, both), (_, east) = turn @ np.diag([4.0, 1.0]) @ turn.T
    assert ellipse((north, both, east)) == pytest.approx((2.0 * 2.447747, 2.447747, 135.0), rel=1e-6)


# --- drawings


def drawn(text, kind):
    return [each for each in ElementTree.fromstring(text) if each.attrib.get("class") == kind]


def test_north_is_up_east_is_right_and_the_scale_bar_is_as_long_as_it_says():
    window = chart.Window(0.0, 0.0, 1.0, 400.0, 300.0)
    assert window.at(0.0, 0.0) == (200.0, 150.0) and window.at(10.0, 20.0) == (220.0, 140.0)
    (vector,) = drawn(chart.moving(window, View(north=10.0, east=20.0, cog_deg=90.0, sog_kn=4.0)), "vector")
    start, end = ([float(x) for x in each.split()] for each in vector.attrib["d"][1:].split("L"))
    assert start == [220.0, 140.0] and end[1] == 140.0 and end[0] == pytest.approx(220.0 + 4.0 * KNOT * 30.0, abs=0.1)
    still = chart.still(chart.Window(0.0, 0.0, 0.4, 400.0, 300.0), [], [], None)
    assert "50 m" in still and "h125.0" in drawn(still, "scale")[0].attrib["d"]


@pytest.mark.parametrize(
    ("end", "boat", "points"),
    [((100.0, 0.0), (10.0, 7.0), "207.0,140.0 200.0,140.0"), ((0.0, 100.0), (-7.0, 10.0), "210.0,157.0 210.0,150.0")],
)
def test_the_offset_ends_on_the_leg(end, boat, points):
    """Starboard of a leg to the north is east; starboard of a leg to the east is south."""
    shown = View(north=boat[0], east=boat[1], cross_track=7.0, target=1)
    moving = chart.moving(chart.Window(0.0, 0.0, 1.0, 400.0, 300.0), shown, [(0.0, 0.0), end])
    assert [each.attrib["points"] for each in drawn(moving, "offset")] == [points]


def test_the_whole_is_inside_and_drawings_are_well_formed():
    places = [(0.0, 0.0), (300.0, 0.0), (300.0, 900.0)]
    window = chart.around(places, 390.0, 340.0)
    assert all(window.holds(*place, 0.05) for place in places)
    track = [(0.0, 0.0), (1.0, 50.0), None, (2.0, 60.0), (3.0, 70.0)]
    assert len(drawn(chart.still(window, places, track, 1), "track")) == 2
    for empty in (
        chart.still(window, [], [], None),
        chart.moving(window, View()),
        chart.strip([], 300, 90, 60, 1),
    ):
        ElementTree.fromstring(empty)


def test_courses_do_not_jump_at_north():
    points = [chart.Point(float(k), value, 1.0) for k, value in enumerate((350.0, 355.0, 2.0, None, 10.0, 355.0))]
    assert [each.value for each in chart.unwound(points)] == [350.0, 355.0, 362.0, None, 370.0, 355.0]
    strip = chart.strip(chart.unwound(points), 300.0, 96.0, 60.0, 20.0, turns=True)
    assert len(drawn(strip, "curve")) == 2 and ">000°<" in strip


def test_the_track_breaks_where_she_was_lost_and_stays_short():
    history = History()
    for k in range(20000):
        history.add(View(time=NOON + 0.2 * k, north=2.0 * k, east=0.0, status="ok"))
    assert len(history.track) <= 4001 and history.track[-1] == (2.0 * 19999, 0.0) and len(history.moments) <= 302
    history.add(View(status="lost"))
    history.add(View(status="lost"))
    assert history.track[-1] is None and history.track[-2] is not None


# --- addresses and tokens


def test_this_computer_needs_no_token_and_others_need_one():
    assert address("localhost") == Address("localhost", 8080) and address("[::1]:9000") == Address("::1", 9000)
    for text in ("0.0.0.0:8080", "boat.local:80", "[::]:8080"):
        with pytest.raises(InputError, match="can be reached from other computers, expected a token"):
            address(text)
        assert address(text, TOKEN).token == TOKEN
    for text in ("", ":8080", "host:99999", "http://127.0.0.1:8080"):
        with pytest.raises(InputError, match="expected host:port"):
            address(text, TOKEN)


def test_a_token_is_long_enough_and_never_printed(tmp_path, monkeypatch):
    for token in ("short", "x" * 300, "a\nb" * 8):
        with pytest.raises(InputError) as refused:
            checked(token)
        assert token not in str(refused.value)
    monkeypatch.setenv("STEERWAY_HELM_TOKEN", TOKEN)
    assert token_of(None) == TOKEN
    (tmp_path / "token").write_text("another token\n")
    assert token_of(str(tmp_path / "token")) == "another token"
    with pytest.raises(InputError, match="cannot be read"):
        token_of(str(tmp_path / "none"))
    assert [name for name in Settings.model_fields if "token" in name] == ["helm_token_file", "control_token_file"]


def test_the_page_asks_for_nothing_else(monkeypatch):
    """The page's process can only send requests of `Controls`; this test lists all of them."""
    service, asked_for = Service(Navigator(), []), []
    monkeypatch.setattr(service.controls, "do", lambda *given: asked_for.append(given))
    helm = HelmPage(service, Address("127.0.0.1", 8080))
    for what in ("settings", "record", "stop"):
        helm._do(what, "/etc/passwd", "10.0.0.7")
    assert asked_for == [(what, "/etc/passwd", "the helm page") for what in ("settings", "record", "stop")]
    with pytest.raises(InputError) as refused:
        Controls().do("settings", None, "a test")
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
def alone():
    return Gate(_inside, Address("127.0.0.1", 8080))


@pytest.fixture
def guarded():
    return Gate(_inside, Address("0.0.0.0", 8080, TOKEN))


OWN = {"origin": "http://127.0.0.1:8080"}
BOAT = "boat.local:8080"
BOATS = {"origin": f"http://{BOAT}"}


def test_the_page_itself_passes(alone):
    assert asked(alone).text == "inside" and asked(alone, host="localhost:9000").status_code == 200
    assert asked(alone, "POST", headers=OWN).status_code == 200
    assert knocked(alone, {"host": "127.0.0.1:8080"} | OWN) == ["websocket.accept"]


@pytest.mark.parametrize("origin", [None, "null", "http://evil.example", "http://127.0.0.1:3000"])
def test_another_page_does_not(alone, origin):
    headers = {} if origin is None else {"origin": origin}
    assert asked(alone, "POST", headers=headers).status_code == 403
    assert knocked(alone, {"host": "127.0.0.1:8080"} | headers) == ["websocket.close"]
    assert asked(alone, headers=headers).status_code == (403 if origin else 200)


def test_a_foreign_name_for_this_computer_does_not(alone):
    for host in ("evil.example:8080", "192.168.1.4:8080", "127.0.0.1.evil.example"):
        assert asked(alone, "POST", host=host, headers={"origin": f"http://{host}"}).status_code == 403
        assert knocked(alone, {"host": host, "origin": f"http://{host}"}) == ["websocket.close"]


@pytest.mark.parametrize("host", ["boat.example", "127.0.0.1:8080"])
def test_behind_a_tls_proxy_browsers_see_another_origin(host):
    """Some proxies pass on the host that browsers name, others their own name for the computer."""
    gate = Gate(_inside, address("127.0.0.1:8080", TOKEN, "https://boat.example"))
    here = {"origin": "https://boat.example"}
    reply = asked(gate, "POST", "/login", host, headers=here, data={"token": TOKEN})
    assert reply.status_code == 303 and "; secure" in reply.headers["set-cookie"].lower()
    kept = {"cookie": reply.headers["set-cookie"].partition(";")[0]}
    assert asked(gate, host=host, headers=kept).text == "inside"
    assert knocked(gate, {"host": host} | kept | here) == ["websocket.accept"]
    assert knocked(gate, {"host": host, "origin": "https://evil.example"} | kept) == ["websocket.close"]
    assert asked(gate, host="evil.example", headers=kept).status_code == 403
    with pytest.raises(InputError, match=r"'https://boat\.example' can be reached from other computers"):
        address("127.0.0.1:8080", None, "https://boat.example")
    with pytest.raises(InputError, match=r"helm-origin is 'boat\.example', expected the address for browsers"):
        address("127.0.0.1:8080", TOKEN, "boat.example")


def test_nothing_is_framed_or_loaded_from_elsewhere(alone):
    headers = asked(alone).headers
    assert headers["x-frame-options"] == "DENY" and "default-src 'self'" in headers["content-security-policy"]


def test_without_the_token_there_is_only_the_login(guarded):
    assert asked(guarded, host=BOAT).headers["location"] == "/login"
    assert "token" in asked(guarded, path="/login", host=BOAT).text
    for method, path in (("GET", "/_nicegui/x.js"), ("POST", "/"), ("GET", "/_nicegui_ws/socket.io/?EIO=4")):
        assert asked(guarded, method, path, BOAT, headers=BOATS).status_code == 401
    assert knocked(guarded, {"host": BOAT} | BOATS) == ["websocket.close"]
    assert knocked(guarded, {"host": BOAT, "cookie": f"{COOKIE}=9999999999.00"} | BOATS) == ["websocket.close"]


def test_the_token_opens(guarded):
    reply = asked(guarded, "POST", "/login", BOAT, headers=BOATS, data={"token": TOKEN})
    assert reply.status_code == 303 and reply.headers["location"] == "/"
    cookie = reply.headers["set-cookie"]
    assert "httponly" in cookie.lower() and "samesite=strict" in cookie.lower() and TOKEN not in cookie
    kept = {"cookie": cookie.partition(";")[0]}
    assert asked(guarded, host=BOAT, headers=kept).text == "inside"
    assert knocked(guarded, {"host": BOAT} | kept | BOATS) == ["websocket.accept"]
    assert knocked(guarded, {"host": BOAT, "origin": "http://evil.example"} | kept) == ["websocket.close"]
    later = Gate(_inside, Address("0.0.0.0", 8080, TOKEN))
    assert asked(later, host=BOAT, headers=kept).text == "inside"  # nobody has to log in again after a restart
    other = Gate(_inside, Address("0.0.0.0", 8080, "another long token"))
    assert asked(other, host=BOAT, headers=kept).status_code == 303


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
    sessions = Sessions(TOKEN)
    cookie = sessions.cookie()
    expiry, _, seal = cookie.partition(".")
    assert sessions.knows(cookie)
    for forged in ("", ".", "x.y", expiry, f"{int(expiry) + 1}.{seal}", f"{expiry}.{seal[:-1]}0x", "²." + seal):
        assert not sessions.knows(forged)
    with mock.patch("time.time", lambda: int(expiry) + 1.0):
        assert not sessions.knows(cookie)  # expired


# --- the pipe to the service


def test_without_its_package_there_is_no_page(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"expected pip install '\.\[helm\]'"):
        HelmPage(Service(Navigator(), []), Address("127.0.0.1", 8080))


def test_a_page_that_fails_is_begun_again(caplog):
    """Any failure of the page is logged, and the service goes on."""
    service = Service(Navigator(), [])
    service.latest = None
    helm = HelmPage(service, Address("127.0.0.1", 0))

    async def shown():
        async with under_way(helm.run()):
            await until(lambda: caplog.text.count("restarted") >= 2, 20.0)

    asyncio.run(shown())


def test_a_page_that_hangs_delays_nothing_and_misses_views(tmp_path, monkeypatch):
    """This page neither reads its input nor ends."""
    hung = tmp_path / "hung"
    hung.write_text("#!/bin/sh\nexec sleep 60\n")
    hung.chmod(0o700)
    monkeypatch.setattr(page_process.sys, "executable", str(hung))
    monkeypatch.setattr(page_process, "RATE", 1e4)
    send, sent = page_process._send, []
    monkeypatch.setattr(page_process, "_send", lambda *given: sent.append(send(*given)))
    helm = HelmPage(Service(Navigator(), []), Address("127.0.0.1", 0))

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
