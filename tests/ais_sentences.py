"""AIS messages as sentences."""

import functools
import operator

from pyais import encode_dict

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
