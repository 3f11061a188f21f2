"""Links and their data: bytes in pieces, sockets on this machine, sentences and deltas read back."""

import asyncio
import json
import logging
import math
import os
import random
import socket
import sys
from itertools import pairwise
from unittest.mock import Mock, patch

import numpy as np
import pytest

from steerway.core import OK, InputError
from steerway.core.testing import iso, unix_times
from steerway.estimation import estimate
from steerway.formats.testing import nmea0183
from steerway.live import testing as live
from tests import hastened
from tests.kept_outputs import RecordingSink, assert_equal, serving
from tests.ports import free_port, under_way, until
from tests.sentences import rmc, sortie, track

NOON = 1_719_835_200.0
PLACE = (math.radians(54.0), math.radians(10.0))
SAILING = live.Row(NOON, *PLACE, 2.0, -math.pi / 2.0, math.radians(1.0), 0.1, 0.02, 0.01, 0.3, 0.3, 1.2, OK)


def test_signal_k_deltas_are_merged_and_null_is_nothing():
    def update(path, value, source="gps.GP", time=NOON):
        return {"$source": source, "timestamp": iso(time), "values": [{"path": path, "value": value}]}

    updates = [
        update("navigation.position", {"latitude": 54.0, "longitude": 10.0}),
        update("navigation.speedOverGround", 2.0),
        update("navigation.courseOverGroundTrue", 1.5 * math.pi),
        update("navigation.headingTrue", None),
        *(update("navigation.speedOverGround", 9.0, own) for own in ("steerway", "steerway.XX", "ws.steerway")),
        update("environment.depth", 4.0),
    ]
    decoder = live.SignalKDecoder()
    for each in updates:
        decoder.message(json.dumps({"context": "vessels.urn:self", "updates": [each]}))
    (row,) = decoder.complete_on_silence()
    assert (row.source, row.sog, row.latitude) == ("gps.GP", 2.0, math.radians(54.0))
    assert row.cog == pytest.approx(-math.pi / 2.0) and math.isnan(row.heading)


def test_the_own_position_is_not_sent_to_the_server_it_comes_from():
    (address,), _ = live.addresses.sources(["signalk://127.0.0.1:3000?token=hidden"])
    here = live.Context(inputs=[live.addresses.opened(address, 1)])
    for text, sent in ((":3000", False), (":3000?position=yes", True), (":3001", True)):
        assert live.addresses.output(f"signalk://127.0.0.1{text}", here)[0].positions is sent


def test_a_token_is_in_no_text(tmp_path, caplog):
    (found,), _ = live.addresses.sources(["signalk://127.0.0.1:1?token=abc123"])
    assert found.options["token"] == "abc123" and "abc123" not in found.text and "***" in found.text
    for text in ("signal://h:1?token=abc123", "signalk://h:99999?token=abc123"):
        with pytest.raises(InputError) as refused:
            live.addresses.sources([text])
        assert "abc123" not in str(refused.value)
    (tmp_path / "token").write_text("abc123\n")
    (found,), _ = live.addresses.sources([f"signalk://127.0.0.1:1?token-file={tmp_path / 'token'}"])
    assert live.signalk_token_of(found) == "abc123"
    with pytest.raises(InputError, match="cannot be read"):
        live.addresses.sources(["signalk://127.0.0.1:1?token-file=/nowhere"])

    async def fails():
        async with under_way(live.addresses.opened(found, 1).run(lambda rows: None)):
            await until(lambda: caplog.text)

    asyncio.run(fails())
    assert "abc123" not in caplog.text


MAVLINK = "mavlink:udpin:127.0.0.1:1"


def test_wrong_addresses_are_refused_in_a_sentence():
    for text, why in {
        "ftp://a:1": "not a known address",
        "tcp://a": "names no port",
        "n2k+tcp://gateway": "names no port",
        "serial:/dev/ttyS0?baud=1234": "baud is 1234",
        "udp://:2?speed=2": "option 'speed' is unknown",
    }.items():
        with pytest.raises(InputError, match=why):
            live.addresses.sources([text])
    with pytest.raises(InputError, match="beside a live link"):
        live.addresses.sources(["file:a", "udp://:5"])
    for text, why, more in (
        ("udp://a:1?format=json&period=1", "option 'period' is unknown, expected format", {}),
        ("udp://a:1?format=hello", "format is 'hello', expected one of nmea, json, propellers", {}),
        ("n2k+tcp://a:1", "expected a live link", {"lossless": True}),
        (f"{MAVLINK}?silence=2", "expected the same options in both", {"supervisor": Mock()}),
        (MAVLINK, "expected --mission", {}),
        (MAVLINK, "needs a live link", {"supervisor": Mock(), "lossless": True}),
    ):
        vehicle = live.addresses.opened(live.addresses.sources([MAVLINK])[0][0], 1)
        with pytest.raises(InputError, match=why):
            live.addresses.output(text, live.Context(inputs=[vehicle], **more))


@pytest.mark.parametrize(
    ("make", "package"),
    [
        (lambda: live.addresses.opened(live.addresses.sources([MAVLINK])[0][0], 1), "mavlink"),
        (lambda: live.addresses.output("foxglove://127.0.0.1"), "foxglove"),
        (lambda: live.HelmPage(live.Service(live.Navigator(), []), live.Address("127.0.0.1", 8080)), "helm"),
    ],
)
def test_a_package_that_is_missing_is_named(make, package, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "pymavlink", None)
    with pytest.raises(InputError, match=rf"pip install '\.\[{package}\]'"):
        make()


def test_addresses_as_users_write_them():
    found, speed = live.addresses.sources(
        ["gpsd://localhost", "signalk://[::1]:80?token=x", "serial:/dev/ttyACM0?baud=38400"]
    )
    assert [each.port for each in found] == [2947, 80, 0] and found[2].path == "/dev/ttyACM0" and math.isnan(speed)
    assert live.addresses.sources(["file:dir/a b.nmea?speed=10"]) == (
        [live.uri.Uri("file:dir/a b.nmea?speed=10", "file", path="dir/a b.nmea", options={"speed": "10"})],
        10.0,
    )
    assert live.addresses.sources(["file:a?speed=max"])[1] == math.inf
    for text, kind in {
        "udp://127.0.0.1:1234?format=propellers": live.PropellerCommands,
        "stdout:?format=propellers": live.PropellerCommands,
        "udp://127.0.0.1:1234?format=json": live.JsonLines,
        "stdout:": live.JsonLines,
    }.items():
        assert isinstance(live.addresses.output(text)[0], kind)


async def listened(text, feed, n, to=()):
    """The rows of a service with one input, for n fixes that `feed` sends."""
    async with serving([text], to, ("GP",)) as kept:
        await asyncio.sleep(0.1)
        await asyncio.gather(feed(), until(lambda: len(kept.fixes) >= n))
        await asyncio.sleep(0.2)
    return kept


def test_a_log_over_tcp_is_the_estimate_and_a_broken_link_is_opened_again():
    log = sortie(60)
    port = free_port()
    parts = [log[: len(log) // 2], log[len(log) // 2 :]]

    async def serve():
        async def send(reader, writer):
            part = parts.pop(0) if parts else b""
            for k in range(0, len(part), 37):
                writer.write(part[k : k + 37])
            await writer.drain()
            writer.close()

        async with await asyncio.start_server(send, "127.0.0.1", port):
            await until(lambda: not parts)
            await asyncio.sleep(0.2)

    kept = hastened.run(listened(f"tcp://127.0.0.1:{port}", serve, 60))
    assert_equal(kept.fixes, estimate(nmea0183.read(log).sources["GP"], "small-usv", causal=True))
    assert kept.ticks, "the present is sent too"
    times = [row.time for row in kept.ticks]
    assert (np.diff(times) > 0.0).all() and np.allclose(np.array(times) * 50.0 % 1.0, 0.0, atol=1e-3)


def test_a_serial_line_carries_both_ways_and_a_sink_leaves_what_comes_to_others():
    async def lines():
        far, near = os.openpty()
        address = live.addresses.stream(f"serial:{os.ttyname(near)}").uri
        came = []

        def receive(data, answer):
            if data == b"bad\n":
                raise ValueError
            came.append(data)
            answer(b"heard " + data)

        line = live.Transport(address, "serial", receive)
        async with under_way(line.open()):
            await until(lambda: line.peers)
            os.write(far, b"bad\n")  # what cannot be used ends no link
            await asyncio.sleep(0.05)
            os.write(far, b"one\n")
            await until(lambda: came)
            assert came == [b"one\n"] and os.read(far, 99) == b"heard one\n"
        sink = live.addresses.stream(f"serial:{os.ttyname(near)}")
        async with under_way(sink.run()):
            await until(lambda: sink.has_peer)
            os.write(far, b"for another\n")
            await asyncio.sleep(0.05)
            assert os.read(near, 99) == b"for another\n"
            for _ in range(2000):
                sink.send(b"x" * 99 + b"\n")
            assert sink.lost > 0, "who does not read loses whole messages"
        assert not sink.has_peer
        os.close(far)
        os.close(near)

    asyncio.run(lines())


def test_every_client_receives_and_one_that_does_not_read_stops_nobody():
    into, out = free_port(socket.SOCK_DGRAM), free_port()
    received = bytearray()

    async def feed():
        deaf = await asyncio.open_connection("127.0.0.1", out)
        reader, writer = await asyncio.open_connection("127.0.0.1", out)
        writer.write(sortie(5, lat=0.0, lon=0.0) * 1000 + b"\0" * 100_000)  # data from a client are dropped
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for place in zip(*track(5), strict=True):
                sender.sendto(rmc(*place), ("127.0.0.1", into))
                await asyncio.sleep(0.06)
        while received.count(b"$SWRMC") < 2:
            received.extend(await asyncio.wait_for(reader.read(4096), 5.0))
        writer.close()
        deaf[1].close()

    to = [f"tcp-server://127.0.0.1:{out}?period=0.05"]
    kept = hastened.run(listened(f"udp://127.0.0.1:{into}", feed, 5, to))
    (fixes,) = nmea0183.read(bytes(received)).sources.values()
    assert fixes.has_position.any()
    assert len(kept.fixes) == 5 and all(row.latitude > 0.9 for row in kept.fixes)


def test_ten_times_a_second_is_every_tenth_of_a_second():
    """At Unix times, which float64 resolves to a quarter of a microsecond only."""
    for rate in (10.0, 50.0, 100.0):
        rhythm, first = live.Rhythm(0.1), round(NOON * rate) + 7
        struck = [k for k in range(10_000) if rhythm.is_due((first + k) / rate)]
        assert {later - earlier for earlier, later in pairwise(struck[1:])} == {round(rate / 10.0)}, rate


def test_what_another_wrote_begins_no_line_of_the_log(capsys):
    logger = logging.getLogger("steerway.live")
    with patch.multiple(logger, handlers=[], propagate=True, level=logging.INFO):
        live.log_to_stderr("steerway live")
        logger.warning("vehicle: %s", "ok\nsteerway live: autopilot stopped\x1b[31m")
    assert capsys.readouterr().err == "steerway live: vehicle: ok\\nsteerway live: autopilot stopped\\x1b[31m\n"


def test_a_boat_handed_back_is_commanded_nothing():
    sink = RecordingSink()
    live.PropellerCommands(sink).tick(SAILING, None, live.Order(live.State.STOPPED, "enough", False))
    assert sink.lines()[0]["port"] is None


def test_times_of_gpsd_and_signal_k_are_those_of_tables():
    """The quick parser against the general one, also for dates that do not exist."""
    chance, texts = random.Random(1), []
    for _ in range(300):
        parts = [chance.randrange(n) for n in (3000, 14, 33, 25, 61, 62)]
        text = "{:04}-{:02}-{:02}T{:02}:{:02}:{:02}".format(*parts)
        texts.append(text + chance.choice(("Z", ".5Z", ".123456Z", "+02:00")))
    np.testing.assert_equal([live.moment(text) for text in texts], unix_times(texts))
