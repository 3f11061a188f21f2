"""Links and what is said on them: bytes in pieces, sockets on this machine, sentences and deltas as they are read."""

import asyncio
import gc
import io
import json
import math
import socket
import sys
from itertools import pairwise

import numpy as np
import pytest

from steerway.core import OK, InputError
from steerway.core.testing import NO_COURSE, iso
from steerway.estimation import estimate
from steerway.formats.testing import nmea0183, ubx
from steerway.live.testing import (
    Context,
    Deltas,
    FileSink,
    GpsdDecoder,
    JsonLines,
    Navigator,
    ReceiverDecoder,
    Rhythm,
    Row,
    SentenceOutput,
    Service,
    SignalKDecoder,
    addresses,
    delta,
    json_line,
    lost,
    motion,
    uri,
)
from steerway.live.testing import signalk_token_of as token_of
from tests.kept_outputs import Kept, assert_equal
from tests.ports import free_port, until
from tests.recording_sink import RecordingSink
from tests.sentences import START, gga, gll, pvt, rmc, sealed, sortie, track

NOON = 1_719_835_200.0
PLACE = (math.radians(54.0), math.radians(10.0))
SAILING = Row(NOON, *PLACE, 2.0, -math.pi / 2.0, math.radians(1.0), 0.1, 0.02, 0.01, 0.3, 1.2, OK)
DRIFTING = SAILING._replace(cog=math.nan, course_rate=math.nan, cog_std=math.nan, course_rate_std=math.nan)


def fed(decoder, log, size):
    pieces = [log[k : k + size] for k in range(0, len(log), size)]
    return [row for piece in pieces for row in decoder.feed(piece)] + decoder.settle()


@pytest.mark.parametrize("size", [1, 7, 100, 100000])
def test_sentences_in_pieces_are_the_rows_of_the_log(size):
    log = sortie(50)
    (fixes,) = [each for name, each in nmea0183.read(log).sources.items() if name == "GP"]
    rows = [row for row in fed(ReceiverDecoder(), log, size) if row.source == "GP"]
    placed = [row for row in rows if row.has_position]
    assert [row.time for row in placed] == fixes.time.tolist()
    assert [row.latitude for row in placed] == fixes.latitude.tolist()


def test_an_epoch_waits_for_its_finest_position():
    coarse = sealed("GPGLL,5400.001,N,01000.002,E,120000,A,A")
    decoder = ReceiverDecoder()
    decoder.feed(rmc(START - 1.0, 54.0, 10.0))
    (first,) = decoder.feed(coarse)
    assert first.time == START - 1.0
    assert decoder.feed(gga(START, 54.00002, 10.00003)) == []
    (fine,) = decoder.settle()
    assert math.degrees(fine.latitude) == pytest.approx(54.00002, abs=1e-9)
    assert decoder.settle() == [] and decoder.feed(gll(START, 54.00002, 10.00003)) == []


def test_without_a_date_it_is_today():
    import time

    (row,) = fed(ReceiverDecoder(), gga(START, 54.0, 10.0), 10)
    assert abs(row.time - time.time()) <= 43200.0 + 1.0
    assert (row.time - START) % 86400.0 == pytest.approx(0.0, abs=1e-6)


def test_weeks_that_rolled_over_are_put_right_by_the_computers_clock(monkeypatch):
    from types import SimpleNamespace

    rollover = 1024 * 7 * 86400.0
    twice = START + 2.0 * rollover
    for computer, expected in ((START + rollover, START + rollover), (twice + 5e5, twice), (START + 1e8, START),
                               (0.0, START), (START - rollover, START)):  # fmt: skip
        monkeypatch.setattr("steerway.live.links.decoding.time", SimpleNamespace(time=lambda now=computer: now))
        (row,) = fed(ReceiverDecoder(), rmc(START, 54.0, 10.0), 100)
        assert row.time == expected


def test_gpsd_reports_several_times_an_epoch():
    place = {"class": "TPV", "device": "/dev/a", "mode": 3, "time": iso(NOON), "lat": 54.0, "lon": 190.0}
    later = place | {"time": iso(NOON + 1.0), "eph": 2.0, "magtrack": 5.0}
    lines = [{"class": "VERSION"}, place, place | {"speed": 3.0, "track": 270.0}, later, {"class": "SKY"}]
    log = (
        b"".join(json.dumps(line).encode() + b"\r\n" for line in lines) + b"not json\n" + b'{"class":"TPV","mode":1}\n'
    )
    decoder = GpsdDecoder()
    first, second = fed(decoder, log, 11)
    assert (first.source, first.time, first.sog) == ("gpsd /dev/a", NOON, 3.0)
    assert first.longitude == pytest.approx(math.radians(-170.0))
    assert first.cog == pytest.approx(-math.pi / 2.0)
    assert second.time == NOON + 1.0 and math.isnan(second.cog) and math.isnan(second.heading)
    assert second.position_std == pytest.approx(2.0 / math.sqrt(2.0))
    assert decoder.skipped == {"malformed": 1}


def test_signal_k_deltas_are_merged_and_null_is_nothing():
    def update(path, value, source="gps.GP", time=NOON):
        return {"$source": source, "timestamp": iso(time), "values": [{"path": path, "value": value}]}

    updates = [
        update("navigation.position", {"latitude": 54.0, "longitude": 10.0}),
        update("navigation.speedOverGround", 2.0),
        update("navigation.courseOverGroundTrue", 1.5 * math.pi),
        update("navigation.headingTrue", None),
        update("navigation.position", {"latitude": 1.0, "longitude": 1.0}, "steerway"),
        update("environment.depth", 4.0),
    ]
    decoder = SignalKDecoder()
    for each in updates:
        decoder.message(json.dumps({"context": "vessels.urn:self", "updates": [each]}))
    (row,) = decoder.settle()
    assert (row.source, row.sog, row.latitude) == ("gps.GP", 2.0, math.radians(54.0))
    assert row.cog == pytest.approx(-math.pi / 2.0) and math.isnan(row.heading)


def test_sentences_once_a_second_and_never_a_stale_one():
    sink = RecordingSink()
    output = SentenceOutput(sink)
    for k in range(100):
        output.tick(SAILING._replace(time=NOON + k * 0.02))
    assert len(sink.messages) == 2
    output.tick(SAILING._replace(time=NOON + 1.99))
    output.tick(lost(NOON + 2.0))
    first, last = (each.decode().split("\r\n") for each in (sink.messages[0], sink.messages[-1]))
    assert first[0].startswith("$SWRMC,120000.000,A,5400.0000000,N,01000.0000000,E,3.888,270.00,010724,")
    assert first[1].startswith("$SWVTG,270.00,T,,M,3.888,N,7.200,K,A")
    assert first[2].startswith("$SWROT,60.00,A")  # 1 °/s to starboard
    assert last[0].startswith("$SWRMC,120002.000,V,,,,,,,010724,,,N")
    assert ",N*" in last[1] and last[2].startswith("$SWROT,,V")


def test_a_boat_without_course_says_none():
    rmc_, vtg_, rot_ = SentenceOutput(RecordingSink()).sentences(DRIFTING)
    assert rmc_.split(",")[2] == "A" and rmc_.split(",")[8] == ""
    assert vtg_.startswith("$SWVTG,,T,,M,3.888") and rot_.startswith("$SWROT,,V")


def test_what_is_said_is_what_a_reader_reads():
    sink = RecordingSink()
    output = SentenceOutput(sink)
    for k in range(5):
        output.tick(SAILING._replace(time=NOON + k))
    (fixes,) = nmea0183.read(b"".join(sink.messages)).sources.values()
    assert len(fixes) == 5 and fixes.sog == pytest.approx([2.0] * 5, abs=1e-3)
    assert np.cos(fixes.cog + math.pi / 2.0) == pytest.approx([1.0] * 5)
    assert fixes.yaw_rate == pytest.approx([math.radians(1.0)] * 5)


def test_a_delta_in_si_with_null_for_unknown():
    message = json.loads(delta(NOON, motion(SAILING)))
    (update,) = message["updates"]
    values = {each["path"]: each["value"] for each in update["values"]}
    assert message["context"] == "vessels.self" and update["$source"] == "steerway"
    assert update["timestamp"] == "2024-07-01T12:00:00Z"
    assert values["navigation.position"] == pytest.approx({"latitude": 54.0, "longitude": 10.0})
    assert values["navigation.speedOverGround"] == 2.0
    assert values["navigation.courseOverGroundTrue"] == pytest.approx(1.5 * math.pi)
    assert values["navigation.rateOfTurn"] == pytest.approx(math.radians(1.0))
    (update,) = json.loads(delta(NOON, motion(lost(NOON))))["updates"]
    assert [each["value"] for each in update["values"]] == [None] * 4


def test_a_delta_a_fix_and_the_present_where_fixes_stay_away():
    sink = RecordingSink()
    output = Deltas(sink)
    for k in range(10):
        output.fix(SAILING._replace(time=NOON + 0.2 * k))
        output.tick(SAILING._replace(time=NOON + 0.2 * k + 0.1))
    for k in range(100, 140):
        output.tick(lost(NOON + 0.1 * k))
    updates = [json.loads(message)["updates"][0] for message in sink.messages]
    assert [each["timestamp"][17:-1] for each in updates] == ["00", "01", "10"]
    values = [{each["path"]: each["value"] for each in update["values"]} for update in updates]
    assert [len(each) for each in values] == [4, 4, 3] and set(values[2].values()) == {None}
    assert "navigation.position" not in values[2]
    output.fix(SAILING._replace(time=NOON + 20.0))
    output.tick(lost(NOON + 40.0))
    assert [len(json.loads(message)["updates"][0]["values"]) for message in sink.messages[3:]] == [4, 3]


def test_the_own_position_is_not_sent_to_the_server_it_comes_from():
    (address,), _ = addresses.sources(["signalk://127.0.0.1:3000?token=hidden"])
    here = [addresses.opened(address, 1)]
    for text, sent in (("", False), ("?position=yes", True), ("?position=no", False)):
        output, _ = addresses.output(f"signalk://127.0.0.1:3000{text}", Context(inputs=here))
        assert output.positions is sent
    assert addresses.output("signalk://127.0.0.1:3001", Context(inputs=here))[0].positions
    with pytest.raises(InputError, match="position is 'x', expected yes or no"):
        addresses.output("signalk://127.0.0.1:3000?position=x")


def test_own_values_are_not_read_back_whatever_the_server_calls_them():
    decoder = SignalKDecoder()
    for source in ("steerway", "steerway.XX", "ws.steerway"):
        value = {"path": "navigation.speedOverGround", "value": 1.0}
        decoder.message(json.dumps({"updates": [{"$source": source, "timestamp": iso(NOON), "values": [value]}]}))
    assert decoder.settle() == []


def test_a_token_is_in_no_text(tmp_path, caplog):
    (found,), _ = addresses.sources(["signalk://127.0.0.1:1?token=abc123&x=y".replace("&x=y", "")])
    assert found.options["token"] == "abc123" and "abc123" not in found.text and "***" in found.text
    for text in ("signal://h:1?token=abc123", "signalk://h?x=1&token=abc123", "signalk://h:99999?token=abc123"):
        with pytest.raises(InputError) as refused:
            addresses.sources([text])
        assert "abc123" not in str(refused.value)
    (tmp_path / "token").write_text("abc123\n")
    (found,), _ = addresses.sources([f"signalk://127.0.0.1:1?token-file={tmp_path / 'token'}"])
    assert token_of(found) == "abc123"
    with pytest.raises(InputError, match="cannot be read"):
        addresses.sources(["signalk://127.0.0.1:1?token-file=/nowhere"])

    async def fails():
        task = asyncio.create_task(addresses.opened(found, 1).run(lambda rows: None))
        await asyncio.sleep(0.2)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(fails())
    assert caplog.text and "abc123" not in caplog.text


def test_json_lines_carry_the_columns_of_estimate():
    line = json.loads(json_line(SAILING._replace(status=NO_COURSE, cog=math.nan)))
    frame = estimate(nmea0183.read(sortie(3)).sources["GP"], "small-usv").to_frame()
    assert list(line) == frame.columns
    assert line["course_rate_dps"] == pytest.approx(1.0) and line["cog_deg"] is None and line["status"] == "no_course"
    file = io.BytesIO()
    output = JsonLines(FileSink(file, lossless=True))
    for _ in range(2000):
        output.fix(SAILING)
        output.tick(SAILING)
    output.close()
    assert file.getvalue().count(b"\n") == 2000


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("ftp://a:1", "not a known address"),
        ("tcp://a", "names no port"),
        ("tcp://a:99999", "scheme://host:port"),
        ("serial:/dev/ttyS0?baud=1234", "baud is 1234"),
        ("serial:", "names no path"),
        ("udp://:1?speed=2", "option 'speed' is unknown"),
        ("file:a?speed=0", "speed is 0"),
        ("file:a?speed=fast", "expected a number"),
    ],
)
def test_wrong_addresses_are_refused_in_a_sentence(text, why):
    with pytest.raises(InputError, match=why):
        addresses.sources([text])


def test_addresses_as_users_write_them():
    found, speed = addresses.sources(
        ["gpsd://localhost", "signalk://[::1]:80?token=x", "serial:/dev/ttyACM0?baud=38400"]
    )
    assert [each.port for each in found] == [2947, 80, 0] and found[2].path == "/dev/ttyACM0" and math.isnan(speed)
    assert addresses.sources(["file:dir/a b.nmea?speed=10"]) == (
        [uri.Uri("file:dir/a b.nmea?speed=10", "file", path="dir/a b.nmea", options={"speed": "10"})],
        10.0,
    )
    assert addresses.sources(["file:a?speed=max"])[1] == math.inf
    with pytest.raises(InputError, match="beside a live link"):
        addresses.sources(["file:a", "udp://:5"])


async def listened(text, feed, n, to=(), source="GP"):
    """What a service with one listener says of n fixes that `feed` brings about."""
    kept = Kept()
    pairs = [addresses.output(each) for each in to]
    service = Service(Navigator("small-usv", sources=(source,)), [kept, *(output for output, _ in pairs)])
    (address,), _ = addresses.sources([text])
    links = [link for _, link in pairs if link]
    task = asyncio.create_task(service.run([addresses.opened(address, 1)], links))
    await asyncio.sleep(0.1)
    try:
        await asyncio.gather(feed(), until(lambda: len(kept.fixes) >= n))
        await asyncio.sleep(0.2)
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
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

    kept = asyncio.run(listened(f"tcp://127.0.0.1:{port}", serve, 60))
    assert_equal(kept.fixes, estimate(nmea0183.read(log).sources["GP"], "small-usv"))
    assert kept.ticks, "the present is sent too"
    times = [row.time for row in kept.ticks]
    assert (np.diff(times) > 0.0).all() and np.allclose(np.array(times) * 50.0 % 1.0, 0.0, atol=1e-3)


def test_datagrams_in_sentences_out():
    log = sortie(30).splitlines()
    into, out = free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_DGRAM)
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", out))
    receiver.setblocking(False)

    async def feed():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for line in log:
                sender.sendto(line, ("127.0.0.1", into))
                await asyncio.sleep(0.001)

    kept = asyncio.run(listened(f"udp://127.0.0.1:{into}", feed, 30, [f"udp://127.0.0.1:{out}?period=0.1"]))
    with receiver:
        received = receiver.recv(4096)
    assert_equal(kept.fixes, estimate(nmea0183.read(b"\r\n".join(log)).sources["GP"], "small-usv"))
    assert received.startswith(b"$SWRMC,") and b"$SWROT," in received


def mixed(n):
    """UBX and sentences of the same moments, some of either damaged."""
    places = list(zip(*track(n), strict=True))
    frames, lines = [pvt(*place) for place in places], [rmc(*place) + gga(*place) for place in places]
    frames[n // 2] = frames[n // 2][:50]
    lines[n // 3] = lines[n // 3][:50]
    return [part for pair in zip(frames, lines, strict=True) for part in pair]


@pytest.mark.parametrize("source", ["UBX", "GP"])
@pytest.mark.parametrize("scheme", ["tcp", "udp"])
def test_ubx_and_sentences_mixed_on_a_link(scheme, source):
    parts = mixed(40)
    log = b"".join(parts)
    expected = {**ubx.read(log).sources, **nmea0183.read(log).sources}[source]
    port = free_port(socket.SOCK_DGRAM if scheme == "udp" else socket.SOCK_STREAM)

    async def datagrams():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for part in parts:
                sender.sendto(part, ("127.0.0.1", port))
                await asyncio.sleep(0.001)

    async def stream():
        async def send(reader, writer):
            for k in range(0, len(log), 61):
                writer.write(log[k : k + 61])
                await asyncio.sleep(0.0)
            await reader.read()

        async with await asyncio.start_server(send, "127.0.0.1", port):
            await asyncio.sleep(1.5)

    feed = datagrams if scheme == "udp" else stream
    kept = asyncio.run(listened(f"{scheme}://127.0.0.1:{port}", feed, len(expected), source=source))
    assert len(expected) >= 39
    assert_equal(kept.fixes, estimate(expected, "small-usv"))


def test_every_client_receives_and_one_that_does_not_read_stops_nobody():
    into, out = free_port(socket.SOCK_DGRAM), free_port()
    received = bytearray()

    async def feed():
        deaf = await asyncio.open_connection("127.0.0.1", out)
        reader, writer = await asyncio.open_connection("127.0.0.1", out)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for time, lat, lon in zip(*track(5), strict=True):
                sender.sendto(rmc(time, lat, lon), ("127.0.0.1", into))
                await asyncio.sleep(0.06)
        while received.count(b"$SWRMC") < 2:
            received.extend(await asyncio.wait_for(reader.read(4096), 5.0))
        writer.close()
        deaf[1].close()

    asyncio.run(listened(f"udp://127.0.0.1:{into}", feed, 5, [f"tcp-server://127.0.0.1:{out}?period=0.05"]))
    (fixes,) = nmea0183.read(bytes(received)).sources.values()
    assert fixes.has_position.any()


def test_listening_for_long_takes_no_memory():
    decoder, navigator, rows = ReceiverDecoder(), Navigator("small-usv"), 0

    def listen(start, n):
        nonlocal rows
        for time, lat, lon in zip(*track(n, start=START + start), strict=True):
            for received in decoder.feed(rmc(time, lat, lon) + pvt(time, lat, lon) + gga(time, lat, lon)):
                rows += len(navigator.add(received))

    listen(0.0, 2500)  # the interpreter keeps some 2000 tuples to use again
    held = []
    for start in (2500.0, 4000.0, 5500.0):
        gc.collect()
        held.append(sys.getallocatedblocks())
        listen(start, 1500)
    # What is kept of each fix is kept in both; what other threads of the process keep for once is not.
    assert rows > 6900 and min(held[1] - held[0], held[2] - held[1]) < 200, held


@pytest.mark.parametrize("rate", [10.0, 50.0, 100.0])
def test_ten_times_a_second_is_every_tenth_of_a_second(rate):
    """At Unix times, whose last digit is coarser than one might think."""
    rhythm, first = Rhythm(0.1), round(NOON * rate) + 7
    struck = [k for k in range(10_000) if rhythm.is_due((first + k) / rate)]
    assert {later - earlier for earlier, later in pairwise(struck[1:])} == {round(rate / 10.0)}
