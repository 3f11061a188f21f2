"""A link that carries MAVLink both ways (UDP, TCP or a serial line), its dialect, and MAVLink 2 signing.

Sending never waits for the peer.
"""

import hashlib
import re
import time
from collections.abc import Callable
from enum import IntEnum
from typing import Any

from steerway.core.errors import InputError
from steerway.core.extras import require
from steerway.live.links.link import kept_open
from steerway.live.links.transport import Transport, Write
from steerway.live.uri import Uri, secret_in


class RoverMode(IntEnum):
    """`custom_mode` of a HEARTBEAT of ArduPilot's Rover, boats included; ardupilot.org, Rover parameter MODE1."""

    MANUAL = 0
    ACRO = 1
    STEERING = 3
    HOLD = 4
    LOITER = 5
    FOLLOW = 6
    SIMPLE = 7
    DOCK = 8
    CIRCLE = 9
    AUTO = 10
    RTL = 11
    SMART_RTL = 12
    GUIDED = 15
    INITIALISING = 16


def mode_name(custom_mode: int) -> str:
    """A mode's name as ground stations show it."""
    try:
        return RoverMode(custom_mode).name
    except ValueError:
        return f"mode {custom_mode}"


def dialect(address: str) -> Any:
    """The module of ArduPilot's and the common messages. Raises InputError without the package pymavlink."""
    require(f"{address}:", "mavlink")
    import pymavlink.dialects.v20.ardupilotmega as messages

    return messages


_EPOCH = 1_420_070_400.0  # Unix time of 2015-01-01, from which signatures count
_TICK = 1e-5  # s
_SHORTEST = 8


def key_of(path: str) -> bytes:
    """The key in a file: 64 hexadecimal digits, or a passphrase, whose SHA-256 is the key as in ground stations.

    Raises InputError, without the key in its message. Source: mavlink.io, guide "Message signing".
    """
    text = secret_in(path, "signing key")
    if re.fullmatch(r"[0-9A-Fa-f]{64}", text):
        return bytes.fromhex(text)
    if len(text) < _SHORTEST:
        raise InputError(f"signing key {path} has {len(text)} characters, expected at least {_SHORTEST}")
    return hashlib.sha256(text.encode()).digest()


def sign(codec: Any, key: bytes, link: int = 0) -> None:
    """Make a codec sign the messages that it sends, and accept only messages signed with the same key."""
    codec.signing.secret_key = key
    codec.signing.sign_outgoing = True
    codec.signing.link_id = link
    codec.signing.timestamp = int((time.time() - _EPOCH) / _TICK)


_BACKLOG = 1 << 14  # bytes that may wait for a TCP peer; none on a serial line, where a waiting order is out of date
_KINDS = {"udpin": "udp", "udpout": "udpout", "tcp": "tcp", "": "serial"}


class MavlinkLink:
    """One link and the codec on it. `system` and `component` are the sender's ids in sent messages.

    `udpin` waits for packets and answers the sender of the last accepted one; `udpout` sends first. `receive` gets
    every message and returns whether it is accepted. `broken` counts data that are no message, `lost` messages that
    could not be sent. With `signing=FILE` in the address, sent messages are signed with the key in that file, and
    received messages without this signature count as `broken`.
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
    def system(self, number: int) -> None:
        self._codec.srcSystem = number

    def send(self, messages: Any) -> None:
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

    async def _open(self) -> None:
        self._answer = None
        try:
            await self._transport.open()
        finally:
            self._answer = None

    def _receive(self, data: bytes, answer: Write) -> None:
        """Take received bytes. On a datagram link, answers go to the sender of the last accepted datagram."""
        by_datagrams = self.uri.via in ("udpin", "udpout")
        if by_datagrams:  # a datagram has whole packets: drop an unfinished packet of another sender
            self._begin()
        if self._feed(data) and self.uri.via == "udpin":
            self._answer = answer

    def _feed(self, data: bytes) -> bool:
        """Decode received bytes; return whether any message in them is accepted."""
        accepted = False
        for message in self._codec.parse_buffer(data) or ():
            if message.get_type() == "BAD_DATA":
                self.broken += 1
            else:
                accepted |= self.receive(message)
        return accepted

    def _begin(self) -> None:
        self._codec.buf, self._codec.buf_index = bytearray(), 0
        self._codec.expected_length = self.messages.HEADER_LEN_V1 + 2
        self._codec.have_prefix_error = False
