"""A simulated receiver on a faulty serial line, and the number of positions that should be used."""

import asyncio
import os
import pty
import time
import tty
from datetime import UTC, datetime

import numpy as np
from pyubx2 import GET, UBXMessage

from steerway.formats import nmea0183
from steerway.formats.nmea0183.writing import gga, rmc

RATE, PIECE, PAUSE = 5.0, 38, 0.01
"""Epochs per second; bytes in a piece and s between pieces: 38400 baud are 3840 bytes per second."""
_DAMAGED = 0.04  # fraction of messages
_NORTH, _EAST = 3e-8, 6e-8  # rad per epoch: about 1 m/s to the north and to the east
_HOME = 0.942, 0.175


class Receiver:
    """`path`: the serial port to read from; `sent`: all bytes written to it."""

    def __init__(self, seed: int = 1):
        self._line, self._port = pty.openpty()
        tty.setraw(self._port)
        self.path = os.ttyname(self._port)
        self.sent = bytearray()
        self._rng = np.random.default_rng(seed)

    async def send(self) -> None:
        """Send epochs until cancelled, each at its time, at the pace of the line."""
        begin, k = time.time(), 0
        while True:
            await asyncio.sleep(begin + k / RATE - time.time())
            waiting = b"".join(map(self._damaged, _epoch(round(begin, 1) + k / RATE, k)))
            for start in range(0, len(waiting), PIECE):
                os.write(self._line, waiting[start : start + PIECE])
                await asyncio.sleep(PAUSE)
            self.sent += waiting
            k += 1

    def route(self) -> str:
        """A mission file along the boat's track, longer than any run."""
        points = [np.degrees([_HOME[0] + k * _NORTH, _HOME[1] + k * _EAST]) for k in (0, 1000, 2000, 100_000)]
        return "".join(
            f"[[waypoint]]\nlat_deg = {lat!r}\nlon_deg = {lon!r}\n" for lat, lon in map(np.ndarray.tolist, points)
        )

    def positions(self) -> int:
        """Number of undamaged positions of the talker GP in the sent bytes."""
        fixes = nmea0183.read(bytes(self.sent)).sources["GP"]
        return int(fixes.has_position.sum())

    def close(self) -> None:
        """Close the line."""
        os.close(self._line)
        os.close(self._port)

    def _damaged(self, message):
        """The message; sometimes with one byte changed, or cut off before its end and followed by the next one."""
        if self._rng.random() > _DAMAGED:
            return message
        at = int(self._rng.integers(1, len(message) - 2))
        if self._rng.random() < 0.5:
            return message[:at]
        return message[:at] + bytes([self._rng.integers(1, 256)]) + message[at + 1 :]


def _epoch(now, k):
    """RMC, GGA and NAV-PVT of one epoch."""
    latitude, longitude = _HOME[0] + _NORTH * k, _HOME[1] + _EAST * k
    moment = datetime.fromtimestamp(round(now, 3), UTC)
    solution = UBXMessage(
        "NAV", "NAV-PVT", GET, iTOW=200 * k, year=moment.year, month=moment.month, day=moment.day, hour=moment.hour,
        min=moment.minute, second=moment.second, nano=moment.microsecond * 1000, validDate=1, validTime=1, fixType=3,
        gnssFixOk=1, lat=float(np.degrees(latitude)), lon=float(np.degrees(longitude)), hAcc=500,
    )  # fmt: skip
    place = now, latitude, longitude
    return rmc(*place, 1.5, 1.0, talker="GP").encode(), gga(*place, talker="GP").encode(), solution.serialize()
