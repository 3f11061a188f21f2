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
from steerway.live.uri import Uri

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
        host, loop = self.uri.host or "127.0.0.1", asyncio.get_running_loop()
        there, peer = (host, self.uri.port), _Peer(self)
        if self.kind == "serial":
            return await self._serial(peer)
        if self.kind == "tcp-server":
            async with await loop.create_server(lambda: _Peer(self), *there) as server:
                await server.serve_forever()
        transport: asyncio.BaseTransport
        if self.kind == "tcp":
            transport, _ = await loop.create_connection(lambda: peer, *there)
        elif self.kind == "udpout":
            transport, _ = await loop.create_datagram_endpoint(lambda: _Datagrams(self), remote_addr=there)
        else:
            here = self.uri.host or "0.0.0.0", self.uri.port
            transport, _ = await loop.create_datagram_endpoint(lambda: _Datagrams(self), local_addr=here)
        return await self._until_gone(peer.gone, transport)

    def close(self) -> None:
        """Close every connection."""
        for peer in self.peers:
            peer.close()

    async def _serial(self, peer: "_Peer") -> None:
        loop = asyncio.get_running_loop()
        with opened(self.uri) as port:
            writing = os.fdopen(os.dup(port.fileno()), "wb", buffering=0)
            transport, _ = await loop.connect_write_pipe(lambda: peer, writing)
            reading = None
            try:
                if self.receive is not None:
                    reading, _ = await loop.connect_read_pipe(lambda: _Reader(peer), port)
                await self._until_gone(peer.gone, transport)
            finally:
                if reading is not None:
                    reading.close()

    async def _until_gone(self, gone: asyncio.Future[None], transport: Any) -> None:
        try:
            await gone
        finally:
            self.peers.discard(transport)
            with contextlib.suppress(OSError):
                transport.close()


class _Peer(asyncio.Protocol):
    """One connection."""

    def __init__(self, owner: Transport) -> None:
        self.owner = owner
        self.gone: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def connection_made(self, transport: Any) -> None:
        self.transport = transport
        self.owner.peers.add(transport)
        self.owner.opened()

    def data_received(self, data: bytes) -> None:
        if self.owner.receive is None:
            return
        try:
            self.owner.receive(data, self.transport.write)
        except OSError as error:
            self.end(error)
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self.owner.peers.discard(self.transport)
        self.end(exc)

    def end(self, error: Exception | None) -> None:
        """The connection has ended, or failed."""
        if self.gone.done():
            return
        if error is None:
            self.gone.set_result(None)
        else:
            self.gone.set_exception(error)
            self.gone.exception()  # marked as read: nobody awaits a server's client


class _Reader(asyncio.Protocol):
    """Passes data received on a serial line to the peer that writes to it."""

    def __init__(self, peer: "_Peer") -> None:
        self._peer = peer

    def data_received(self, data: bytes) -> None:
        self._peer.data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._peer.end(exc)


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
