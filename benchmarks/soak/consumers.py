"""Consumers of the service's outputs, one per output; each reads and drops everything."""

import asyncio
import contextlib
import json
import socket
from collections.abc import Awaitable, Callable
from contextlib import asynccontextmanager

from tests.ports import free_port

GUIDED = 15  # custom_mode of ArduPilot's Rover
HERE = "127.0.0.1"


class Consumer:
    """One consumer. `arguments`: for the command; `received`: bytes so far; `listen(consumer, port)` receives."""

    def __init__(
        self,
        name: str,
        option: str,
        value: str,
        listen: Callable[["Consumer", int], Awaitable[None]] | None = None,
        kind=socket.SOCK_STREAM,
        more=(),
    ):
        self._port, self._listen = free_port(kind), listen
        self.name, self.arguments, self.received = name, [option, value.format(port=self._port), *more], 0
        self.connected = asyncio.Event()

    @asynccontextmanager
    async def listening(self):
        """Receive while the context is open."""
        task = asyncio.create_task(self._listen(self, self._port)) if self._listen else None
        try:
            yield
        finally:
            if task:
                task.cancel()


async def _sentences(consumer, port):
    """A client over TCP."""
    while True:
        with contextlib.suppress(OSError):
            reader, _ = await asyncio.open_connection(HERE, port)
            consumer.connected.set()
            while data := await reader.read(4096):
                consumer.received += len(data)
        await asyncio.sleep(0.2)


async def _datagrams(consumer, port, answer=None):
    """Receive datagrams over UDP, and send `answer` to the last sender five times a second."""
    companion = None

    class Ear(asyncio.DatagramProtocol):
        def datagram_received(self, data, addr):
            nonlocal companion
            consumer.received += len(data)
            companion = addr

    transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(Ear, local_addr=(HERE, port))
    with contextlib.closing(transport):
        while True:
            if companion and answer:
                transport.sendto(answer(), companion)
            await asyncio.sleep(0.2)


async def _vehicle(consumer, port):
    """A MAVLink vehicle: sends heartbeats (armed, GUIDED) and receives commands."""
    from pymavlink.dialects.v20 import ardupilotmega as messages

    vehicle = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    mode = messages.MAV_MODE_FLAG_SAFETY_ARMED | messages.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    kind, pilot = messages.MAV_TYPE_SURFACE_BOAT, messages.MAV_AUTOPILOT_ARDUPILOTMEGA

    def heartbeat():
        return vehicle.heartbeat_encode(kind, pilot, mode, GUIDED, messages.MAV_STATE_ACTIVE).pack(vehicle)

    await _datagrams(consumer, port, heartbeat)


async def _signalk(consumer, port):
    """A WebSocket server that receives deltas as a Signal K server does."""
    from websockets.asyncio.server import serve
    from websockets.exceptions import ConnectionClosed

    async def take(socket):
        with contextlib.suppress(ConnectionClosed):
            async for message in socket:
                consumer.received += len(message)

    async with serve(take, HERE, port):
        await asyncio.Event().wait()


async def _foxglove(consumer, port):
    """A viewer on the Foxglove WebSocket that subscribes to every channel."""
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    while True:
        with contextlib.suppress(OSError, WebSocketException):
            async with connect(f"ws://{HERE}:{port}", subprotocols=["foxglove.sdk.v1"]) as viewer:
                async for message in viewer:
                    consumer.received += len(message)
                    if isinstance(message, str) and '"advertise"' in message:
                        wanted = [
                            {"id": each["id"], "channelId": each["id"]} for each in json.loads(message)["channels"]
                        ]
                        await viewer.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        await asyncio.sleep(0.2)


def consumers(table: str, route: str) -> list[Consumer]:
    """A consumer for every output. `table`: path of the run's table; `route`: path of a mission file."""
    udp, to = socket.SOCK_DGRAM, "--to"
    return [
        Consumer("tcp-server", to, f"tcp-server://{HERE}:{{port}}?period=0.1", _sentences),
        Consumer("udp", to, f"udp://{HERE}:{{port}}?period=0.1", _datagrams, udp),
        Consumer("propellers", to, f"udp://{HERE}:{{port}}?format=propellers", _datagrams, udp),
        Consumer("mavlink", to, f"mavlink:udpout:{HERE}:{{port}}", _vehicle, udp),
        Consumer("signalk", to, f"signalk://{HERE}:{{port}}?period=0.1", _signalk),
        Consumer("foxglove", to, f"foxglove://{HERE}:{{port}}", _foxglove),
        Consumer("table", to, f"file:{table}"),
        Consumer("route", "--mission", route, more=["--engage"]),
        Consumer("helm", "--helm", f"{HERE}:{{port}}"),
    ]
