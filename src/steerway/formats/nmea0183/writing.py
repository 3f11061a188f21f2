"""Write NMEA 0183 sentences with checksum and line end: RMC, GGA, VTG, ROT and HDT; APB, XTE and RMB of a leg.

Arguments are in SI and radians; unknown values (NaN or None) become empty fields. Each number is rounded once, to a
multiple of its last digit, so that no field shows 60 minutes, 60 seconds or 360 degrees. Fields: NMEA 0183 version
4.11, as receiver manuals reprint them.
"""

import math
from datetime import UTC, datetime

from steerway.core.earth import KNOT, NAUTICAL_MILE
from steerway.core.leg import Leg

TALKER = "SW"
"""This project's talker identifier, which distinguishes its sentences from those of a receiver."""

_DECIMALS = 7  # of minutes of arc: 0.2 mm


def sealed(body: str) -> str:
    """`$body*checksum` with its line end; the checksum is the exclusive or of the body's bytes."""
    total = 0
    for byte in body.encode("ascii"):
        total ^= byte
    return f"${body}*{total:02X}\r\n"


def rmc(
    time: float,
    latitude: float,
    longitude: float,
    sog: float = math.nan,
    cog: float = math.nan,
    valid: bool = True,
    talker: str = TALKER,
) -> str:
    """RMC: position, SOG, COG and date. Without `valid` or a position: status V, mode N, and only time and date."""
    hour, date = _clock(time)
    if not valid or not _known(latitude, longitude):
        return sealed(f"{talker}RMC,{hour},V,,,,,,,{date},,,N")
    velocity = f"{_fixed(sog, 1.0 / KNOT, 3)},{_course(cog)}"
    return sealed(f"{talker}RMC,{hour},A,{_place(latitude, longitude)},{velocity},{date},,,A")


def gga(
    time: float,
    latitude: float,
    longitude: float,
    satellites: int = 8,
    hdop: float = 1.0,
    valid: bool = True,
    talker: str = TALKER,
    quality: int = 1,
) -> str:
    """GGA: position and its quality; quality 0 and no position if not `valid` or unknown."""
    hour, _ = _clock(time)
    if not valid or not _known(latitude, longitude):
        return sealed(f"{talker}GGA,{hour},,,,,0,,,,M,,M,,")
    place = _place(latitude, longitude)
    return sealed(f"{talker}GGA,{hour},{place},{quality},{satellites:02d},{hdop:.1f},0.0,M,0.0,M,,")


def vtg(sog: float = math.nan, cog: float = math.nan, valid: bool = True, talker: str = TALKER) -> str:
    """VTG: SOG and true COG; if not `valid`, mode N and empty fields."""
    if not valid:
        return sealed(f"{talker}VTG,,T,,M,,N,,K,N")
    return sealed(f"{talker}VTG,{_course(cog)},T,,M,{_fixed(sog, 1.0 / KNOT, 3)},N,{_fixed(sog, 3.6, 3)},K,A")


def rot(rate: float = math.nan, valid: bool = True, talker: str = TALKER) -> str:
    """ROT: rate of turn in degrees per minute, positive to starboard; status V if unknown or not `valid`."""
    known = valid and _known(rate)
    return sealed(f"{talker}ROT,{_fixed(rate, math.degrees(60.0), 2) if known else ''},{'A' if known else 'V'}")


def hdt(heading: float = math.nan, talker: str = TALKER) -> str:
    """HDT: true heading."""
    return sealed(f"{talker}HDT,{_course(heading)},T")


def xte(leg: Leg, valid: bool = True, talker: str = TALKER) -> str:
    """XTE: cross-track error and the direction to steer."""
    status, error = _status(leg, valid), _cross_track(leg, valid, math.inf)
    return sealed(f"{talker}XTE,{status},{status},{error},N,{'A' if status == 'A' else 'N'}")


def apb(leg: Leg, valid: bool = True, talker: str = TALKER) -> str:
    """APB: everything an autopilot needs to follow the leg; bearings and course to steer are true."""
    status, error = _status(leg, valid), _cross_track(leg, valid, math.inf)
    arrived, passed = _letter(leg.is_arrived and status == "A"), _letter(leg.is_passed and status == "A")
    origin_bearing, bearing, steer = (
        _course(each if status == "A" else None) for each in (leg.direction, leg.bearing, leg.course_to_steer)
    )
    return sealed(
        f"{talker}APB,{status},{status},{error},N,{arrived},{passed},{origin_bearing},T,{leg.destination},"
        f"{bearing},T,{steer},T,{'A' if status == 'A' else 'N'}"
    )


def rmb(leg: Leg, valid: bool = True, talker: str = TALKER) -> str:
    """RMB: bearing and distance to the destination, at most 999.9 nautical miles; cross-track error, at most 9.99."""
    status, error = _status(leg, valid), _cross_track(leg, valid, 9.99)
    place = _place(leg.latitude, leg.longitude) if _known(leg.latitude, leg.longitude) else ",,,"
    distance, bearing, closing = "", "", ""
    if status == "A":
        distance = _fixed(min(leg.distance, 999.9 * NAUTICAL_MILE), 1.0 / NAUTICAL_MILE, 3)
        bearing, closing = _course(leg.bearing), _fixed(leg.closing_speed, 1.0 / KNOT, 2)
    arrived = _letter(leg.is_arrived and status == "A")
    return sealed(
        f"{talker}RMB,{status},{error},{leg.origin},{leg.destination},{place},{distance},{bearing},{closing},{arrived},"
        f"{'A' if status == 'A' else 'N'}"
    )


def _status(leg: Leg, valid: bool) -> str:
    return _letter(valid and _known(leg.cross_track, leg.bearing))


def _letter(holds: bool) -> str:
    return "A" if holds else "V"


def _cross_track(leg: Leg, valid: bool, most: float) -> str:
    """Distance off the leg (nautical miles) and the direction to steer: L (port) if the boat is to starboard."""
    if _status(leg, valid) == "V":
        return ","
    side = "L" if leg.cross_track > 0.0 else "R"
    return f"{_fixed(min(abs(leg.cross_track) / NAUTICAL_MILE, most), 1.0, 4 if most == math.inf else 2)},{side}"


def _known(*values: float | None) -> bool:
    return all(value is not None and math.isfinite(value) for value in values)


def _fixed(value: float | None, scale: float, decimals: int) -> str:
    return f"{value * scale:.{decimals}f}" if value is not None and math.isfinite(value) else ""


def _course(angle: float | None) -> str:
    """Degrees in [0, 360) with two decimals; empty if unknown."""
    if angle is None or not math.isfinite(angle):
        return ""
    return f"{round(math.degrees(angle) * 100.0) % 36000 / 100.0:.2f}"


def _clock(time: float) -> tuple[str, str]:
    """hhmmss.sss and ddmmyy of a Unix time; both empty if unknown."""
    if not _known(time):
        return "", ""
    milliseconds = round(time * 1000.0)
    moment = datetime.fromtimestamp(milliseconds // 1000, UTC)
    return f"{moment:%H%M%S}.{milliseconds % 1000:03d}", f"{moment:%d%m%y}"


def _place(latitude: float, longitude: float) -> str:
    turned = math.remainder(longitude, 2.0 * math.pi)
    return f"{_angle(latitude, 2, 'NS')},{_angle(turned, 3, 'EW')}"


def _angle(radians: float, width: int, letters: str) -> str:
    """The angle as ddmm.mmmmmmm,N, computed in whole units of the last digit."""
    scale = 10**_DECIMALS
    units = round(abs(math.degrees(radians)) * 60.0 * scale)
    degrees, rest = divmod(units, 60 * scale)
    minutes, fraction = divmod(rest, scale)
    return f"{degrees:0{width}d}{minutes:02d}.{fraction:0{_DECIMALS}d},{letters[0] if radians >= 0.0 else letters[1]}"
