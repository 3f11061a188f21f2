"""Compile before sailing what a live run compiles, so that the boat does not wait for it at her first fix."""

import asyncio
import math

import numpy as np

from steerway.formats.nmea0183.writing import gga, rmc
from steerway.live.autopilot import Autopilot
from steerway.live.decoding import SentenceDecoder
from steerway.live.mission import GeodeticRoute
from steerway.live.navigator import Navigator
from steerway.live.route import Guide
from steerway.live.service import RATE, Service

_SECONDS = 30


def warm() -> int:
    """Sail a short line through reader, filter, clock and autopilot; the number of rows that came out of it."""
    decoder, navigator = SentenceDecoder(), Navigator("small-usv")
    rows = []
    for k in range(_SECONDS):
        place = math.radians(54.0 + 3e-5 * k), math.radians(10.0)
        rows += decoder.feed((gga(1.7e9 + k, *place) + rmc(1.7e9 + k, *place)).encode())
    line = GeodeticRoute(np.radians([54.0, 54.1]), np.radians([10.0, 10.0]))
    aboard = Guide(line), Autopilot(line, engage=True)
    asyncio.run(Service(navigator, (), RATE, 0.0, *aboard).replay(rows + decoder.settle()))
    return navigator.counts["taken"]
