"""Sentences of NMEA 0183 for instruments and autopilots."""

import math

from steerway.core.leg import Leg
from steerway.formats.nmea0183.writing import apb, rmb, rmc, rot, vtg, xte
from steerway.live.links.link import Sink
from steerway.live.outputs.output import Rhythm, SinkOutput
from steerway.live.rows import FIT, Order, Row


class SentenceOutput(SinkOutput):
    """RMC, VTG and ROT once a period (s), and APB, XTE and RMB on a route, as instruments and autopilots expect."""

    def __init__(self, sink: Sink, period: float = 1.0):
        super().__init__(sink)
        self._rhythm = Rhythm(period)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if self._rhythm.is_due(row.time):
            self.sink.send("".join(self.sentences(row, leg, order)).encode())

    def leg_unreachable(self) -> str:
        """Why another autopilot does not get the leg, "" as far as the link shows."""
        return "" if self.has_peer else "nothing is connected that takes sentences"

    def sentences(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> list[str]:
        """The sentences of a row. Those of the leg are valid only while the course is known and the autopilot fit."""
        valid = row.valid and not math.isnan(row.sog)
        steering = []
        if leg is not None:
            knows = row.valid and not math.isnan(row.cog) and (order is None or order.state in FIT)
            steering = [sentence(leg, valid=knows) for sentence in (apb, xte, rmb)]
        return [
            rmc(row.time, row.latitude, row.longitude, row.sog, row.cog, valid=row.valid),
            vtg(row.sog, row.cog, valid=valid),
            rot(row.course_rate, valid=row.valid),
            *steering,
        ]
