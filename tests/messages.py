"""Messages and documents of the formats with known content, for tests; those of NMEA 0183 are in `tests.sentences`."""

import datetime
import functools
import operator
import struct

from pyais import encode_dict
from pyubx2 import GET, UBXMessage

# AIS

REPORT = {
    "type": 1,
    "mmsi": 257591700,
    "lat": 63.5,
    "lon": 7.25,
    "speed": 12.5,
    "course": 181.5,
    "heading": 180,
    "second": 10,
    "turn": 0,
}


def sentences(**changes):
    return [each.encode() for each in encode_dict(REPORT | changes, talker_id="AI", radio_channel="A")]


def checksum(body):
    """The two digits behind the asterisk."""
    return b"%02X" % functools.reduce(operator.xor, body)


def tagged(clock, *lines):
    tag = b"c:%d" % clock
    return b"".join(b"\\%s*%s\\%s\r\n" % (tag, checksum(tag), line) for line in lines)


# NMEA 2000 as canboat text

STAMP = "2026-08-03T04:47:{:06.3f}Z"


def line(second, pgn, source, payload, stamp=STAMP):
    return f"{stamp.format(second)},2,{pgn},{source},255,{len(payload)},{payload.hex(',')}\n"


def position(latitude, longitude):
    return struct.pack("<ii", round(latitude * 1e7), round(longitude * 1e7))


def gnss(latitude, longitude, days=20668, clock=17220.5, method=1):
    return (
        struct.pack("<BHIqqq", 1, days, round(clock * 1e4), round(latitude * 1e16), round(longitude * 1e16), 0)
        + bytes([method << 4, 0xFC, 9])
        + struct.pack("<hhiB", 80, 120, 0, 0)
    )


def frames(payload, sequence=5):
    """A long message as it goes over the bus."""
    parts = [payload[:6], *(payload[at : at + 7] for at in range(6, len(payload), 7))]
    heads = [bytes([sequence << 5, len(payload)]), *(bytes([sequence << 5 | place]) for place in range(1, len(parts)))]
    return [(head + part).ljust(8, b"\xff") for head, part in zip(heads, parts, strict=True)]


# GPX

POINT = '<trkpt lat="{0}.5" lon="2.25"><ele>1</ele><time>2023-01-01T00:00:0{0}Z</time>{1}</trkpt>\n'
HEAD = '<?xml version="1.0"?>\n<gpx version="1.0" xmlns="http://www.topografix.com/GPX/1/0">'
TAIL = "</trkseg></trk></gpx>\n"


def document(*points, head=HEAD, name=""):
    return f"{head}<trk>{name}<trkseg>{''.join(points)}{TAIL}".encode()


POINTS = [POINT.format(second, "") for second in range(1, 8)]
WHOLE = document(*POINTS)

# UBX


def pvt(second=0.0, lat=-34.9, lon=138.6, start=1_500_465_600.0, **changes):
    """NAV-PVT of a sound fix, so many seconds after `start` (Unix s; 2017-07-19 12:00)."""
    moment = datetime.datetime.fromtimestamp(start + second, datetime.UTC)
    fields = {name: getattr(moment, name) for name in ("year", "month", "day", "hour", "second")}
    fields |= {
        "iTOW": round(1000.0 * (start + second - 315_964_800.0)) % 604_800_000,
        "min": moment.minute,
        "nano": 1000 * moment.microsecond,
        "validDate": 1,
        "validTime": 1,
        "fixType": 3,
        "gnssFixOk": 1,
        "diffSoln": 1,
        "lat": lat,
        "lon": lon,
        "hAcc": 1414,
        "gSpeed": 1500,
        "headMot": 90.25,
    }
    return UBXMessage("NAV", "NAV-PVT", GET, **(fields | changes)).serialize()


# ROS 2


def nav_sat_fix(time, latitude, longitude, status=0, variance=0.25, frame="gps"):
    """A NavSatFix message as a ROS 2 node writes it."""
    data = bytearray(struct.pack("<BBBBiI", 0, 1, 0, 0, int(time), round(time % 1.0 * 1e9)))
    data += struct.pack("<I", len(frame) + 1) + frame.encode() + b"\0"
    data += struct.pack("<b", status)
    data += bytes(-(len(data) - 4) % 2) + struct.pack("<H", 1)
    data += bytes(-(len(data) - 4) % 8)
    data += struct.pack("<3d9dB", latitude, longitude, 0.0, *[variance, 0, 0, 0, variance, 0, 0, 0, 1.0], 2)
    return bytes(data)
