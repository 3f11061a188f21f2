"""What an output is: it is told every row a fix and every tick, and takes what it needs.

What is unknown is said to be unknown: status V, null. No row is ever said twice.
"""

from typing import Protocol

from steerway.formats.nmea0183.writing import Leg
from steerway.live.autopilot.states import Order
from steerway.live.heard import Row


class Output(Protocol):
    """Something that says rows."""

    def fix(self, row: Row) -> None:
        """A fix was taken."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """Time has gone on; a row, and the leg under way and the order where there is one."""

    def close(self) -> None:
        """The run is over."""
