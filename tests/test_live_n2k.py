"""NMEA 2000 devices: messages against another implementation, fast packets, address claim, a bus and a gateway."""

import asyncio
import math
import struct
import time

import pytest

from steerway.core import OK
from steerway.core.testing import Leg
from steerway.formats.testing import Frame, Joiner, Splitter, frame_of, identifier_of
from steerway.live import testing as live
from tests import hastened
from tests.kept_outputs import Kept
from tests.messages import frames as split
from tests.messages import gnss, position
from tests.ports import free_port, under_way, until

LEG = Leg(-3.25, 1.0, 1.1, 120.5, 1.05, 1.2, math.radians(54.0), math.radians(-10.0), "WP1", "WP2")
ROW = live.Row(1.7e9, 0.9, 0.2, 2.34, -0.5, -0.02, 0.1, 0.02, 0.01, 0.3, 0.3, 1.2, OK)
SENT = {
    "03fce8e1ea00ffff": live.n2k.write_course_and_speed(3, -0.5, 2.34),
    "03003cf6ffffffff": live.n2k.write_rate_of_turn(3, -0.02),
    "0330bbfeffffffff": live.n2k.write_cross_track(3, LEG),
    "03122f000000ffffffffffff1027f82a010000000200000000bf2f20001f0afa7800": live.n2k.write_navigation(3, LEG, 1, 2),
    "ff3cffff7f0429ffffffffffffff7f800cff7fffff": live.n2k.write_track_control(1.05, 0.1),
}
"""Payloads that the package nmea2000 reads as course, speed, rate, cross-track error, leg and heading to steer."""


def test_what_is_sent_is_as_another_implementation_reads_it_and_what_is_unknown_is_not_available():
    assert [payload.hex() for payload in SENT.values()] == list(SENT)
    nan = math.nan
    assert live.n2k.write_course_and_speed(1, nan, nan)[2:6] == b"\xff" * 4
    assert live.n2k.write_rate_of_turn(1, nan)[1:5] == b"\xff\xff\xff\x7f"
    assert live.n2k.write_cross_track(1, None)[1] >> 6 == 1


def test_an_identifier_and_its_parts():
    for pgn, target in ((129029, 255), (129284, 255), (59904, 33), (60928, 33), (126208, 33)):
        assert frame_of(identifier_of(pgn, 17, 33, 5), b"12") == Frame(pgn, 17, target, 5, b"12")
    assert identifier_of(129025, 1, priority=2) == 0x09F80101
    assert identifier_of(129025, 1) == 0x0DF80101, "priority 3"


def test_messages_over_several_frames():
    payload, joiner = gnss(54.0, 10.0), Joiner()
    splitter = Splitter()
    parts = splitter.parts(129029, payload)
    assert parts == split(payload, sequence=0)
    for sequence in (1, 2, 3, 4, 5, 6, 7, 0):
        assert splitter.parts(129029, payload) == split(payload, sequence=sequence)
    found = [joiner.add(Frame(129029, 5, 255, 3, part)) for part in parts]
    assert found[:-1] == [None] * (len(parts) - 1) and found[-1] == payload
    missing = [part for k, part in enumerate(parts) if k != 2]
    assert [joiner.add(Frame(129029, 5, 255, 3, part)) for part in missing] == [None] * len(missing)
    assert joiner.lost == 1
    for _ in range(2):  # begun twice
        joiner.add(Frame(129029, 5, 255, 3, parts[0]))
    assert joiner.lost == 3 and joiner.add(Frame(129029, 5, 255, 3, b"\x01")) is None
    for source in range(100, 164):  # more than are kept
        joiner.add(Frame(129029, source, 255, 3, parts[0]))
    assert [joiner.add(Frame(129029, 5, 255, 3, part)) for part in parts[1:]] == [None] * (len(parts) - 1)
    assert [joiner.add(Frame(129029, 100, 255, 3, part)) for part in parts[1:]][-1] == payload


def claimed(name, source):
    return Frame(live.CLAIM, source, 255, 6, struct.pack("<Q", name))


def test_the_lower_name_keeps_the_address():
    claim = live.AddressClaim(100, 40)
    assert not claim.holds(0.0)
    assert claim.begin(0.0) == [(live.CLAIM, struct.pack("<Q", 100))] and not claim.holds(0.2) and claim.holds(0.3)
    assert claim.receive(claimed(200, 40), 1.0) and claim.address == 40 and claim.holds(1.0)
    assert claim.receive(claimed(50, 40), 2.0) and claim.address == 41 and not claim.holds(2.1)
    assert claim.receive(claimed(50, 39), 3.0) == [] and claim.receive(claimed(100, 41), 3.0) == []
    request = Frame(live.REQUEST, 3, 255, 6, live.CLAIM.to_bytes(3, "little"))
    assert claim.receive(request, 3.0) == [(live.CLAIM, struct.pack("<Q", 100))]
    for address in [*range(41, 252), *range(41)]:
        claim.receive(claimed(50, address), 4.0)
    assert claim.address == live.NO_ADDRESS and not claim.holds(100.0)
    assert live.name_of(1 << 40 | 5) & 0x1FFFFF == 5 and live.name_of(5) >> 63 == 1


def test_a_bus_in_and_out():
    can = pytest.importorskip("can", reason="python-can is not installed")
    text = "n2k:steerway-test?interface=virtual"
    ((address,), _) = live.addresses.sources([text])
    device = live.addresses.opened(address, 1)
    output, link = live.addresses.output(text, live.Context(inputs=[device]))
    assert output is link is device
    kept, received = Kept(), []
    service = live.Service(live.Navigator("small-usv", sources=("src 9",)), [kept, device], 50.0)
    ready = live.Order(live.State.READY, course=1.0)
    running = live.Order(live.State.RUNNING, engaged=True, course=1.0, yaw_rate=0.1)

    async def run():
        with can.Bus(interface="virtual", channel="steerway-test") as other:

            def send(identifier, data):
                other.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=True))

            async with under_way(service.run([device], [device])):
                await asyncio.sleep(0.1)
                for k in range(110):
                    if k < 40:
                        send(identifier_of(129025, 9, priority=2), position(54.0 + 3e-6 * k, 10.0))
                    if k == 20:  # another device with a lower NAME claims the address
                        send(identifier_of(live.CLAIM, device.claim.address, priority=6), struct.pack("<Q", 1))
                    await asyncio.sleep(0.05 if k < 40 else 0.005)
                    assert k > 60 or 127237 not in {frame.pgn for frame in received}
                    device.tick(ROW._replace(time=1.7e9 + 0.05 * k), LEG, ready if k < 60 else running)
                    while (message := other.recv(0.0)) is not None:
                        received.append(frame_of(message.arbitration_id, message.data))

    began = time.time()
    asyncio.run(run())
    assert len(kept.fixes) >= 30
    first, last = kept.fixes[-21], kept.fixes[-1]
    assert last.sog == pytest.approx(6.37e6 * (last.latitude - first.latitude) / (last.time - first.time), rel=0.3)
    assert began - 1.0 < kept.fixes[0].time < time.time() + 1.0
    kinds = {frame.pgn for frame in received}
    assert kinds == {live.CLAIM, 129026, 127251, 129283, 129284, 127237}
    assert {frame.source for frame in received if frame.pgn == 129026} == {40, 41}


def test_a_gateway_in_and_out():
    port, received, kept = free_port(), [], Kept()
    ((address,), _) = live.addresses.sources([f"n2k+tcp://127.0.0.1:{port}"])
    device = live.N2kDevice(address)

    async def gateway(reader, writer):
        async def read():
            while line := await reader.readline():
                received.append(line)

        task = asyncio.create_task(read())
        writer.write(b"garbage\r\n12:00:00.000 R 0G 00\r\n12:00:00.000 T 09F80109 00 00 00 00 00 00 00 00\r\n")
        for k in range(30):
            data = position(54.0 + 3e-6 * k, 10.0).hex(" ").upper()
            writer.write(f"12:00:00.000 R {identifier_of(129025, 9, priority=2):08X} {data}\r\n".encode())
            await asyncio.sleep(0.04)
            device.tick(ROW._replace(time=1.7e9 + 0.05 * k))
        task.cancel()

    async def run():
        service = live.Service(live.Navigator("small-usv"), [kept], 50.0)
        async with await asyncio.start_server(gateway, "127.0.0.1", port):
            async with under_way(service.run([device])):
                await until(lambda: len(kept.fixes) >= 25, 10.0)

    hastened.run(run())
    assert any(line.startswith(f"{identifier_of(129026, 40, priority=2):08X} ".encode()) for line in received)
