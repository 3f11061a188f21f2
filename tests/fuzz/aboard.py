"""A boat under autopilot whose links deliver anything: the service has to go on, and every order to be a number."""

import contextlib
import math

from steerway.core import InputError
from steerway.live.testing import UNDER_WAY, InputRow
from tests.desk import NOON, OTTER, Desk, dock_all, square

_PATIENCE = 30.0  # s for which a boat may fail to start again before another one replaces it
_AS_SAID = 4  # one row in so many keeps its own time; the others get the present time


class Aboard:
    """A boat that receives foreign rows as from its own receiver, beside a sound fix every 0.2 s."""

    def __init__(self):
        self.desk, self._rows, self._taken = Desk(square(boat=OTTER)), [], 0
        self._idle_since = math.inf
        self._honest, self.desk.fixes = self.desk.fixes, self._fixes
        self.desk.start()

    def take(self, rows: list[InputRow]) -> str:
        """Receive rows; return the autopilot's state after them. Raises AssertionError if the service has ended or an
        order is not a number.
        """
        self._rows += [self._present(row) for row in rows]
        self.desk.sail(0.2)
        desk = self.desk
        assert not desk.running.done(), "the service has ended"
        for order in desk.output:
            assert math.isfinite(order.yaw_rate + order.thrust + order.port + order.starboard), order
        assert desk.navigator.counts["failed"] == 0, "a row raised"
        del desk.output[:], desk.rows[:]
        if desk.order.state in UNDER_WAY:
            self._idle_since = math.inf
        else:
            self._idle_since = min(self._idle_since, desk.time)
            with contextlib.suppress(InputError):
                desk.autopilot.start()
        return f"{desk.order.state}"

    @property
    def is_spent(self) -> bool:
        """Whether its service was ended, or it has failed to start again for `_PATIENCE` s."""
        return self.desk.loop.is_closed() or self.desk.time - self._idle_since > _PATIENCE

    def _fixes(self, time, north, east):
        given, self._rows = self._rows, []
        return self._honest(time, north, east) + given

    def _present(self, row):
        self._taken += 1
        time = row.time if self._taken % _AS_SAID == 0 else NOON + self.desk.time
        return row._replace(source="gps", time=time)


_afloat: list[Aboard] = []


def afloat() -> Desk:
    """The boat that took the last rows."""
    return _afloat[0].desk


def said_aboard(rows: list[InputRow]) -> str:
    """The result of `Aboard.take` on a boat that lasts over many calls."""
    if not rows:
        return "nothing"
    if _afloat and _afloat[0].is_spent:
        _afloat.clear()
        dock_all()
    if not _afloat:
        _afloat.append(Aboard())
    return _afloat[0].take(rows)
