"""Compile before sailing what a live run compiles, so that the boat does not wait for it at her first fix."""

import asyncio
import math

import numpy as np

from steerway.estimation.profiles import Profile
from steerway.formats.nmea0183.writing import gga, rmc
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.route import Guide
from steerway.live.autopilot.states import Autopilot
from steerway.live.decoding import ReceiverDecoder
from steerway.live.navigator import Navigator
from steerway.live.outputs.deltas import Deltas
from steerway.live.outputs.json_lines import JsonLines
from steerway.live.outputs.sentences import Sentences
from steerway.live.service import LOG, Service

_SECONDS = 30
_STEP = 3e-7  # rad to the north each second


class _Nobody:
    """A speaker to whom nobody listens."""

    def send(self, message):
        pass

    def close(self):
        pass


def warm() -> int:
    """Sail a short line through reader, filter, route, autopilot and outputs; the number of fixes that were taken."""
    decoder, navigator = ReceiverDecoder(), Navigator("small-usv")
    place, rows = (math.radians(54.0), math.radians(10.0)), []
    for k in range(_SECONDS):
        moment = 1.7e9 + k, place[0] + _STEP * k, place[1]
        rows += decoder.feed((gga(*moment) + rmc(*moment)).encode())
    route = GeodeticRoute(place[0] + _STEP * np.array([0.0, 15.0, 1000.0]), np.full(3, place[1]))
    autopilot = Autopilot(route, Profile.named("small-usv"), engage=True)
    outputs = [each(_Nobody()) for each in (Sentences, Deltas, JsonLines)]
    said, LOG.disabled = LOG.disabled, True
    try:
        asyncio.run(
            Service(navigator, outputs, guide=Guide(route), autopilot=autopilot).replay(rows + decoder.settle())
        )
    finally:
        LOG.disabled = said
    return navigator.counts["taken"]
