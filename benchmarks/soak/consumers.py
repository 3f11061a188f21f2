"""Consumers of the outputs of the boat: one an output, each reads everything and keeps none of it."""

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
    """`arguments` for the command, and `received`, the bytes that came; `listen(consumer, port)` runs all the while."""

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
        """While this is entered, what comes is read."""
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
    """Something said over UDP; `answer` is sent five times a second to whoever spoke last."""
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
    """Says by MAVLink that it is there, armed and in GUIDED, and takes its commands."""
    from pymavlink.dialects.v20 import ardupilotmega as messages

    vehicle = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    mode = messages.MAV_MODE_FLAG_SAFETY_ARMED | messages.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    kind, pilot = messages.MAV_TYPE_SURFACE_BOAT, messages.MAV_AUTOPILOT_ARDUPILOTMEGA

    def heartbeat():
        return vehicle.heartbeat_encode(kind, pilot, mode, GUIDED, messages.MAV_STATE_ACTIVE).pack(vehicle)

    await _datagrams(consumer, port, heartbeat)


async def _signalk(consumer, port):
    """A WebSocket server that takes deltas as a Signal K server does."""
    from websockets.asyncio.server import serve
    from websockets.exceptions import ConnectionClosed

    async def take(socket):
        with contextlib.suppress(ConnectionClosed):
            async for message in socket:
                consumer.received += len(message)

    async with serve(take, HERE, port):
        await asyncio.Event().wait()


async def _foxglove(consumer, port):
    """A viewer on the Foxglove WebSocket that subscribes to all there is."""
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
    """One of every output that there is; `table` is where the run is to be written, `route` one to follow."""
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
