"""u-blox UBX: navigation messages in a stream that can contain anything else.

A frame is read wherever its header, length and checksum agree, so damage costs only the damaged frame. Messages of one
navigation epoch (one iTOW) make one row. NAV-PVT contains everything; in older logs position (NAV-POSLLH), velocity
(NAV-VELNED) and time (NAV-TIMEUTC) are separate. NAV-HPPOSLLH, if present, refines the position.
Fields: u-blox M8 and F9 interface descriptions. A general library takes forty times as long per frame.
"""

import datetime
import math
import re
import struct
from collections import Counter, namedtuple
from itertools import accumulate
from typing import Any

import numpy as np

from steerway.core.records import Fixes
from steerway.formats.places import places
from steerway.formats.recording import Recording


def _message(name: str, layout: str, fields: str) -> tuple[str, struct.Struct, type[Any]]:
    """(name of a message, layout of its payload from the beginning, named tuple of its fields)."""
    return name, struct.Struct(layout), namedtuple(name.replace("-", "_"), fields)


_DATE = "year month day hour minute second valid"
_MESSAGES = {
    0x02: _message("NAV-POSLLH", "<Iii8xI", "tow lon lat accuracy"),
    0x03: _message("NAV-STATUS", "<IBB", "tow fix flags"),
    0x07: _message(
        "NAV-PVT",
        "<IH5BB4xiBB2xii8xI16xii10xB",
        f"tow {_DATE} nano fix flags lon lat accuracy speed heading flags3",
    ),
    0x12: _message("NAV-VELNED", "<I16xIi", "tow speed heading"),
    0x14: _message("NAV-HPPOSLLH", "<3xBIii8xbb2xI", "invalid tow lon lat fine_lon fine_lat accuracy"),
    0x21: _message("NAV-TIMEUTC", "<I4xiH5BB", f"tow nano {_DATE}"),
}
"""Messages by identifier. Units: latitude and longitude 1e-7 degrees, their fine digits 1e-9 degrees; accuracy mm, in
HPPOSLLH 0.1 mm; speed mm/s, in VELNED cm/s; heading 1e-5 degrees."""
_HEADER = re.compile(rb"\xb5\x62\x01([\x02\x03\x07\x12\x14\x21])", re.DOTALL)
_LONGEST = 128  # bytes; these messages are all shorter
_FRAME = 8  # bytes before and after the payload
_HEAD = 6  # bytes before the payload
_NO_FIX, _SURVEYED = 0, 5  # fixType; 5: time-only fix at a given or surveyed antenna position


def recognises(head: bytes) -> bool:
    """Whether the first bytes of a log contain a complete navigation message."""
    reader = UbxReader()
    reader.feed(head)
    return bool(reader.counts)


def read(data: bytes) -> Recording:
    """The source "UBX" of a log; epochs without a fix or a valid time are left out and counted."""
    reader = UbxReader()
    reader.feed(data)
    reader.finish()
    return reader.take()


Epoch = dict[str, Any]
"""The messages of an epoch by name."""


class UbxReader:
    """Reads a stream of bytes in pieces of any size: call `feed`, then `take` for the epochs."""

    def __init__(self) -> None:
        self._tail = b""
        self._epoch: Epoch = {}
        self._rows: list[tuple[float, ...]] = []
        self._surveyed = 0
        self.counts, self.skipped = Counter[str](), Counter[str]()

    def feed(self, chunk: bytes) -> None:
        """Read the messages that a piece of the stream completes."""
        self._read(bytes(chunk), False)

    def finish(self) -> None:
        """End the stream: an incomplete frame counts as damaged."""
        self._read(b"", True)

    def holds(self, settled: bool = True) -> bool:
        """Whether `take` may return rows."""
        return bool(self._rows) or (settled and bool(self._epoch))

    def take(self, settled: bool = True) -> Recording:
        """The epochs since the last call. Without `settled` the newest is held back, because more of it may follow."""
        if settled:
            self._close()
        rows, surveyed = self._rows, self._surveyed
        self._rows, self._surveyed = [], 0
        counts, skipped = dict(self.counts), dict(self.skipped)
        if not rows:
            return Recording("UBX", {}, counts, skipped)
        time, latitude, longitude, position_std, sog, cog = np.array(rows, dtype=np.float64).T
        latitude, longitude = places(latitude, longitude)
        fixes = Fixes(
            time, latitude, longitude, position_std=position_std, sog=sog, cog=np.radians(cog), source="UBX"
        ).in_order()
        note = f"{surveyed} positions are the surveyed antenna position: the receiver solves for time only"
        return Recording("UBX", {"UBX": fixes}, counts, skipped, (note,) if surveyed else ())

    def _read(self, chunk: bytes, final: bool) -> None:
        data, at, damaged = self._tail + chunk, 0, 0
        self._tail = b""
        while (match := _HEADER.search(data, at)) is not None:
            start = match.start()
            end = _end(data, start)
            if end > len(data) and not final:
                self._tail = data[start:]
                break
            name, layout, message = _MESSAGES[data[start + 3]]
            if _is_sound(data, start, end, layout.size):
                self._add(name, message(*layout.unpack_from(data, start + _HEAD)))
                at = end
            else:
                damaged += 1
                at = start + _HEAD - 2
        else:
            self._tail = data[max(at, len(data) - 3) :]
        if damaged:
            self.skipped["UBX frame damaged"] += damaged

    def _add(self, name: str, message: Any) -> None:
        self.counts[name] += 1
        epoch = next(iter(self._epoch.values()), message)
        if message.tow != epoch.tow or name in self._epoch:
            self._close()
        self._epoch[name] = message

    def _close(self) -> None:
        """Finish the newest epoch: add its row."""
        epoch, self._epoch = self._epoch, {}
        row = _row(epoch, self.skipped) if epoch else None
        if row is not None:
            self._rows.append(row)
            self._surveyed += "NAV-PVT" in epoch and epoch["NAV-PVT"].fix == _SURVEYED


def _end(data: bytes, start: int) -> int:
    """Index after a message, or after its length field if that is incomplete; `start` if the length is too large."""
    if len(data) < start + _HEAD:
        return start + _HEAD
    length = data[start + 4] + 256 * data[start + 5]
    return start + _FRAME + length if length <= _LONGEST else start


def _is_sound(data: bytes, start: int, end: int, least: int) -> bool:
    """Whether a frame is complete, with at least `least` bytes of payload and a valid checksum (8-bit Fletcher)."""
    if end - start < _FRAME + least or end > len(data):
        return False
    body = data[start + 2 : end - 2]
    return data[end - 2] == sum(body) & 0xFF and data[end - 1] == sum(accumulate(body)) & 0xFF


def _row(epoch: Epoch, skipped: Counter[str]) -> tuple[float, ...] | None:
    """Time, latitude and longitude (deg), 1σ (m), SOG (m/s) and COG (deg) of an epoch; None without a fix or a time."""
    fine = epoch.get("NAV-HPPOSLLH")
    place = epoch.get("NAV-PVT") or epoch.get("NAV-POSLLH") or fine
    if place is None:
        return None
    if not _has_fix(epoch):
        skipped["no fix"] += 1
        return None
    time = _time(epoch)
    if math.isnan(time):
        skipped["no valid time"] += 1
        return None
    latitude, longitude, radius = place.lat, place.lon, place.accuracy / 1000.0
    if place is fine or (fine is not None and not fine.invalid & 1):
        latitude, longitude = fine.lat + 0.01 * fine.fine_lat, fine.lon + 0.01 * fine.fine_lon
        radius = 0.1 * fine.accuracy / 1000.0
    return (time, latitude / 1e7, longitude / 1e7, radius / math.sqrt(2.0), *_velocity(epoch))


def _has_fix(epoch: Epoch) -> bool:
    """Whether the receiver flags the position as valid (gnssFixOK); True if no message has the flag."""
    pvt, status = epoch.get("NAV-PVT"), epoch.get("NAV-STATUS")
    if pvt is not None:
        return bool(pvt.flags & 1) and pvt.fix != _NO_FIX and not pvt.flags3 & 1
    if status is not None:
        return bool(status.flags & 1) and status.fix != _NO_FIX
    return True


def _time(epoch: Epoch) -> float:
    """Unix time of an epoch, with its nanoseconds; NaN if the receiver does not flag date and time as valid."""
    clock, needed = epoch.get("NAV-PVT"), 3  # date and time
    if clock is None:
        clock, needed = epoch.get("NAV-TIMEUTC"), 4
    if clock is None or clock.valid & needed != needed:
        return math.nan
    try:
        whole = datetime.datetime(clock.year, clock.month, clock.day, clock.hour, clock.minute, tzinfo=datetime.UTC)
    except ValueError:
        return math.nan
    return whole.timestamp() + (clock.second + clock.nano * 1e-9)


def _velocity(epoch: Epoch) -> tuple[float, float]:
    """SOG (m/s) and COG (deg) of an epoch; NaN if no message has them."""
    pvt, velocity = epoch.get("NAV-PVT"), epoch.get("NAV-VELNED")
    if pvt is not None:
        return pvt.speed / 1000.0, pvt.heading / 1e5
    if velocity is not None:
        return velocity.speed / 100.0, velocity.heading / 1e5
    return math.nan, math.nan
