"""Listeners: serial, TCP, UDP, gpsd and Signal K."""

import asyncio
import json

from steerway.live.decoding import SUBSCRIBED, GpsdDecoder, ReceiverDecoder, SignalKDecoder
from steerway.live.links.listening import Ear, Hear, kept_open
from steerway.live.links.serial import opened
from steerway.live.uri import Uri

_PIECE = 4096
_WATCH = b'?WATCH={"enable":true,"json":true}\n'


class Listener:
    """One link to listen to. `place` is put behind the names of its sources where there are several links."""

    def __init__(self, uri: Uri, place: str = ""):
        self.uri, self.place = uri, place

    async def run(self, hear: Hear) -> None:
        """Listen until cancelled."""
        ear = Ear(self._decoder(), hear)
        try:
            await kept_open(self.uri.text, lambda: self._listen(ear))
        finally:
            ear.settle()

    def _decoder(self):
        return ReceiverDecoder(self.place)

    async def _listen(self, ear):
        raise NotImplementedError


class SerialListener(Listener):
    """What a receiver tells on a serial line."""

    async def _listen(self, ear):
        with opened(self.uri) as port:
            reader = asyncio.StreamReader()
            loop = asyncio.get_running_loop()
            transport, _ = await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), port)
            try:
                while data := await reader.read(_PIECE):
                    ear.feed(data)
            finally:
                transport.close()


class TcpListener(Listener):
    """What a TCP server tells."""

    greeting = b""

    async def _listen(self, ear):
        reader, writer = await asyncio.open_connection(self.uri.host, self.uri.port)
        try:
            writer.write(self.greeting)
            while data := await reader.read(_PIECE):
                ear.feed(data)
        finally:
            writer.close()


class GpsdListener(TcpListener):
    """Reports of gpsd."""

    greeting = _WATCH

    def _decoder(self):
        return GpsdDecoder()


class UdpListener(Listener):
    """Datagrams."""

    async def _listen(self, ear):
        class Datagrams(asyncio.DatagramProtocol):
            def datagram_received(self, data, addr):
                lacks_end = data.startswith((b"$", b"!", b"\\")) and not data.endswith(b"\n")
                ear.feed(data + b"\r\n" if lacks_end else data)

        loop = asyncio.get_running_loop()
        here = (self.uri.host or "0.0.0.0", self.uri.port)
        transport, _ = await loop.create_datagram_endpoint(Datagrams, local_addr=here)
        try:
            await asyncio.Event().wait()
        finally:
            transport.close()


class SignalKListener(Listener):
    """Deltas of a Signal K server, of the own vessel."""

    def _decoder(self):
        return SignalKDecoder()

    async def _listen(self, ear):
        from steerway.live.links.signalk import connected

        wanted = [{"path": path, "policy": "instant"} for path in SUBSCRIBED]
        async with connected(self.uri) as socket:
            await socket.send(json.dumps({"context": "vessels.self", "subscribe": wanted}))
            async for message in socket:
                ear.pass_on(ear.decoder.message(message))
