"""NMEA 2000 messages as canboat text."""

import struct

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
