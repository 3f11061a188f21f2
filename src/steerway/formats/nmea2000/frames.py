"""Frames of NMEA 2000: the 29-bit identifier, and messages split over several frames (fast packets).

Source: ISO 11783-3 and -5, as documented by the canboat project.
"""

from typing import NamedTuple

BROADCAST = 255
FAST = frozenset({126996, 127237, 129029, 129284})
"""PGNs sent as fast packets, among those that are read or sent here."""
_OPEN = 64  # largest number of incomplete messages in memory


class Frame(NamedTuple):
    """One frame: PGN, addresses of sender and receiver, priority, up to 8 bytes."""

    pgn: int
    source: int
    destination: int
    priority: int
    data: bytes


def frame_of(identifier: int, data: bytes) -> Frame:
    """The frame with an identifier and data."""
    destination, pgn = identifier >> 8 & 0xFF, identifier >> 8 & 0x3FFFF
    if pgn >> 8 & 0xFF < 240:
        pgn &= 0x3FF00
    else:
        destination = BROADCAST
    return Frame(pgn, identifier & 0xFF, destination, identifier >> 26 & 7, bytes(data))


def identifier_of(pgn: int, source: int, destination: int = BROADCAST, priority: int = 3) -> int:
    """The identifier of a frame."""
    addressed = destination if pgn >> 8 & 0xFF < 240 else 0
    return priority << 26 | (pgn | addressed) << 8 | source


class Joiner:
    """Joins the frames of fast packets."""

    def __init__(self) -> None:
        self._open: dict[tuple[int, int, int], tuple[int, list[bytes]]] = {}
        self._given_up = 0

    @property
    def lost(self) -> int:
        """Number of messages that were given up or are still incomplete."""
        return self._given_up + len(self._open)

    def add(self, frame: Frame) -> bytes | None:
        """The payload of the message that a frame completes; None if it completes none."""
        if frame.pgn not in FAST:
            return frame.data
        if len(frame.data) < 2:
            return None
        key, place = (frame.pgn, frame.source, frame.data[0] >> 5), frame.data[0] & 31
        if place == 0:
            self._given_up += key in self._open
            self._open[key] = frame.data[1], [frame.data[2:]]
            while len(self._open) > _OPEN:
                self._open.pop(next(iter(self._open)))
                self._given_up += 1
        elif key in self._open and len(self._open[key][1]) == place:
            self._open[key][1].append(frame.data[1:])
        else:
            self._given_up += self._open.pop(key, None) is not None
            return None
        length, pieces = self._open[key]
        if sum(map(len, pieces)) < length:
            return None
        del self._open[key]
        return b"".join(pieces)[:length]


class Splitter:
    """Splits messages into fast packets."""

    def __init__(self) -> None:
        self._sequences: dict[int, int] = {}

    def parts(self, pgn: int, payload: bytes) -> list[bytes]:
        """The data of each frame of a message; a single frame if the PGN is not a fast packet."""
        if pgn not in FAST:
            return [payload]
        sequence = self._sequences.get(pgn, 0)
        self._sequences[pgn] = (sequence + 1) % 8
        pieces = [payload[:6], *(payload[at : at + 7] for at in range(6, len(payload), 7))]
        heads = [
            bytes([sequence << 5, len(payload)]),
            *(bytes([sequence << 5 | place]) for place in range(1, len(pieces))),
        ]
        return [(head + piece).ljust(8, b"\xff") for head, piece in zip(heads, pieces, strict=True)]
