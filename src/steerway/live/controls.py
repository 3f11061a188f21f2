"""What may be asked of a run while it runs: by the helm page, by the control port, and through it by other programs."""

import logging
import math
from typing import NamedTuple

from steerway.core.errors import InputError
from steerway.live.autopilot.supervisor import Supervisor
from steerway.live.rows import UNDER_WAY, Row, lost

LOG = logging.getLogger("steerway.live")
PRESENT = "present"
"""The request that asks for nothing."""
_TURNS = 1e6  # rad; of a larger number the angle is not known to a degree
_LARGEST = math.radians(90.0)  # of one adjustment of the course


class Mark(NamedTuple):
    """A man overboard: where and when (Unix s; rad)."""

    time: float
    latitude: float
    longitude: float


class Controls:
    """Requests by name: start, stop, hold-course, adjust, hold-position, route, leg, mob, mob-over, present.

    Without a supervisor (no mission) only the mark of a man overboard can be set.
    """

    def __init__(self, supervisor: Supervisor | None = None):
        self.supervisor = supervisor
        self.guide = None if supervisor is None else supervisor.guide
        self.mark: Mark | None = None
        self.row: Row = lost(math.nan)
        self._requests = {
            "start": self._start,
            "stop": self._stop,
            "hold-course": self._hold_course,
            "adjust": self._adjust,
            "hold-position": self._hold_position,
            "route": self._route,
            "leg": self._leg,
            "mob": self._mob,
            "mob-over": self._mob_over,
        }

    def present(self) -> None:
        """A page or a program that commands gave a sign of life."""
        if self.supervisor is not None:
            self.supervisor.operator_heard()

    def do(self, what: str, value: object, who: str) -> None:
        """Carry out a request. Raises InputError that says why it is refused."""
        self.present()
        if what == PRESENT:
            return
        request = self._requests.get(what) if isinstance(what, str) else None
        if request is None:
            raise InputError(f"request is {what!r}, expected one of {', '.join(self._requests)}")
        LOG.info("%s requests %s%s", who, what, "" if value is None else f" {value}")
        try:
            request(value, who)
        except InputError as error:
            LOG.info("%s: refused: %s", who, error)
            raise

    def state(self) -> dict:
        """The state for other programs: angles in rad, null for unknown."""
        if self.supervisor is None:
            return {"state": None, "reason": "", "mode": None, "target": None, "engaged": False}
        course = self.guide.course if self.guide.mode == "course" else math.nan
        return {
            "state": self.supervisor.state.value,
            "reason": self.supervisor.reason,
            "mode": self.guide.mode,
            "target": None if math.isnan(course) else course % (2.0 * math.pi),
            "engaged": self.supervisor.state in UNDER_WAY,
        }

    def _steering(self):
        if self.supervisor is None:
            raise InputError("nothing is steered, expected a run with --mission")
        return self.supervisor

    def _start(self, value, who):
        self._steering().start()

    def _stop(self, value, who):
        self._steering().stop(f"stopped at {who}")

    def _hold_course(self, value, who):
        self._steering()
        self.guide.hold_course(None if value is None else _number(value))

    def _adjust(self, value, who):
        self._steering()
        by = _number(value)
        if abs(by) > _LARGEST:
            raise InputError(f"adjustment is {math.degrees(by):.0f}°, expected at most {math.degrees(_LARGEST):.0f}°")
        self.guide.adjust(by)

    def _hold_position(self, value, who):
        self._steering()
        self.guide.hold_position()

    def _route(self, value, who):
        self._steering()
        self.guide.follow()

    def _leg(self, value, who):
        self._steering()
        self.guide.follow(value)

    def _mob(self, value, who):
        if not self.row.valid:
            raise InputError("the position is not known, expected one to mark")
        self.mark = Mark(self.row.time, self.row.latitude, self.row.longitude)
        LOG.warning(
            "man overboard marked at %.6f° %.6f°", math.degrees(self.mark.latitude), math.degrees(self.mark.longitude)
        )

    def _mob_over(self, value, who):
        self.mark = None


def _number(value):
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf:
        raise InputError(f"value is {value!r}, expected a number in rad")
    if abs(value) > _TURNS:
        raise InputError(f"value is beyond {_TURNS:g} rad, expected an angle")
    return float(value)
