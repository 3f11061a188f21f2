"""Lines: JSON for programs, NMEA 0183 sentences for instruments and autopilots, commands for two propellers."""

import json
import math

from steerway.core.leg import Leg
from steerway.core.records import MOTION_COLUMNS, STATUSES
from steerway.formats.nmea0183.writing import apb, rmb, rmc, rot, vtg, xte
from steerway.live.links.link import Sink
from steerway.live.outputs.output import Rhythm, SinkOutput, or_null
from steerway.live.rows import FIT, Order, Row, State


class JsonLines(SinkOutput):
    """Sends a line of JSON per fix, or with `every_tick` per tick; its columns are those of `estimate`.

    With an autopilot the line also has `state` and `reason` (null for none); at a fix they are those of the last tick.
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
    """A row as a line of JSON, under the public names of its columns; null for unknown values."""
    columns: dict[str, float | str | None] = {}
    for name, (field, convert) in MOTION_COLUMNS.items():
        columns[name] = or_null(float(convert(getattr(row, field))))
    columns["status"] = STATUSES[row.status]
    if order is not None:
        columns |= {"state": order.state.value, "reason": order.reason or None}
    return json.dumps(columns).encode() + b"\n"


PERIOD = 0.1
"""Time between two commands, s."""


class PropellerCommands(SinkOutput):
    """Sends lines of JSON to a motor driver, once a period, and at once when the autopilot's state changes.

    `{"time": …, "state": "running", "port": 0.61, "starboard": 0.48}`: propeller speeds, −1 to 1 of full speed; thrust
    grows with the square of the speed. null: no command. The driver has to stop the motors when no line arrives.
    """

    def __init__(self, sink: Sink, period: float = PERIOD):
        super().__init__(sink)
        self._rhythm = Rhythm(period)
        self._state: State | None = None

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if order is None:
            return
        is_due = self._rhythm.is_due(row.time)
        if is_due or order.state is not self._state:
            self._state = order.state
            self.sink.send(propeller_line(row.time, order))

    def unreachable(self) -> str:
        """The reason why no command reaches the motors; "" if the link shows none."""
        return "" if self.has_peer else "no motor driver is connected"


def propeller_line(time: float, order: Order) -> bytes:
    """An order as a line of JSON."""
    port, starboard = (order.port, order.starboard) if order.engaged else (None, None)
    line = {"time": round(time, 3), "state": order.state.value, "port": port, "starboard": starboard}
    return json.dumps(line).encode() + b"\n"


class SentenceOutput(SinkOutput):
    """Sends RMC, VTG and ROT once a period (s), on a route also APB, XTE and RMB for another autopilot."""

    def __init__(self, sink: Sink, period: float = 1.0):
        super().__init__(sink)
        self._rhythm = Rhythm(period)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if self._rhythm.is_due(row.time):
            self.sink.send("".join(self.sentences(row, leg, order)).encode())

    def leg_unreachable(self) -> str:
        """The reason why another autopilot does not receive the leg; "" if the link shows none."""
        return "" if self.has_peer else "no receiver of the sentences is connected"

    def sentences(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> list[str]:
        """The sentences of a row; the leg's are valid only while the course is known and the state is in `FIT`."""
        valid = row.valid and not math.isnan(row.sog)
        steering = []
        if leg is not None:
            is_usable = row.valid and not math.isnan(row.cog) and (order is None or order.state in FIT)
            steering = [sentence(leg, valid=is_usable) for sentence in (apb, xte, rmb)]
        return [
            rmc(row.time, row.latitude, row.longitude, row.sog, row.cog, valid=row.valid),
            vtg(row.sog, row.cog, valid=valid),
            rot(row.course_rate, valid=row.valid),
            *steering,
        ]
