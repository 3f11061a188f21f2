"""Messages of NMEA 2000 as SI values, and SI values as messages. Fields: the canboat PGN database.

Read: 129025, 129026, 129029, 127250, 127251, 127488, 128259. Written: 129026, 127251, 129283, 129284, 127237.
"""

import math
import struct

from steerway.core.angles import wrap
from steerway.core.leg import Leg
from steerway.formats import dilution

_DAY = 86400.0
_FIRST_DATE = 946771200.0  # 2000-01-02: a receiver without a fix reports an earlier one
_TRUE, _MAGNETIC = 0, 1
_HEADING_CONTROL = 4  # steering mode of 127237


def position_rapid(data: bytes) -> dict:
    """129025."""
    latitude, longitude = struct.unpack_from("<ii", data)
    return _place(latitude, longitude, 0x7FFFFFFF, 1e-7)


def course_and_speed(data: bytes) -> dict:
    """129026; a magnetic course is none."""
    _, reference, cog, sog = struct.unpack_from("<BBHH", data)
    course = _angle(cog) if reference & 3 == _TRUE else math.nan
    return {"sog": math.nan if sog > 0xFFFC else sog * 0.01, "cog": course}


def gnss_position(data: bytes) -> dict:
    """129029, with its `time`; nothing without a fix."""
    _, days, clock, latitude, longitude = struct.unpack_from("<BHIqq", data)
    method, (hdop,) = data[31] >> 4, struct.unpack_from("<h", data, 34)
    time = days * _DAY + clock * 1e-4
    if not 1 <= method <= 5 or days > 0xFFFC or clock > 0xFFFFFFFC or time < _FIRST_DATE:
        return {}
    std = dilution.deviation(hdop * 0.01 if hdop < 0x7FFD else math.nan, method)
    place = _place(latitude, longitude, 0x7FFFFFFFFFFFFFFF, 1e-16)
    return place and place | {"time": time, "position_std": std}


def heading(data: bytes) -> dict:
    """127250; a magnetic one is made true by the variation that it carries, and is none without."""
    _, angle, deviation, variation, reference = struct.unpack_from("<BHhhB", data)
    value = _angle(angle)
    if reference & 3 == _MAGNETIC:
        value += 0.0 if deviation > 0x7FFC else deviation * 1e-4
        value += math.nan if variation > 0x7FFC else variation * 1e-4
    return {"heading": wrap(value) if math.isfinite(value) and reference & 3 < 2 else math.nan}


def rate_of_turn(data: bytes) -> dict:
    """127251, + to starboard."""
    (rate,) = struct.unpack_from("<i", data, 1)
    return {"yaw_rate": math.nan if rate > 0x7FFFFFFC else rate * 3.125e-8}


def water_speed(data: bytes) -> dict:
    """128259."""
    (speed,) = struct.unpack_from("<H", data, 1)
    return {"water_speed": math.nan if speed > 0xFFFC else speed * 0.01}


def engine_speed(data: bytes) -> dict:
    """127488: turns of an engine in quarters of a turn a minute, as rev/s."""
    (turns,) = struct.unpack_from("<H", data, 1)
    return {"shaft": math.nan if turns > 0xFFFC else turns * 0.25 / 60.0}


READERS = {
    129025: (position_rapid, 8),
    129026: (course_and_speed, 6),
    129029: (gnss_position, 36),
    127250: (heading, 8),
    127251: (rate_of_turn, 5),
    127488: (engine_speed, 3),
    128259: (water_speed, 3),
}
"""By PGN: the reader of a message and its least length."""


def write_course_and_speed(sid: int, cog: float, sog: float) -> bytes:
    """129026 of true course."""
    return struct.pack("<BBHHH", sid, 0xFC | _TRUE, _u16(cog % math.tau, 1e-4), _u16(sog, 0.01), 0xFFFF)


def write_rate_of_turn(sid: int, rate: float) -> bytes:
    """127251."""
    return struct.pack("<BiBH", sid, _i32(rate, 3.125e-8), 0xFF, 0xFFFF)


def write_cross_track(sid: int, leg: Leg | None) -> bytes:
    """129283, + when the boat is to starboard of the leg; navigation terminated without a leg."""
    ended = leg is None or math.isnan(leg.cross_track)
    error = math.nan if leg is None else leg.cross_track
    return struct.pack("<BBiH", sid, (1 if ended else 0) << 6 | 0x30, _i32(error, 0.01), 0xFFFF)


def write_navigation(sid: int, leg: Leg, origin: int, destination: int) -> bytes:
    """129284; true bearings, great circle."""
    flags = _TRUE | int(leg.is_passed) << 2 | int(leg.is_arrived) << 4
    return struct.pack(
        "<BIBIHHHIIiih",
        sid,
        _u32(leg.distance, 0.01),
        flags,
        0xFFFFFFFF,
        0xFFFF,
        _u16(leg.direction % math.tau, 1e-4),
        _u16(leg.bearing % math.tau, 1e-4),
        origin,
        destination,
        _i32(math.degrees(leg.latitude), 1e-7),
        _i32(math.degrees(leg.longitude), 1e-7),
        _i16(leg.closing_speed, 0.01),
    )


def write_track_control(course: float, rate: float) -> bytes:
    """127237: the course to steer, and the rate of turn that is ordered, under heading control."""
    mode = _HEADING_CONTROL | 7 << 3 | _TRUE << 6
    steer = _u16(course % math.tau, 1e-4)
    unknown = 0xFFFF
    turn = _i16(rate, 3.125e-5)
    return struct.pack(
        "<BBBhHHHHhhhH", 0xFF, mode, 0xFF, 0x7FFF, steer, unknown, unknown, unknown, 0x7FFF, turn, 0x7FFF, unknown
    )


def _place(latitude, longitude, unknown, unit):
    if latitude >= unknown - 2 or longitude >= unknown - 2:
        return {}
    degrees = latitude * unit, longitude * unit
    if abs(degrees[0]) > 90.0 or abs(degrees[1]) > 180.0:
        return {}
    return {"latitude": math.radians(degrees[0]), "longitude": wrap(math.radians(degrees[1]))}


def _angle(raw):
    return math.nan if raw > 0xFFFC else wrap(raw * 1e-4)


def _scaled(value, unit, most):
    """An integer within its range; `most` is the one that means unknown."""
    return most if not math.isfinite(value) else min(round(value / unit), most - 3)


def _u16(value, unit):
    return max(_scaled(value, unit, 0xFFFF), 0)


def _u32(value, unit):
    return max(_scaled(value, unit, 0xFFFFFFFF), 0)


def _i16(value, unit):
    return max(_scaled(value, unit, 0x7FFF), -0x8000)


def _i32(value, unit):
    return max(_scaled(value, unit, 0x7FFFFFFF), -0x80000000)
