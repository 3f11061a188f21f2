"""What an output is: it gets every row of a fix and every tick, and sends what it needs.

Unknown values are sent as unknown: status V, null. No row is sent twice.
"""

import math

from steerway.core.leg import Leg
from steerway.live.links.link import Sink
from steerway.live.rows import Order, Row


class Output:
    """One form of output; as it is here, it sends nothing."""

    def fix(self, row: Row) -> None:
        """The row of a fix."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """The row of a tick, with the leg under way and the order where there are any."""

    def close(self) -> None:
        """The run ends."""


class SinkOutput(Output):
    """An output whose messages go to a sink, which it closes."""

    def __init__(self, sink: Sink):
        self.sink = sink

    def close(self) -> None:
        self.sink.close()

    @property
    def has_peer(self) -> bool:
        """Whether somebody takes the messages, as far as the link shows."""
        return getattr(self.sink, "has_peer", True)


SLACK = 1e-4
"""Periods by which a row may be early: Unix times in float64 resolve a quarter of a microsecond."""


class Rhythm:
    """True once in every period of the rows' time, and at once when time goes back."""

    def __init__(self, period: float):
        self._period = period
        self._beat = math.nan

    def is_due(self, time: float) -> bool:
        """Whether a row of this time is the first of its period. Without a time: never."""
        beat = math.floor(time / self._period + SLACK) if math.isfinite(time) else self._beat
        is_new = beat != self._beat and math.isfinite(time)
        self._beat = beat
        return is_new
