"""Lines of JSON."""

import json
import math

from steerway.core.records import MOTION_COLUMNS, STATUSES
from steerway.formats.nmea0183.writing import Leg
from steerway.live.autopilot.states import Order
from steerway.live.heard import Row
from steerway.live.links.speakers import Speaker


class JsonLines:
    """A line of JSON a fix, or with `every_tick` a line a tick; the columns are those of `estimate`.

    With an autopilot aboard its `state` and `reason` (null when all is well) as well, of the tick before a fix.
    """

    def __init__(self, speaker: Speaker, every_tick: bool = False):
        self.speaker, self.every_tick = speaker, every_tick
        self._order: Order | None = None

    def fix(self, row: Row) -> None:
        """See Output."""
        if not self.every_tick:
            self.speaker.send(json_line(row, self._order))

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        self._order = order
        if self.every_tick and math.isfinite(row.time):
            self.speaker.send(json_line(row, order))

    def close(self) -> None:
        """See Output."""
        self.speaker.close()


def json_line(row: Row, order: Order | None = None) -> bytes:
    """A row under the outward names of its columns, null for unknown, with its line end."""
    said = {}
    for name, (field, convert) in MOTION_COLUMNS.items():
        value = float(convert(getattr(row, field)))
        said[name] = value if math.isfinite(value) else None
    said["status"] = STATUSES[row.status]
    if order is not None:
        said |= {"state": order.state.value, "reason": order.reason or None}
    return json.dumps(said).encode() + b"\n"
