"""Inputs and sinks of plain bytes: TCP, UDP and serial lines."""

import socket
from functools import partial

from steerway.live.links.decoding import ReceiverDecoder
from steerway.live.links.link import Feed, Input, Sink, kept_open
from steerway.live.links.transport import Transport, Write
from steerway.live.uri import Uri


class StreamInput(Input[ReceiverDecoder]):
    """Reads what comes at an address; a sentence in a datagram that lacks its line end gets one."""

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
    """Writes the same to every peer of an address: the server, all clients, or what a serial line leads to."""

    def __init__(self, uri: Uri, kind: str = "tcp"):
        super().__init__(uri)
        self.transport = Transport(uri, kind)

    @property
    def has_peer(self) -> bool:
        """Whether anybody is connected."""
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
    """Writes datagrams to one address, or to all of a network, from its first message on."""

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
