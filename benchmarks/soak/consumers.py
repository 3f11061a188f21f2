"""Consumers of the outputs of the boat: one an output, each reads everything and keeps none of it."""

import asyncio
import contextlib
import json
import socket
from contextlib import asynccontextmanager

GUIDED = 15  # custom_mode of ArduPilot's Rover


def free_port(kind=socket.SOCK_STREAM) -> int:
    """A port that nobody uses."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Consumer:
    """`arguments` for the command, and `received`, the bytes that came."""

    def __init__(self, name: str, arguments: list[str]):
        self.name, self.arguments, self.received = name, arguments, 0
        self.connected = asyncio.Event()

    @asynccontextmanager
    async def listening(self):
        """While this is entered, what comes is read."""
        yield


class Client(Consumer):
    """One that opens the connection itself."""

    @asynccontextmanager
    async def listening(self):
        """See Consumer."""
        task = asyncio.create_task(self._listen())
        try:
            yield
        finally:
            task.cancel()

    async def _listen(self):
        """For as long as it lasts."""
        raise NotImplementedError


class Instrument(Client):
    """Sentences over TCP."""

    def __init__(self):
        self._port = free_port()
        super().__init__("tcp-server", ["--to", f"tcp-server://127.0.0.1:{self._port}?period=0.1"])

    async def _listen(self):
        while True:
            try:
                reader, _ = await asyncio.open_connection("127.0.0.1", self._port)
                self.connected.set()
                while data := await reader.read(4096):
                    self.received += len(data)
            except OSError:
                pass
            await asyncio.sleep(0.2)


class Datagrams(Consumer):
    """Something said over UDP."""

    def __init__(self, name: str, address: str):
        self._port = free_port(socket.SOCK_DGRAM)
        super().__init__(name, ["--to", address.format(port=self._port)])

    def answered(self, transport, address) -> None:
        """A datagram came from there: it may be answered."""

    @asynccontextmanager
    async def listening(self):
        """See Consumer."""
        consumer = self

        class Ear(asyncio.DatagramProtocol):
            def connection_made(self, transport):
                self._transport = transport

            def datagram_received(self, data, addr):
                consumer.received += len(data)
                consumer.answered(self._transport, addr)

        here = ("127.0.0.1", self._port)
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(Ear, local_addr=here)
        try:
            yield
        finally:
            transport.close()


class Vehicle(Datagrams):
    """Says by MAVLink that it is there, armed and in GUIDED, and takes its commands."""

    def __init__(self):
        super().__init__("mavlink", "mavlink:udpout:127.0.0.1:{port}")

        self._companion = None

    def answered(self, transport, address) -> None:
        """See Datagrams."""
        self._companion = transport, address

    @asynccontextmanager
    async def listening(self):
        """See Consumer."""
        task = asyncio.create_task(self._beat())
        try:
            async with super().listening():
                yield
        finally:
            task.cancel()

    async def _beat(self):
        while True:
            if self._companion is not None:
                transport, address = self._companion
                transport.sendto(_heartbeat(), address)
            await asyncio.sleep(0.2)


def _heartbeat():
    from pymavlink.dialects.v20 import ardupilotmega as messages

    vehicle = messages.MAVLink(None, srcSystem=1, srcComponent=1)
    mode = messages.MAV_MODE_FLAG_SAFETY_ARMED | messages.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    output = vehicle.heartbeat_encode(
        messages.MAV_TYPE_SURFACE_BOAT, messages.MAV_AUTOPILOT_ARDUPILOTMEGA, mode, GUIDED, messages.MAV_STATE_ACTIVE
    )
    return output.pack(vehicle)


class SignalK(Consumer):
    """A WebSocket server that takes deltas as a Signal K server does."""

    def __init__(self):
        self._port = free_port()
        super().__init__("signalk", ["--to", f"signalk://127.0.0.1:{self._port}?period=0.1"])

    @asynccontextmanager
    async def listening(self):
        """See Consumer."""
        from websockets.asyncio.server import serve
        from websockets.exceptions import ConnectionClosed

        async def take(socket):
            with contextlib.suppress(ConnectionClosed):
                async for message in socket:
                    self.received += len(message)

        async with serve(take, "127.0.0.1", self._port):
            yield


class Foxglove(Client):
    """A viewer on the Foxglove WebSocket that subscribes to all there is."""

    def __init__(self):
        self._port = free_port()
        super().__init__("foxglove", ["--to", f"foxglove://127.0.0.1:{self._port}"])

    async def _listen(self):
        from websockets.asyncio.client import connect
        from websockets.exceptions import WebSocketException

        while True:
            with contextlib.suppress(OSError, WebSocketException):
                async with connect(f"ws://127.0.0.1:{self._port}", subprotocols=["foxglove.sdk.v1"]) as viewer:
                    async for message in viewer:
                        self.received += len(message)
                        if isinstance(message, str) and '"advertise"' in message:
                            await viewer.send(_subscription(json.loads(message)["channels"]))
            await asyncio.sleep(0.2)


def _subscription(channels):
    wanted = [{"id": each["id"], "channelId": each["id"]} for each in channels]
    return json.dumps({"op": "subscribe", "subscriptions": wanted})


def consumers(table: str, route: str) -> list[Consumer]:
    """One of every output that there is; `table` is where the run is to be written, `route` one to follow."""
    return [
        Instrument(),
        Datagrams("udp", "udp://127.0.0.1:{port}?period=0.1"),
        Datagrams("propellers", "udp://127.0.0.1:{port}?format=propellers"),
        Vehicle(),
        SignalK(),
        Foxglove(),
        Consumer("table", ["--to", f"file:{table}"]),
        Consumer("route", ["--mission", route, "--engage"]),
        Consumer("helm", ["--helm", f"127.0.0.1:{free_port()}"]),
    ]
