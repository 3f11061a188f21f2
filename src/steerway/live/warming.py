"""Compile before sailing what a live run compiles, so that the boat does not wait for it at her first fix."""

import asyncio
import math

from steerway.formats.nmea0183.writing import gga, rmc
from steerway.live.decoding import ReceiverDecoder
from steerway.live.navigator import Navigator
from steerway.live.service import Service

_SECONDS = 30


def warm() -> int:
    """Sail a short line through reader, filter and clock; the number of rows that came out of it."""
    decoder, navigator = ReceiverDecoder(), Navigator("small-usv")
    rows = []
    for k in range(_SECONDS):
        place = math.radians(54.0 + 3e-5 * k), math.radians(10.0)
        rows += decoder.feed((gga(1.7e9 + k, *place) + rmc(1.7e9 + k, *place)).encode())
    asyncio.run(Service(navigator, ()).replay(rows + decoder.settle()))
    return navigator.counts["taken"]
