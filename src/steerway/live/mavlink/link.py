"""A link that carries MAVLink both ways: UDP, TCP or a serial line. Sending never waits for the peer."""

from collections.abc import Callable

from steerway.live.links.link import kept_open
from steerway.live.links.transport import Transport, Write
from steerway.live.mavlink.dialect import dialect, key_of, sign
from steerway.live.uri import Uri

_BACKLOG = 1 << 14  # bytes that may wait for a TCP peer; of a serial line none: an order that waits is out of date
_KINDS = {"udpin": "udp", "udpout": "udpout", "tcp": "tcp", "": "serial"}


class MavlinkLink:
    """One link and the codec on it. `system` and `component` are the sender's in what is sent.

    `udpin` waits for packets and answers the sender of the last accepted one, `udpout` sends first. `receive` gets
    every message and returns whether it is accepted; what is no message is counted in `broken`, what could not be sent
    in `lost`. With `signing=FILE` in the address what is sent is signed, and only what is signed with the key in that
    file is accepted; the rest counts as `broken`.
    """

    def __init__(self, uri: Uri, receive: Callable[[object], bool], system: int = 1, component: int = 1):
        self.uri, self.receive = uri, receive
        self.messages = dialect(uri.text)
        self._codec = self.messages.MAVLink(None, system, component)
        self._codec.robust_parsing = True
        if "signing" in uri.options:
            sign(self._codec, key_of(uri.options["signing"]))
        kind = _KINDS[uri.via]
        self._transport = Transport(uri, kind, self._receive, backlog=_BACKLOG if kind != "serial" else 0)
        self._answer: Write | None = None
        self.lost = 0
        self.broken = 0

    @property
    def system(self) -> int:
        """The sender's system id."""
        return self._codec.srcSystem

    @system.setter
    def system(self, number: int):
        self._codec.srcSystem = number

    def send(self, messages) -> None:
        """Send messages of the dialect, or lose them."""
        for message in messages:
            packet = message.pack(self._codec)
            self._codec.seq = (self._codec.seq + 1) % 256
            if self._answer is not None:
                self._answer(packet)
            elif not self._transport.peers or not self._transport.write(packet):
                self.lost += 1

    async def run(self) -> None:
        """Keep the link open until cancelled."""
        await kept_open(self.uri.text, self._open)

    async def _open(self):
        self._answer = None
        try:
            await self._transport.open()
        finally:
            self._answer = None

    def _receive(self, data, answer):
        """A piece; of datagrams the sender of the last accepted one is answered."""
        by_datagrams = self.uri.via in ("udpin", "udpout")
        if by_datagrams:  # one holds whole packets: what another sender left unfinished is no part of it
            self._begin()
        if self._feed(data) and self.uri.via == "udpin":
            self._answer = answer

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
        self._codec.buf, self._codec.buf_index = bytearray(), 0
        self._codec.expected_length = self.messages.HEADER_LEN_V1 + 2
        self._codec.have_prefix_error = False
