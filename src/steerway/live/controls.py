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
_LARGEST = 1e6  # of an angle in rad: of a larger number it is not known to a degree; and of what else is given
_ADJUSTED = math.radians(90.0)  # at most by one request


class Mark(NamedTuple):
    """A man overboard: where and when (Unix s; rad)."""

    time: float
    latitude: float
    longitude: float


class Controls:
    """Requests by name: start, stop, hold-course, adjust, hold-position, route, leg, dodge, offset, faster, mob,
    mob-over, present.

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
            "dodge": self._dodge,
            "offset": self._offset,
            "faster": self._faster,
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
        mode, course, dodges, offset, faster = self.guide.followed
        return {
            "state": self.supervisor.state.value,
            "reason": self.supervisor.reason,
            "mode": mode,
            "target": None if math.isnan(course) else course % (2.0 * math.pi),
            "engaged": self.supervisor.state in UNDER_WAY,
            "dodging": dodges,
            "offset": offset,
            "faster": faster,
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
        self.guide.hold_course(_number(value, "rad"))

    def _adjust(self, value, who):
        self._steering()
        if value is None:
            raise InputError("adjustment is null, expected a number in rad")
        self.guide.adjust(_turn(value))

    def _dodge(self, value, who):
        self._steering()
        self.guide.dodge(_turn(value))

    def _offset(self, value, who):
        self._steering()
        self.guide.shift(_number(value, "m"))

    def _faster(self, value, who):
        self._steering()
        self.guide.change_speed(_number(value, "m/s"))

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


def _number(value, unit):
    """The number, or None for none."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf:
        raise InputError(f"value is {value!r}, expected a number in {unit}")
    if abs(value) > _LARGEST:
        raise InputError(f"value is beyond {_LARGEST:g} {unit}, expected a smaller number")
    return float(value)


def _turn(value):
    by = _number(value, "rad")
    if by is not None and abs(by) > _ADJUSTED:
        raise InputError(f"adjustment is {math.degrees(by):.0f}°, expected at most {math.degrees(_ADJUSTED):.0f}°")
    return by
