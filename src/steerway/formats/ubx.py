"""u-blox UBX: the navigation messages of a stream, whatever else stands between them, decoded by pyubx2.

A frame is taken wherever its header, length and checksum agree, so damage costs the damaged frame only. Messages of one
navigation epoch (one iTOW) make one row. NAV-PVT gives all of it; older logs give position (NAV-POSLLH), velocity
(NAV-VELNED) and time (NAV-TIMEUTC) apart. NAV-HPPOSLLH, where it is, refines the position.
Fields: u-blox M8 and F9 interface descriptions.
"""

import datetime
import math
import re
from collections import Counter

import numpy as np
from pyubx2 import UBXReader
from pyubx2.exceptions import UBXMessageError, UBXParseError, UBXStreamError, UBXTypeError

from steerway.core.records import Fixes
from steerway.formats.places import places
from steerway.formats.recording import Recording

_NAMES = {
    0x02: "NAV-POSLLH",
    0x03: "NAV-STATUS",
    0x07: "NAV-PVT",
    0x12: "NAV-VELNED",
    0x14: "NAV-HPPOSLLH",
    0x21: "NAV-TIMEUTC",
}
_HEADER = re.compile(rb"\xb5\x62\x01([\x02\x03\x07\x12\x14\x21])", re.DOTALL)
_LONGEST = 128  # bytes; none of these messages is longer
_FRAME = 8  # bytes around the payload
_HEAD = 6  # … and of them before it
_ERRORS = (UBXMessageError, UBXParseError, UBXStreamError, UBXTypeError)
_NO_FIX, _SURVEYED = 0, 5  # fixType; the latter solves for time only, at a given or surveyed antenna position


def recognises(head: bytes) -> bool:
    """Whether there is a whole navigation message in the first bytes of a log."""
    reader = Reader()
    reader.feed(head)
    return bool(reader.counts)


def read(data: bytes) -> Recording:
    """The source "UBX" of a log; epochs without a fix or without a valid time are counted."""
    reader = Reader()
    reader.feed(data)
    reader.finish()
    return reader.take()


class Reader:
    """Reads a stream of bytes in pieces of any size: `feed` it, then `take` the epochs."""

    def __init__(self):
        self._tail = b""
        self._epoch: dict = {}
        self._rows: list[tuple[float, ...]] = []
        self._surveyed = 0
        self.counts, self.skipped = Counter(), Counter()

    def feed(self, chunk) -> None:
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

    def _read(self, chunk, final):
        data, at = self._tail + chunk, 0
        while (match := _HEADER.search(data, at)) is not None:
            end = _end(data, match.start())
            if end > len(data) and not final:
                self._tail = data[match.start() :]
                return
            try:
                self._add(_NAMES[match.group(1)[0]], UBXReader.parse(data[match.start() : end]))
                at = end
            except _ERRORS:
                self.skipped["UBX frame damaged"] += 1
                at = match.end()
        self._tail = data[max(at, len(data) - 3) :]

    def _add(self, name, message):
        self.counts[name] += 1
        epoch = next(iter(self._epoch.values()), message)
        if message.iTOW != epoch.iTOW or name in self._epoch:
            self._close()
        self._epoch[name] = message

    def _close(self):
        """The newest epoch is complete."""
        epoch, self._epoch = self._epoch, {}
        row = _row(epoch, self.skipped) if epoch else None
        if row is not None:
            self._rows.append(row)
            self._surveyed += _is_surveyed(epoch)


def _end(data, start):
    """Where a message ends by its own length, or where that length stands; its start when that cannot be."""
    if len(data) < start + _HEAD:
        return start + _HEAD
    length = int.from_bytes(data[start + 4 : start + _HEAD], "little")
    return start + _FRAME + length if length <= _LONGEST else start


def _row(epoch, skipped):
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
    if fine is not None and not fine.invalidLlh:
        place = fine
    return (time, place.lat, place.lon, _std(place), *_velocity(epoch))


def _std(place):
    """The receiver's horizontal accuracy, a radius, as 1σ of north and of east (m)."""
    return place.hAcc / 1000.0 / math.sqrt(2.0)


def _has_fix(epoch):
    """Whether the receiver flags the position as valid (gnssFixOK), within its own accuracy limits."""
    pvt, status = epoch.get("NAV-PVT"), epoch.get("NAV-STATUS")
    if pvt is not None:
        return bool(pvt.gnssFixOk) and pvt.fixType != _NO_FIX and not getattr(pvt, "invalidLlh", 0)
    if status is not None:
        return bool(status.gpsFixOk) and status.gpsFix != _NO_FIX
    return True


def _is_surveyed(epoch):
    return "NAV-PVT" in epoch and epoch["NAV-PVT"].fixType == _SURVEYED


def _time(epoch):
    """Unix time to the nanosecond fields; NaN where the receiver does not flag it as valid."""
    clock = epoch.get("NAV-PVT")
    if clock is not None:
        valid, second = clock.validDate and clock.validTime, clock.second
    elif (clock := epoch.get("NAV-TIMEUTC")) is not None:
        valid, second = clock.validUTC, clock.sec
    else:
        return math.nan
    try:
        minute = datetime.datetime(clock.year, clock.month, clock.day, clock.hour, clock.min, tzinfo=datetime.UTC)
    except ValueError:
        return math.nan
    return minute.timestamp() + (second + clock.nano * 1e-9) if valid else math.nan


def _velocity(epoch):
    """SOG (m/s) and COG (deg); NaN where not given."""
    pvt, velocity = epoch.get("NAV-PVT"), epoch.get("NAV-VELNED")
    if pvt is not None:
        return pvt.gSpeed / 1000.0, pvt.headMot
    if velocity is not None:
        return velocity.gSpeed / 100.0, velocity.heading
    return math.nan, math.nan
