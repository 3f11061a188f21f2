"""A link that carries MAVLink both ways: UDP, TCP or a serial line. Sending never waits for the peer."""

import asyncio
import contextlib
import os
from collections.abc import Callable

from steerway.live.base.uri import Uri
from steerway.live.links.link import PIECE, kept_open
from steerway.live.links.serial import opened
from steerway.live.links.udp import Datagrams
from steerway.live.mavlink.dialect import dialect
from steerway.live.mavlink.signing import sign

_BACKLOG = 1 << 14  # bytes that may wait for a TCP peer


class MavlinkLink:
    """One link and the codec on it. `system` and `component` are the sender's in what is sent.

    `udpin` waits for packets and answers the sender of the last accepted one, `udpout` sends first. `receive` gets
    every message and returns whether it is accepted; what is no message is counted in `broken`, what could not be sent
    in `lost`.
    """

    def __init__(self, uri: Uri, receive: Callable[[object], bool], system: int = 1, component: int = 1):
        self.uri, self.receive = uri, receive
        self.messages = dialect(uri.text)
        self._codec = self.messages.MAVLink(None, system, component)
        self._codec.robust_parsing = True
        self._write: Callable[[bytes], None] | None = None
        self.lost = 0
        self.broken = 0

    @property
    def system(self) -> int:
        """The sender's system id."""
        return self._codec.srcSystem

    @system.setter
    def system(self, number: int):
        self._codec.srcSystem = number

    def sign(self, key: bytes) -> None:
        """Sign what is sent, and accept only what is signed with the same key; the rest counts as `broken`."""
        sign(self._codec, key)

    def send(self, messages) -> None:
        """Send messages of the dialect, or lose them."""
        for message in messages:
            packet = message.pack(self._codec)
            self._codec.seq = (self._codec.seq + 1) % 256
            if self._write is None:
                self.lost += 1
                continue
            try:
                self._write(packet)
            except OSError:
                self.lost += 1

    async def run(self) -> None:
        """Keep the link open until cancelled."""
        opens = {"udpin": self._udp, "udpout": self._udp, "tcp": self._tcp, "": self._serial}
        try:
            await kept_open(self.uri.text, opens[self.uri.via])
        finally:
            self._write = None

    def _feed(self, data):
        """Whether any of the messages in a piece is accepted."""
        accepted = False
        for message in self._codec.parse_buffer(data) or ():
            if message.get_type() == "BAD_DATA":
                self.broken += 1
            else:
                accepted |= self.receive(message)
        return accepted

    def _begin(self):
        """A datagram holds whole packets: what another sender left unfinished is no part of it."""
        self._codec.buf, self._codec.buf_index = bytearray(), 0
        self._codec.expected_length = self.messages.HEADER_LEN_V1 + 2
        self._codec.have_prefix_error = False

    async def _udp(self):
        link, sends_first = self, self.uri.via == "udpout"

        def receive(data, address):
            link._begin()
            if link._feed(data) and not sends_first:
                link._write = lambda packet: transport.sendto(packet, address)

        there = (self.uri.host or "127.0.0.1", self.uri.port)
        ends = {"remote_addr": there} if sends_first else {"local_addr": there}
        transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(lambda: Datagrams(receive), **ends)
        if sends_first:
            self._write = transport.sendto
        await self._until_gone(asyncio.Event().wait(), transport)

    async def _tcp(self):
        reader, writer = await asyncio.open_connection(self.uri.host or "127.0.0.1", self.uri.port)

        def write(packet):
            if writer.transport.get_write_buffer_size() > _BACKLOG:
                raise OSError
            writer.write(packet)

        async def read():
            while data := await reader.read(PIECE):
                self._feed(data)

        self._write = write
        await self._until_gone(read(), writer)

    async def _serial(self):
        loop, gone = asyncio.get_running_loop(), asyncio.get_running_loop().create_future()
        with opened(self.uri) as port:
            file = port.fileno()

            def read():
                try:
                    data = os.read(file, PIECE)
                except BlockingIOError:
                    return
                except OSError as error:
                    data = b""
                    if not gone.done():
                        gone.set_exception(error)
                if data:
                    self._feed(data)
                elif not gone.done():
                    gone.set_result(None)

            loop.add_reader(file, read)
            self._write = lambda packet: os.write(file, packet)
            try:
                await gone
            finally:
                self._write = None
                loop.remove_reader(file)

    async def _until_gone(self, gone, transport):
        try:
            await gone
        finally:
            self._write = None
            with contextlib.suppress(OSError):
                transport.close()
