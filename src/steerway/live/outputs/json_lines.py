"""Lines of JSON."""

import json
import math

from steerway.core.leg import Leg
from steerway.core.records import MOTION_COLUMNS, STATUSES
from steerway.live.links.link import Sink
from steerway.live.outputs.output import SinkOutput
from steerway.live.rows import Order, Row


class JsonLines(SinkOutput):
    """A line of JSON a fix, or with `every_tick` a line a tick; the columns are those of `estimate`.

    With an autopilot also its `state` and `reason` (null for none), of the tick before a fix.
    """

    def __init__(self, sink: Sink, every_tick: bool = False):
        super().__init__(sink)
        self.every_tick = every_tick
        self._order: Order | None = None

    def fix(self, row: Row) -> None:
        """See Output."""
        if not self.every_tick:
            self.sink.send(json_line(row, self._order))

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        self._order = order
        if self.every_tick and math.isfinite(row.time):
            self.sink.send(json_line(row, order))


def json_line(row: Row, order: Order | None = None) -> bytes:
    """A row under the outward names of its columns, null for unknown, with its line end."""
    columns: dict[str, float | str | None] = {}
    for name, (field, convert) in MOTION_COLUMNS.items():
        value = float(convert(getattr(row, field)))
        columns[name] = value if math.isfinite(value) else None
    columns["status"] = STATUSES[row.status]
    if order is not None:
        columns |= {"state": order.state.value, "reason": order.reason or None}
    return json.dumps(columns).encode() + b"\n"
