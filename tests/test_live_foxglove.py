"""What a Foxglove client receives over its WebSocket."""

import asyncio
import json
import math
import struct

import pytest

from steerway.core import OK
from steerway.live.testing import Row, addresses, json_line, lost
from steerway.live.testing import foxglove as link
from tests.ports import free_port, under_way

pytest.importorskip("foxglove", reason="foxglove-sdk is not installed: pip install steerway[foxglove]")
from foxglove.messages import LocationFix, LocationFixPositionCovarianceType, Timestamp, Vector3

connect = pytest.importorskip("websockets.asyncio.client", reason="websockets is not installed").connect

NOON = 1_719_835_200.0
ROW = Row(NOON, math.radians(54.5), math.radians(-10.25), 2.0, -math.pi / 6.0, 0.01, 0.1, 0.02, 0.01, 0.3, 0.3, 1.2, OK)


async def by_client(rows, wanted, period=0.1):
    """Subscribe to all topics, output rows and receive `wanted` messages: a list of (topic, moment, payload)."""
    text = f"foxglove://127.0.0.1:{free_port()}?period={period}"
    output, server = addresses.output(text)
    async with under_way(server.run()), asyncio.timeout(10.0):
        return await _read(text.partition("?")[0].replace("foxglove", "ws"), output, rows, wanted)


async def _read(address, output, rows, wanted):
    for _ in range(100):
        try:
            socket = await connect(address, subprotocols=["foxglove.sdk.v1"])
            break
        except OSError:
            await asyncio.sleep(0.05)
    async with socket:
        info = json.loads(await socket.recv())
        assert info["op"] == "serverInfo" and info["capabilities"] == []  # clients cannot send anything
        channels = {}
        while len(channels) < 2:
            message = json.loads(await socket.recv())
            if message["op"] == "advertise":
                channels |= {each["id"]: each for each in message["channels"]}
        wishes = [{"id": 100 + name, "channelId": name} for name in channels]
        await socket.send(json.dumps({"op": "subscribe", "subscriptions": wishes}))
        await asyncio.sleep(0.2)
        for row in rows:
            output.tick(row)
        received = []
        while len(received) < wanted:
            message = await socket.recv()
            if isinstance(message, bytes) and message[0] == 1:
                name, moment = struct.unpack_from("<IQ", message, 1)
                received.append((channels[name - 100]["topic"], moment, message[13:]))
        return channels.values(), received


def test_a_client_reads_position_and_estimate():
    channels, received = asyncio.run(by_client([ROW], 2))
    by_topic = {each["topic"]: each for each in channels}
    assert by_topic[link.POSITION]["schemaName"] == "foxglove.LocationFix"
    assert by_topic[link.POSITION]["encoding"] == "protobuf" and by_topic[link.ESTIMATE]["encoding"] == "json"
    schema = json.loads(by_topic[link.ESTIMATE]["schema"])
    given = {topic: payload for topic, _, payload in received}
    assert {moment for _, moment, _ in received} == {1_719_835_200_000_000_000}

    assert json.loads(given[link.ESTIMATE]) == json.loads(json_line(ROW))
    assert set(json.loads(given[link.ESTIMATE])) <= set(schema["properties"])

    east, north = ROW.sog * math.sin(ROW.cog), ROW.sog * math.cos(ROW.cog)
    variance, unknown = ROW.position_std**2, math.nan  # the height
    assert (
        given[link.POSITION]
        == LocationFix(
            timestamp=Timestamp(1_719_835_200, 0),
            frame_id="boat",
            latitude=math.degrees(ROW.latitude),
            longitude=math.degrees(ROW.longitude),
            altitude=unknown,
            position_covariance=[variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, unknown],
            position_covariance_type=LocationFixPositionCovarianceType.Approximated,
            velocity=Vector3(x=east, y=north, z=0.0),
        ).encode()
    )


def test_once_a_period_and_nothing_false():
    rows = [ROW._replace(time=NOON + 0.02 * k) for k in range(50)] + [lost(NOON + 1.0), lost(NOON + 1.02)]
    _, received = asyncio.run(by_client(rows, 21))
    topics = [topic for topic, *_ in received]
    assert topics.count(link.POSITION) == 10 and topics.count(link.ESTIMATE) == 11  # including one with status "lost"
    _, received = asyncio.run(by_client([lost(math.nan), lost(NOON)], 1))
    ((topic, _, payload),) = received
    assert topic == link.ESTIMATE and json.loads(payload)["sog_mps"] is None
