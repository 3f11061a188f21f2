"""u-blox UBX: the navigation messages of a stream, whatever else stands between them, decoded here.

A frame is taken wherever its header, length and checksum agree, so damage costs the damaged frame only. Messages of one
navigation epoch (one iTOW) make one row. NAV-PVT gives all of it; older logs give position (NAV-POSLLH), velocity
(NAV-VELNED) and time (NAV-TIMEUTC) apart. NAV-HPPOSLLH, where it is, refines the position.
Fields: u-blox M8 and F9 interface descriptions. Decoded by a general library, a frame takes forty times as long.
"""

import datetime
import math
import re
import struct
from collections import Counter
from collections.abc import Callable
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from steerway.core.records import Fixes
from steerway.formats.places import places
from steerway.formats.recording import Recording


class _Position(NamedTuple):
    """NAV-POSLLH, NAV-HPPOSLLH: degrees · 1e7, mm."""

    tow: int
    lon: float
    lat: float
    accuracy: float
    valid: bool = True


class _Status(NamedTuple):
    """NAV-STATUS."""

    tow: int
    fix: int
    flags: int


class _Velocity(NamedTuple):
    """NAV-VELNED: cm/s, degrees · 1e5."""

    tow: int
    speed: int
    heading: int


class _Clock(NamedTuple):
    """NAV-TIMEUTC."""

    tow: int
    nano: int
    date: tuple[int, ...]  # year to second
    valid: bool


class _Solution(NamedTuple):
    """NAV-PVT: degrees · 1e7, mm, mm/s, degrees · 1e5."""

    tow: int
    nano: int
    date: tuple[int, ...]
    valid: bool
    lon: int
    lat: int
    accuracy: int
    fix: int
    flags: int
    invalid_place: int
    speed: int
    heading: int


def _high_precision(
    invalid: int, tow: int, lon: int, lat: int, fine_lon: int, fine_lat: int, accuracy: int
) -> _Position:
    return _Position(tow, lon + 0.01 * fine_lon, lat + 0.01 * fine_lat, 0.1 * accuracy, not invalid & 1)


def _solution(tow: int, *fields: int) -> _Solution:
    *date, valid, nano, fix, flags, lon, lat, accuracy, speed, heading, flags3 = fields
    known = valid & 3 == 3
    return _Solution(tow, nano, tuple(date), known, lon, lat, accuracy, fix, flags, flags3 & 1, speed, heading)


def _clock(tow: int, nano: int, *fields: int) -> _Clock:
    *date, valid = fields
    return _Clock(tow, nano, tuple(date), bool(valid & 4))


_MESSAGES: dict[int, tuple[str, struct.Struct, Callable[..., Any]]] = {
    0x02: ("NAV-POSLLH", struct.Struct("<Iii8xI"), _Position),
    0x03: ("NAV-STATUS", struct.Struct("<IBB"), _Status),
    0x07: ("NAV-PVT", struct.Struct("<IH5BB4xiBB2xii8xI16xii10xB"), _solution),
    0x12: ("NAV-VELNED", struct.Struct("<I16xIi"), _Velocity),
    0x14: ("NAV-HPPOSLLH", struct.Struct("<3xBIii8xbb2xI"), _high_precision),
    0x21: ("NAV-TIMEUTC", struct.Struct("<I4xiH5BB"), _clock),
}
"""Identifier → name, fields from the beginning of the payload, and what they make."""
_HEADER = re.compile(rb"\xb5\x62\x01([\x02\x03\x07\x12\x14\x21])", re.DOTALL)
_LONGEST = 128  # bytes; none of these messages is longer
_FRAME = 8  # bytes around the payload
_HEAD = 6  # … and of them before it
_NO_FIX, _SURVEYED = 0, 5  # fixType; the latter solves for time only, at a given or surveyed antenna position


def recognises(head: bytes) -> bool:
    """Whether there is a whole navigation message in the first bytes of a log."""
    reader = UbxReader()
    reader.feed(head)
    return bool(reader.counts)


def read(data: bytes) -> Recording:
    """The source "UBX" of a log; epochs without a fix or without a valid time are counted."""
    reader = UbxReader()
    reader.feed(data)
    reader.finish()
    return reader.take()


Epoch = dict[str, Any]
"""The messages of an epoch by name, each of its NamedTuple."""


class UbxReader:
    """Reads a stream of bytes in pieces of any size: `feed` it, then `take` the epochs."""

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
        """The stream has ended: incomplete frames count as damaged."""
        self._read(b"", True)

    def holds(self, settled: bool = True) -> bool:
        """Whether there may be something to `take`."""
        return bool(self._rows) or (settled and bool(self._epoch))

    def take(self, settled: bool = True) -> Recording:
        """The epochs since the last call. Without `settled` the newest waits, for more of it may be on its way."""
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
        note = f"{surveyed} positions are the surveyed one of a receiver that solves for time only"
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
            name, layout, made = _MESSAGES[data[start + 3]]
            if _is_sound(data, start, end, layout.size):
                self._add(name, made(*layout.unpack_from(data, start + _HEAD)))
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
        """The newest epoch is complete."""
        epoch, self._epoch = self._epoch, {}
        row = _row(epoch, self.skipped) if epoch else None
        if row is not None:
            self._rows.append(row)
            self._surveyed += _is_surveyed(epoch)


def _end(data: bytes, start: int) -> int:
    """Where a message ends by its own length, or where that length stands; its start when that cannot be."""
    if len(data) < start + _HEAD:
        return start + _HEAD
    length = data[start + 4] + 256 * data[start + 5]
    return start + _FRAME + length if length <= _LONGEST else start


def _is_sound(data: bytes, start: int, end: int, least: int) -> bool:
    """Whether a frame has `least` bytes of payload and more, and the checksum is its (8-bit Fletcher)."""
    if end - start < _FRAME + least or end > len(data):
        return False
    body = data[start + 2 : end - 2]
    return data[end - 2] == sum(body) & 0xFF and data[end - 1] == sum(accumulate(body)) & 0xFF


def _row(epoch: Epoch, skipped: Counter[str]) -> tuple[float, ...] | None:
    """Time, latitude and longitude (deg), 1σ, SOG and COG (deg) of an epoch with a fix, or None."""
    place = epoch.get("NAV-PVT") or epoch.get("NAV-POSLLH") or epoch.get("NAV-HPPOSLLH")
    if place is None:
        return None
    if not _has_fix(epoch):
        skipped["no fix"] += 1
        return None
    time = _time(epoch)
    if math.isnan(time):
        skipped["no valid time"] += 1
        return None
    fine = epoch.get("NAV-HPPOSLLH")
    if fine is not None and fine.valid:
        place = fine
    return (time, place.lat / 1e7, place.lon / 1e7, _std(place), *_velocity(epoch))


def _std(place: Any) -> float:
    """The receiver's horizontal accuracy, a radius, as 1σ of north and of east (m)."""
    return place.accuracy / 1000.0 / math.sqrt(2.0)


def _has_fix(epoch: Epoch) -> bool:
    """Whether the receiver flags the position as valid (gnssFixOK), within its own accuracy limits."""
    pvt, status = epoch.get("NAV-PVT"), epoch.get("NAV-STATUS")
    if pvt is not None:
        return bool(pvt.flags & 1) and pvt.fix != _NO_FIX and not pvt.invalid_place
    if status is not None:
        return bool(status.flags & 1) and status.fix != _NO_FIX
    return True


def _is_surveyed(epoch: Epoch) -> bool:
    return "NAV-PVT" in epoch and epoch["NAV-PVT"].fix == _SURVEYED


def _time(epoch: Epoch) -> float:
    """Unix time to the nanosecond fields; NaN where the receiver does not flag it as valid."""
    clock = epoch.get("NAV-PVT") or epoch.get("NAV-TIMEUTC")
    if clock is None or not clock.valid:
        return math.nan
    year, month, day, hour, minute, second = clock.date
    try:
        whole = datetime.datetime(year, month, day, hour, minute, tzinfo=datetime.UTC)
    except ValueError:
        return math.nan
    return whole.timestamp() + (second + clock.nano * 1e-9)


def _velocity(epoch: Epoch) -> tuple[float, float]:
    """SOG (m/s) and COG (deg); NaN where not given."""
    pvt, velocity = epoch.get("NAV-PVT"), epoch.get("NAV-VELNED")
    if pvt is not None:
        return pvt.speed / 1000.0, pvt.heading / 1e5
    if velocity is not None:
        return velocity.speed / 100.0, velocity.heading / 1e5
    return math.nan, math.nan
