"""Commands for two propellers, for a motor driver of one's own: lines of JSON.

`{"time": …, "state": "running", "port": 0.61, "starboard": 0.48}`: −1 to 1 of full speed, where thrust goes with the
square of the speed; null: nothing is commanded. A driver has to stop by itself when lines stay away.
"""

import json

from steerway.formats.nmea0183.writing import Leg
from steerway.live.autopilot.states import Order
from steerway.live.heard import Row
from steerway.live.links.speakers import Speaker
from steerway.live.outputs.rhythm import Rhythm

PERIOD = 0.1
"""s between two commands."""


class Propellers:
    """A line once a period, and at once when the autopilot's state changes."""

    def __init__(self, speaker: Speaker, period: float = PERIOD):
        self.speaker = speaker
        self._rhythm = Rhythm(period)
        self._state = None

    def fix(self, row: Row) -> None:
        """See Output."""

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if order is None:
            return
        is_due = self._rhythm.strikes(row.time)
        if is_due or order.state is not self._state:
            self._state = order.state
            self.speaker.send(propeller_line(row.time, order))

    def close(self) -> None:
        """See Output."""
        self.speaker.close()


def propeller_line(time: float, order: Order) -> bytes:
    """An order as a line, with its line end."""
    port, starboard = (order.port, order.starboard) if order.engaged else (None, None)
    said = {"time": round(time, 3), "state": order.state.value, "port": port, "starboard": starboard}
    return json.dumps(said).encode() + b"\n"
