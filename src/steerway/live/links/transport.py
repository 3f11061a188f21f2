"""Transports of bytes in both directions (TCP, UDP datagrams, a serial line), and the inputs and sinks that use them.

Writing never waits for a peer.
"""

import asyncio
import contextlib
import io
import os
import socket
import termios
import tty
from collections.abc import Callable
from functools import partial
from typing import Any

from steerway.core.errors import InputError
from steerway.live.links.decoding import ReceiverDecoder
from steerway.live.links.link import Feed, Input, Sink, kept_open
from steerway.live.uri import LOG, Uri

BACKLOG = 1 << 16
"""Largest number of bytes that wait for a peer."""
Write = Callable[[bytes], object]
Receive = Callable[[bytes, Write], None]
"""Takes received bytes and a function that writes to their sender. If it raises OSError, the connection ends."""
_SPEEDS: dict[float, int] = {
    int(name[1:]): value for name, value in vars(termios).items() if name[0] == "B" and name[1:].isdigit()
}


class Transport:
    """Connections to an address; every call of `open` makes a new one.

    kind: "tcp", "tcp-server", "udp" (receives datagrams), "udpout" (sends them) or "serial" (raw, eight bits, no
    parity, one stop bit). receive: takes received data; without it a serial line is not read, and data from other
    peers are dropped. opened: called for every new connection. backlog: bytes that may wait for a peer.
    """

    def __init__(
        self,
        uri: Uri,
        kind: str,
        receive: Receive | None = None,
        opened: Callable[[], object] = lambda: None,
        backlog: int = BACKLOG,
    ):
        self.uri, self.kind, self.receive = uri, kind, receive
        self.opened, self.backlog = opened, backlog
        self.peers: set[Any] = set()

    def write(self, message: bytes) -> bool:
        """Write a whole message to every peer; return whether all accepted it."""
        took = True
        for peer in list(self.peers):
            if peer.is_closing():
                self.peers.discard(peer)
            elif peer.get_write_buffer_size() > self.backlog:
                took = False
            else:
                peer.write(message)
        return took

    async def open(self) -> None:
        """Open the connection and keep it until it ends. Raises OSError if it fails."""
        there = self.uri.host or "127.0.0.1", self.uri.port
        if self.kind == "serial":
            await self._serial()
        elif self.kind == "tcp":
            reader, writer = await asyncio.open_connection(*there)
            await self._carry(reader, writer.transport)
        elif self.kind == "tcp-server":
            async with await asyncio.start_server(self._client, *there) as server:
                await server.serve_forever()
        else:
            here = self.uri.host or "0.0.0.0", self.uri.port
            ends = (None, there) if self.kind == "udpout" else (here, None)
            loop = asyncio.get_running_loop()
            transport, _ = await loop.create_datagram_endpoint(lambda: _Datagrams(self), *ends)
            try:
                await asyncio.Event().wait()
            finally:
                self.peers.discard(transport)
                transport.close()

    def close(self) -> None:
        """Close every connection."""
        for peer in self.peers:
            peer.close()

    async def _client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            await self._carry(reader, writer.transport)

    async def _serial(self) -> None:
        loop, reader = asyncio.get_running_loop(), asyncio.StreamReader()
        with opened(self.uri) as port:
            writing = os.fdopen(os.dup(port.fileno()), "wb", buffering=0)
            peer, _ = await loop.connect_write_pipe(lambda: _WriteEnd(reader), writing)
            reading = None
            try:
                if self.receive is not None:
                    reading, _ = await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), port)
                await self._carry(reader, peer)
            finally:
                if reading is not None:
                    reading.close()

    async def _carry(self, reader: asyncio.StreamReader, peer: asyncio.WriteTransport) -> None:
        """Receive from a peer, and write to it, until the connection ends."""
        self.peers.add(peer)
        self.opened()
        try:
            while data := await reader.read(BACKLOG):
                try:
                    if self.receive is not None:
                        self.receive(data, peer.write)
                except OSError:
                    raise
                except Exception:  # bad data from a link must not end the service
                    LOG.exception("%s: %d bytes cannot be used and are dropped", self.uri.text, len(data))
        finally:
            self.peers.discard(peer)
            with contextlib.suppress(OSError):
                peer.close()


class _WriteEnd(asyncio.BaseProtocol):
    """Ends the reader of a serial line that can no longer be written to."""

    def __init__(self, reader: asyncio.StreamReader) -> None:
        self._reader = reader

    def connection_lost(self, exc: Exception | None) -> None:
        if exc is None:
            self._reader.feed_eof()
        else:
            self._reader.set_exception(exc)


class _Datagrams(asyncio.DatagramProtocol):
    """A datagram socket; one of kind "udpout" is a peer, to which messages are written."""

    def __init__(self, owner: Transport) -> None:
        self.owner = owner

    def connection_made(self, transport: Any) -> None:
        self._transport = transport
        if self.owner.kind == "udpout":
            transport.write = transport.sendto
            self.owner.peers.add(transport)

    def datagram_received(self, data: bytes, addr: Any) -> None:
        if self.owner.receive is not None:
            self.owner.receive(data, lambda packet: self._transport.sendto(packet, addr))


def speed_of(uri: Uri) -> int:
    """The termios constant of an address' baud rate. Raises InputError for a rate that termios does not have."""
    baud = uri.number("baud", 38400)
    if baud not in _SPEEDS or not baud:
        usual = ", ".join(map(str, sorted(each for each in _SPEEDS if 4800 <= each <= 921600)))
        raise InputError(f"{uri.text}: baud is {baud:g}, expected one of {usual}")
    return _SPEEDS[baud]


def opened(uri: Uri) -> io.FileIO:
    """An unbuffered, non-blocking file on the port of an address, set to its speed."""
    descriptor = os.open(uri.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        tty.setraw(descriptor)
        settings = termios.tcgetattr(descriptor)
        settings[2] |= termios.CLOCAL | termios.CREAD
        settings[2] &= ~termios.CSTOPB
        settings[4] = settings[5] = speed_of(uri)
        termios.tcsetattr(descriptor, termios.TCSANOW, settings)
    except termios.error as error:
        os.close(descriptor)
        raise OSError(*error.args) from None
    return os.fdopen(descriptor, "r+b", buffering=0)


class StreamInput(Input[ReceiverDecoder]):
    """Reads the data at an address. A datagram of sentences that lacks a line end gets one."""

    def __init__(self, uri: Uri, place: str = "", kind: str = "tcp"):
        super().__init__(uri, place)
        self.kind = kind

    def _decoder(self) -> ReceiverDecoder:
        return ReceiverDecoder(self.place)

    async def _read(self, feed: Feed[ReceiverDecoder]) -> None:
        await Transport(self.uri, self.kind, partial(self._receive, feed)).open()

    def _receive(self, feed: Feed[ReceiverDecoder], data: bytes, answer: Write) -> None:
        if self.kind == "udp" and data.startswith((b"$", b"!", b"\\")) and not data.endswith(b"\n"):
            data += b"\r\n"
        feed.feed(data)


class StreamSink(Sink):
    """Writes to every peer of an address: the server, all clients, or the device on a serial line."""

    def __init__(self, uri: Uri, kind: str = "tcp"):
        super().__init__(uri)
        self.transport = Transport(uri, kind)

    @property
    def has_peer(self) -> bool:
        """Whether a peer is connected."""
        return bool(self.transport.peers)

    async def run(self) -> None:
        """See Sink."""
        await kept_open(self.transport.uri.text, self.transport.open)

    def send(self, message: bytes) -> None:
        """See Sink."""
        self.lost += not self.transport.write(message)

    def close(self) -> None:
        """See Sink."""
        self.transport.close()


class UdpSink(Sink):
    """Writes datagrams to one address, which may be a broadcast address; it needs no connection."""

    def __init__(self, uri: Uri):
        super().__init__(uri)
        self._to = (uri.host or "127.0.0.1", uri.port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, message: bytes) -> None:
        """See Sink."""
        try:
            self._socket.sendto(message, self._to)
        except OSError:
            self.lost += 1

    def close(self) -> None:
        """See Sink."""
        self._socket.close()
