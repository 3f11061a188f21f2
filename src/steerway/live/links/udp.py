"""UDP datagrams in and out."""

import asyncio
import socket

from steerway.live.base.uri import Uri
from steerway.live.links.link import Input, Sink


class UdpInput(Input):
    """Reads datagrams; a sentence that lacks its line end gets one."""

    async def _read(self, feed):
        class Datagrams(asyncio.DatagramProtocol):
            def datagram_received(self, data, addr):
                lacks_end = data.startswith((b"$", b"!", b"\\")) and not data.endswith(b"\n")
                feed.feed(data + b"\r\n" if lacks_end else data)

        loop = asyncio.get_running_loop()
        here = (self.uri.host or "0.0.0.0", self.uri.port)
        transport, _ = await loop.create_datagram_endpoint(Datagrams, local_addr=here)
        try:
            await asyncio.Event().wait()
        finally:
            transport.close()


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
