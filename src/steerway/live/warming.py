"""Compile beforehand what a live run compiles, so that the first fix does not wait for it."""

import asyncio
import math

import numpy as np

from steerway.build import DEFAULT_KINDS
from steerway.core.records import Fixes
from steerway.estimation.learning import LearningFilter
from steerway.estimation.log.run import infer_log
from steerway.formats.nmea0183.writing import gga, rmc
from steerway.live.autopilot.measured import measured_speed
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.supervisor import Supervisor
from steerway.live.links.decoding import ReceiverDecoder
from steerway.live.links.link import Sink
from steerway.live.navigator import Navigator
from steerway.live.outputs.lines import JsonLines, SentenceOutput
from steerway.live.outputs.signalk_output import Deltas
from steerway.live.rows import InputRow
from steerway.live.service import LOG, Service
from steerway.live.settings import EstimatorSettings

_SECONDS = 30
_RATE = 5.0
"""Tick rate, Hz: the lowest that runs every code path."""
_STEP = 3e-7  # rad to the north each second


class _NullSink(Sink):
    """A sink that drops everything."""

    def send(self, message: bytes) -> None:
        pass


def warm(kinds: tuple[str, str] = DEFAULT_KINDS, estimators: EstimatorSettings = EstimatorSettings()) -> int:  # noqa: B008
    """Run a short track through decoder, filter, route, autopilot and outputs; the number of fixes that were used.

    The autopilot, speed controller and estimators are those that will run.
    """
    decoder, navigator = ReceiverDecoder(), Navigator(LearningFilter(background=False))
    place, rows = (math.radians(54.0), math.radians(10.0)), []
    for k in range(_SECONDS):
        moment = 1.7e9 + k, place[0] + _STEP * k, place[1]
        rows += decoder.feed((gga(*moment) + rmc(*moment)).encode())
    route = GeodeticRoute(place[0] + _STEP * np.array([0.0, 15.0, 1000.0]), np.full(3, place[1]))
    measured = measured_speed(estimators.speed)
    supervisor = Supervisor(route, engage=True, kinds=kinds, measured=measured, heading=estimators.heading)
    outputs = [SentenceOutput(_NullSink(None)), Deltas(_NullSink(None)), JsonLines(_NullSink(None))]
    was_disabled, LOG.disabled = LOG.disabled, True
    try:
        asyncio.run(
            Service(navigator, outputs, _RATE, supervisor=supervisor).replay(rows + decoder.complete_on_silence())
        )
    finally:
        LOG.disabled = was_disabled
    _infer()
    for k in range(_SECONDS):  # with a velocity and a heading too
        later = rows[-1].time + 1.0 + k
        supervisor.estimator.filter.fix(later, 2.0 * k, 0.0, 2.0, 0.0, 0.0)
        supervisor.take(InputRow("", later, sog=2.0, cog=0.0, heading=0.0, bottom_speed=2.0, acceleration=0.0))
    return navigator.counts["used"]


def _infer() -> None:
    """What the first inference compiles; more fixes compile no more."""
    chance = np.random.default_rng(0)
    latitude = math.radians(54.0) + _STEP * np.arange(12.0) + chance.normal(0.0, 1e-8, 12)
    infer_log(Fixes(1.7e9 + np.arange(12.0), latitude, np.full(12, math.radians(10.0))))
