"""SI values as messages of NMEA 2000: 129026, 127251, 129283, 129284, 127237. Fields: the canboat PGN database."""

import math
import struct

from steerway.core.leg import Leg
from steerway.formats.nmea2000.fields import TRUE

_HEADING_CONTROL = 4  # steering mode of 127237


def write_course_and_speed(sid: int, cog: float, sog: float) -> bytes:
    """129026 of true course."""
    return struct.pack("<BBHHH", sid, 0xFC | TRUE, _u16(cog % math.tau, 1e-4), _u16(sog, 0.01), 0xFFFF)


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
    flags = TRUE | int(leg.is_passed) << 2 | int(leg.is_arrived) << 4
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
    mode = _HEADING_CONTROL | 7 << 3 | TRUE << 6
    steer = _u16(course % math.tau, 1e-4)
    unknown = 0xFFFF
    turn = _i16(rate, 3.125e-5)
    return struct.pack(
        "<BBBhHHHHhhhH", 0xFF, mode, 0xFF, 0x7FFF, steer, unknown, unknown, unknown, 0x7FFF, turn, 0x7FFF, unknown
    )


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
