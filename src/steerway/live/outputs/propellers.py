"""Commands of two propellers for a motor driver: lines of JSON.

`{"time": …, "state": "running", "port": 0.61, "starboard": 0.48}`: −1 to 1 of full speed, where thrust goes with the
square of the speed; null: no command. The driver has to stop by itself when no line comes.
"""

import json

from steerway.core.leg import Leg
from steerway.live.links.link import Sink
from steerway.live.outputs.output import Rhythm, SinkOutput
from steerway.live.rows import Order, Row, State

PERIOD = 0.1
"""s between two commands."""


class PropellerCommands(SinkOutput):
    """A line once a period, and at once when the autopilot's state changes."""

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
        """Why no command reaches the motors, "" as far as the link shows."""
        return "" if self.has_peer else "nothing is connected that drives the motors"


def propeller_line(time: float, order: Order) -> bytes:
    """An order as a line, with its line end."""
    port, starboard = (order.port, order.starboard) if order.engaged else (None, None)
    line = {"time": round(time, 3), "state": order.state.value, "port": port, "starboard": starboard}
    return json.dumps(line).encode() + b"\n"
