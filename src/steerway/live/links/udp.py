"""UDP datagrams in and out."""

import asyncio
import socket
from collections.abc import Callable

from steerway.live.base.uri import Uri
from steerway.live.links.link import Input, Sink


class Datagrams(asyncio.DatagramProtocol):
    """Gives `receive` every datagram with its sender's address."""

    def __init__(self, receive: Callable[[bytes, tuple], None]):
        self._receive = receive

    def datagram_received(self, data, addr):
        """See asyncio."""
        self._receive(data, addr)


async def received(receive: Callable[[bytes, tuple], None], here: tuple[str, int]) -> None:
    """Give `receive` what arrives at this address, until cancelled."""
    loop = asyncio.get_running_loop()
    transport, _ = await loop.create_datagram_endpoint(lambda: Datagrams(receive), local_addr=here)
    try:
        await asyncio.Event().wait()
    finally:
        transport.close()


class UdpInput(Input):
    """Reads datagrams; a sentence that lacks its line end gets one."""

    async def _read(self, feed):
        def receive(data, _):
            lacks_end = data.startswith((b"$", b"!", b"\\")) and not data.endswith(b"\n")
            feed.feed(data + b"\r\n" if lacks_end else data)

        await received(receive, (self.uri.host or "0.0.0.0", self.uri.port))


class UdpSink(Sink):
    """Writes datagrams to one address, or to all of a network."""

    def __init__(self, uri: Uri):
        super().__init__(uri)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, message: bytes) -> None:
        """See Sink."""
        try:
            self._socket.sendto(message, (self.uri.host or "127.0.0.1", self.uri.port))
        except OSError:
            self.lost += 1

    def close(self) -> None:
        """See Sink."""
        self._socket.close()
