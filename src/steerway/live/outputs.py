"""What is said, and when: sentences for instruments, lines of JSON. Others: `deltas`, `propellers`, `table`.

An output is told every row a fix and every tick, and takes what it needs. What is unknown is said to be unknown: status
V, null. No row is ever said twice.
"""

import json
import math
from typing import Protocol

from steerway.formats.nmea0183.writing import Leg, apb, rmb, rmc, rot, vtg, xte
from steerway.live.autopilot import FIT, Order
from steerway.live.heard import Row
from steerway.live.links.speakers import Speaker
from steerway.live.rhythm import Rhythm
from steerway.records import MOTION_COLUMNS, STATUSES


class Output(Protocol):
    """Something that says rows."""

    def fix(self, row: Row) -> None:
        """A fix was taken."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """Time has gone on; a row, and the leg under way and the order where there is one."""

    def close(self) -> None:
        """The run is over."""


class Sentences:
    """RMC, VTG and ROT once a period (s), and APB, XTE and RMB on a route, as instruments and autopilots expect."""

    def __init__(self, speaker: Speaker, period: float = 1.0):
        self.speaker = speaker
        self._rhythm = Rhythm(period)

    def fix(self, row: Row) -> None:
        """See Output."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if self._rhythm.strikes(row.time):
            self.speaker.send("".join(self.said(row, leg, order)).encode())

    def close(self) -> None:
        """See Output."""
        self.speaker.close()

    def said(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> list[str]:
        """The sentences of a row. Where to steer is said only where course is known and the autopilot fit to steer."""
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
