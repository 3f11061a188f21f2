"""Foreign senders on a MAVLink port; the Signal K plugin without its token, after a line `null`, and restarted."""

import asyncio
import json
import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from steerway.live.testing import Guided, MavlinkLink, addresses
from tests.mavlink_wire import Wire, signed
from tests.mavlink_wire import messages as m
from tests.ports import free_port, under_way

PLUGIN = Path(__file__).parents[1] / "integrations" / "signalk" / "index.js"
NODE = shutil.which("node")
KEY = bytes(range(32))
BEGINNINGS = (b"\xfd\xff\x00\x00\x00\x01\x01\x00\x00\x00", b"\xfe\xff\x00\x01\x01\x00\x00\x00\x00\x00", b"garbage!!!")


@pytest.mark.parametrize("is_signed", [True, False])
@pytest.mark.parametrize("stranger", BEGINNINGS)
def test_a_stranger_costs_no_message_of_the_vehicle(is_signed, stranger, tmp_path):
    """A stranger sends ten bytes, such as the start of an incomplete packet, before every fifth datagram."""
    port = free_port(socket.SOCK_DGRAM)
    heard = []
    (tmp_path / "key").write_text(KEY.hex())
    key = f"?signing={tmp_path / 'key'}" if is_signed else ""
    (uri,), _ = addresses.sources([f"mavlink:udpin:127.0.0.1:{port}{key}"])
    link = MavlinkLink(uri, lambda message: heard.append(message.get_type()) or True)
    vehicle = m.MAVLink(None, 1, 1)
    if is_signed:
        signed(vehicle, KEY)

    async def talk():
        async with under_way(link.run()):
            await asyncio.sleep(0.1)
            with (
                socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here,
                socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there,
            ):
                for k in range(500):
                    if k % 5 == 0:
                        there.sendto(stranger, ("127.0.0.1", port))
                    message = m.MAVLink_system_time_message(k + 1, k)
                    here.sendto(message.pack(vehicle), ("127.0.0.1", port))
                    vehicle.seq = (vehicle.seq + 1) % 256
                    await asyncio.sleep(0.0)
            await asyncio.sleep(0.2)

    asyncio.run(talk())
    assert heard == ["SYSTEM_TIME"] * 500


def test_a_signed_packet_that_is_sent_again_is_dropped(tmp_path):
    heard = []
    (tmp_path / "key").write_text(KEY.hex())
    (uri,), _ = addresses.sources([f"mavlink:udpin:127.0.0.1:1?signing={tmp_path / 'key'}"])
    link = MavlinkLink(uri, lambda message: heard.append(message.get_type()) or True)
    packet = m.MAVLink_system_time_message(1, 2).pack(signed(m.MAVLink(None, 1, 1), KEY))
    for _ in range(3):
        link._feed(packet)
    assert heard == ["SYSTEM_TIME"] and link.broken == 2


def heartbeat(system, kind):
    (message,) = Wire(system, 1).carry([m.MAVLink_heartbeat_message(kind, 3, 0, 0, 0, 3)])
    return message


def test_a_boat_takes_the_place_of_a_drone_and_of_a_silent_boat_and_no_drone_that_of_a_boat():
    guided, boat, drone = Guided(m), m.MAV_TYPE_SURFACE_BOAT, m.MAV_TYPE_QUADROTOR
    guided.receive(heartbeat(7, drone), 0.0)
    assert guided.vehicle == (7, 1)
    guided.receive(heartbeat(3, boat), 0.5)
    assert guided.vehicle == (7, 1)  # after one heartbeat
    guided.receive(heartbeat(3, boat), 1.5)
    assert guided.vehicle == (3, 1) and guided.is_rover
    for k in range(20):
        guided.receive(heartbeat(3, boat), 2.0 + k)
        assert not guided.receive(heartbeat(7, drone), 2.1 + k)
        assert not guided.receive(heartbeat(8, boat), 2.2 + k)
    assert guided.vehicle == (3, 1)
    for k in range(3):
        guided.receive(heartbeat(4, boat), 30.0 + k)
    assert guided.vehicle == (4, 1) and guided.alive(32.0)
    waiting = Guided(m, system=5)
    for k in range(3):
        waiting.receive(heartbeat(3, boat), float(k))
    assert waiting.vehicle is None


SCRIPT = """
const net = require('net')
const plugin = require(process.argv[1])
const said = []
let connections = 0
const open = new Set()
const server = net.createServer((client) => {
  connections += 1
  open.add(client)
  client.on('error', () => {})
  client.resume()
  client.on('close', () => open.delete(client))
  client.write('null\\n5\\n"text"\\n{"state": {"state": "ready", "engaged": false}}\\n')
})
server.listen(0, '127.0.0.1', async () => {
  const port = server.address().port
  const app = { setPluginError: (each) => said.push(each), setPluginStatus: (each) => said.push(each),
                autopilotUpdate: () => {}, registerAutopilotProvider: () => {} }
  const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms))
  const one = plugin(app)
  one.start({ port, tokenFile: '/missing/token' })
  await pause(50)
  const without = connections
  one.stop()
  one.start({ port, token: 'correct' })
  await pause(50)
  one.stop()
  one.start({ port, token: 'correct' })
  await pause(1500)
  console.log(JSON.stringify({ said, without, open: open.size, connections }))
  process.exit(0)
})
"""


@pytest.mark.skipif(NODE is None, reason="needs node")
def test_the_plugin_outlives_a_missing_token_file_null_and_a_second_start():
    done = subprocess.run([NODE, "-e", SCRIPT, str(PLUGIN)], capture_output=True, text=True, timeout=20.0)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["without"] == 0 and found["said"][0] == "token file /missing/token cannot be read: ENOENT"
    assert "connected to Steerway" in found["said"]
    assert found["open"] == 1 and found["connections"] == 2
