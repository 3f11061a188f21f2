"""u-blox UBX: the navigation messages of a binary log, whatever else stands between them, decoded by pyubx2.

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

from steerway.formats.places import places
from steerway.formats.recording import Recording
from steerway.records import Fixes

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
_ERRORS = (UBXMessageError, UBXParseError, UBXStreamError, UBXTypeError)
_NO_FIX, _SURVEYED = 0, 5  # fixType; the latter solves for time only, at the antenna position it was told or surveyed


def recognises(head: bytes) -> bool:
    """Whether there is a whole navigation message in the first bytes of a log."""
    return next(_messages(head, Counter()), None) is not None


def read(data: bytes) -> Recording:
    """The source "UBX" of a log; epochs without a fix or without a valid time are counted."""
    counts, skipped = Counter(), Counter()
    rows, surveyed = [], 0
    for epoch in _epochs(data, counts, skipped):
        row = _row(epoch, skipped)
        if row is not None:
            rows.append(row)
            surveyed += _is_surveyed(epoch)
    if not rows:
        return Recording("UBX", {}, dict(counts), dict(skipped))
    time, latitude, longitude, position_std, sog, cog = np.array(rows, dtype=np.float64).T
    latitude, longitude = places(latitude, longitude)
    fixes = Fixes(time, latitude, longitude, position_std, sog, np.radians(cog), source="UBX").in_order()
    notes = (f"{surveyed} positions are the surveyed one of a receiver that solves for time only",) if surveyed else ()
    return Recording("UBX", {"UBX": fixes}, dict(counts), dict(skipped), notes)


def _messages(data, skipped):
    """(name, decoded message) of every navigation message whose checksum holds."""
    for match in _HEADER.finditer(data):
        start = match.start()
        length = int.from_bytes(data[start + 4 : start + 6], "little")
        frame = data[start : start + 8 + length]
        if length > _LONGEST or len(frame) < 8 + length:
            skipped["UBX frame damaged"] += 1
            continue
        try:
            yield _NAMES[match.group(1)[0]], UBXReader.parse(frame)
        except _ERRORS:
            skipped["UBX frame damaged"] += 1


def _epochs(data, counts, skipped):
    """The messages of each navigation epoch by name."""
    epoch, now = {}, None
    for name, message in _messages(data, skipped):
        counts[name] += 1
        if epoch and (message.iTOW != now or name in epoch):
            yield epoch
            epoch = {}
        epoch[name], now = message, message.iTOW
    if epoch:
        yield epoch


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
    """Whether the receiver vouches for the position (gnssFixOK), which it does within its own accuracy limits."""
    pvt, status = epoch.get("NAV-PVT"), epoch.get("NAV-STATUS")
    if pvt is not None:
        return bool(pvt.gnssFixOk) and pvt.fixType != _NO_FIX and not getattr(pvt, "invalidLlh", 0)
    if status is not None:
        return bool(status.gpsFixOk) and status.gpsFix != _NO_FIX
    return True


def _is_surveyed(epoch):
    return "NAV-PVT" in epoch and epoch["NAV-PVT"].fixType == _SURVEYED


def _time(epoch):
    """Unix time to the nanosecond fields; NaN where the receiver does not vouch for it."""
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
