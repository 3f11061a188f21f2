"""What an output is: it gets every row of a fix and every tick, and sends what it needs.

Unknown values are sent as unknown: status V, null. No row is sent twice.
"""

from typing import Protocol

from steerway.core.leg import Leg
from steerway.live.base.orders import Order
from steerway.live.base.rows import Row


class Output(Protocol):
    """One form of output."""

    def fix(self, row: Row) -> None:
        """The row of a fix."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """The row of a tick, with the leg under way and the order where there are any."""

    def close(self) -> None:
        """The run ends."""
