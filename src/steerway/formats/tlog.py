"""Telemetry logs of MAVLink ground stations (.tlog), with a receive time (µs, big-endian) before every message.

Messages: MAVLink common message set, decoded by the optional package pymavlink.
"""

import struct
from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.extras import require
from steerway.core.records import Fixes
from steerway.core.slow_error import SLOW_STD
from steerway.formats.dilution import OF_FIX_TYPE
from steerway.formats.places import places
from steerway.formats.recording import Recording

_EARLIEST, _LATEST = 946684800_000000, 4102444800_000000  # Unix µs: beginning of 2000 and of 2100
_MAGIC = {0xFE: 8, 0xFD: 12}  # bytes around the payload
_SIGNED, _SIGNATURE = 1, 13
_STAMP = struct.Struct(">Q")
_RECEIVERS = {24: "GPS_RAW_INT", 124: "GPS2_RAW"}
_SYSTEM_TIME = 2
_UNKNOWN = 0xFFFF


def recognises(head: bytes) -> bool:
    """Whether the first bytes are a time and the beginning of a message, and after that message again."""
    after = _next(head, 0)
    return after is not None and (after >= len(head) - 12 or _next(head, after) is not None)


def read(data: bytes) -> Recording:
    """The sources "GPS_RAW_INT", "GPS2_RAW", with the vehicle's number if there are several. Counts damaged messages.

    Raises InputError if pymavlink is not installed.
    """
    require("a telemetry log", "mavlink")
    from pymavlink.dialects.v20 import ardupilotmega

    parser = ardupilotmega.MAVLink(None)
    counts, skipped, rows, clocks = Counter[str](), Counter[str](), defaultdict(list), defaultdict(list)
    at = 0
    while at < len(data) - _STAMP.size:
        after = _next(data, at)
        if after is None or after > len(data):
            skipped["byte between messages"] += 1
            at += 1
            continue
        received, packet, at = 1e-6 * _STAMP.unpack_from(data, at)[0], data[at + _STAMP.size : after], after
        number = int.from_bytes(packet[7:10], "little") if packet[0] == 0xFD else packet[5]
        if number not in _RECEIVERS and number != _SYSTEM_TIME:
            continue
        try:
            message = parser.decode(bytearray(packet))
        except ardupilotmega.MAVError:
            skipped["message damaged"] += 1
            continue
        vehicle = message.get_srcSystem()
        counts[message.get_type()] += 1
        if number == _SYSTEM_TIME:
            if message.time_unix_usec > _EARLIEST:
                clocks[vehicle].append(1e-6 * message.time_unix_usec - 1e-3 * message.time_boot_ms)
        elif message.fix_type < 2:
            skipped["no fix"] += 1
        else:
            rows[vehicle, number].append((received, *_row(message)))
    many = len({vehicle for vehicle, _ in rows}) > 1
    sources = []
    for (vehicle, number), table in sorted(rows.items()):
        name = f"{_RECEIVERS[number]}{f' of {vehicle}' if many else ''}"
        sources.append(_fixes(name, np.array(table), clocks[vehicle]))
    return Recording.of("MAVLink log", sources, counts, skipped)


def _next(data: bytes, at: int) -> int | None:
    """Index after the message whose time begins at `at`; None if there is no message."""
    magic = at + _STAMP.size
    if magic + 3 > len(data) or data[magic] not in _MAGIC:
        return None
    if not _EARLIEST < _STAMP.unpack_from(data, at)[0] < _LATEST:
        return None
    signed = data[magic] == 0xFD and data[magic + 2] & _SIGNED
    return magic + _MAGIC[data[magic]] + data[magic + 1] + (_SIGNATURE if signed else 0)


def _row(message: Any) -> tuple[float, ...]:
    """Time in a receiver's message (s), latitude, longitude (degrees), SOG (m/s), COG (degrees), 1σ (m)."""
    sog = np.nan if message.vel == _UNKNOWN else 1e-2 * message.vel
    cog = np.nan if message.cog == _UNKNOWN else 1e-2 * message.cog
    accuracy = getattr(message, "h_acc", 0)
    kind = OF_FIX_TYPE.get(message.fix_type)
    std = 1e-3 * accuracy / np.sqrt(2.0) if accuracy else np.nan if kind is None else float(SLOW_STD[kind])
    return 1e-6 * message.time_usec, 1e-7 * message.lat, 1e-7 * message.lon, sog, cog, std


def _fixes(name: str, table: Floats, clocks: Sequence[float]) -> Fixes:
    """Fixes at the times in their messages. Times since the vehicle's start are converted to Unix time, with the start
    (Unix s) in `clocks`; if `clocks` is empty, with the shortest delay of reception.
    """
    received, own, latitude, longitude, sog, cog, std = table.T
    offset = np.median(clocks) if clocks else np.min(received - own)
    time = np.where(own > 1e-6 * _EARLIEST, own, own + offset)
    fixes = Fixes(time, *places(latitude, longitude), position_std=std, sog=sog, cog=np.radians(cog), source=name)
    new = np.append(True, np.diff(own) != 0.0)
    return fixes.rows(new & fixes.has_position).in_order()
