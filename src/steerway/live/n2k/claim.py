"""The claim of an address on the bus (ISO 11783-5): the lower NAME keeps a contested one, the other takes the next."""

import math
import struct

from steerway.formats.nmea2000.frames import BROADCAST, Frame

CLAIM, REQUEST = 60928, 59904
NO_ADDRESS = 254
_WAIT = 0.25  # s after a claim before anything else is sent
_HIGHEST = 251
_NAVIGATION, _OWN_POSITION, _MARINE, _UNKNOWN_MAKER = 60, 145, 4, 2047


def name_of(identity: int) -> int:
    """The NAME of a device: its identity number, class and function; it may take any address."""
    low = (identity & 0x1FFFFF) | _UNKNOWN_MAKER << 21
    high = _OWN_POSITION << 8 | _NAVIGATION << 17 | _MARINE << 28 | 1 << 31
    return high << 32 | low


class AddressClaim:
    """No clock and no I/O: `begin`, then `receive` every frame; both return the frames to send as (PGN, data)."""

    def __init__(self, name: int, address: int = 40):
        self.name, self.address = name, address
        self._first = address
        self._since = math.inf

    def holds(self, now: float) -> bool:
        """Whether the address may be used."""
        return self.address != NO_ADDRESS and now - self._since >= _WAIT

    def begin(self, now: float) -> list[tuple[int, bytes]]:
        """Claim the address."""
        self._since = now
        return [(CLAIM, struct.pack("<Q", self.name))]

    def receive(self, frame: Frame, now: float) -> list[tuple[int, bytes]]:
        """The answer to a frame of another device."""
        if frame.pgn == REQUEST and frame.destination in (BROADCAST, self.address) and len(frame.data) >= 3:
            asked = int.from_bytes(frame.data[:3], "little")
            return [(CLAIM, struct.pack("<Q", self.name))] if asked == CLAIM else []
        if frame.pgn != CLAIM or frame.source != self.address or len(frame.data) != 8:
            return []
        (other,) = struct.unpack("<Q", frame.data)
        if other == self.name:
            return []
        if self.name < other:
            return [(CLAIM, struct.pack("<Q", self.name))]
        self.address = 0 if self.address >= _HIGHEST else self.address + 1
        if self.address == self._first:
            self.address = NO_ADDRESS
        return self.begin(now)
