"""The base of outputs: an output receives the row of every fix and of every tick, and sends those it needs.

Unknown values are sent as unknown: status V, null. No row is sent twice.
"""

import math
from typing import Any

from steerway.core.leg import Leg
from steerway.live.links.link import Sink
from steerway.live.rows import Order, Row


class Output:
    """Base class of outputs; it sends nothing."""

    def fix(self, row: Row) -> None:
        """Take the row of a fix."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """Take the row of a tick, the leg under way and the order (None without)."""

    def close(self) -> None:
        """End the output with the run."""


class SinkOutput(Output):
    """An output that sends its messages to a sink, and closes it."""

    def __init__(self, sink: Sink):
        self.sink = sink

    def close(self) -> None:
        self.sink.close()

    @property
    def has_peer(self) -> bool:
        """Whether a receiver is connected; True if the link does not show it."""
        return getattr(self.sink, "has_peer", True)


def or_null(value: Any) -> Any:
    """A value for JSON: NaN and infinity become null; every other float reads back the same."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


SLACK = 1e-4
"""Fraction of a period by which a row may be early: Unix times in float64 resolve a quarter of a microsecond."""


class Rhythm:
    """Selects the first row of every period (s) by the rows' times; also after time has gone back."""

    def __init__(self, period: float):
        self._period = period
        self._beat = math.nan

    def is_due(self, time: float) -> bool:
        """Whether a row of this time is the first of its period; False for NaN."""
        beat = math.floor(time / self._period + SLACK) if math.isfinite(time) else self._beat
        is_new = beat != self._beat and math.isfinite(time)
        self._beat = beat
        return is_new
