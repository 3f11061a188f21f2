"""Requests to a running service: from the helm page, and from other programs through the control port."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from steerway.core.errors import InputError
from steerway.live.autopilot.supervisor import Supervisor
from steerway.live.rows import UNDER_WAY, Row, lost
from steerway.live.uri import LOG

PRESENT = "present"
"""A request that changes nothing: a sign of life."""
_LARGEST = 1e6  # largest value of a request, in rad, m or m/s
_ADJUSTED = math.radians(90.0)  # largest change of course by one request


class Mark(NamedTuple):
    """Time (Unix, s) and position (rad) at which a man went overboard."""

    time: float
    latitude: float
    longitude: float


class Controls:
    """Carries out requests by name: `REQUESTS` and `PRESENT`. Without a supervisor (no mission) only MOB marks work."""

    def __init__(self, supervisor: Supervisor | None = None):
        self.supervisor = supervisor
        self.guide = None if supervisor is None else supervisor.guide
        self.mark: Mark | None = None
        self.row: Row = lost(math.nan)

    def present(self) -> None:
        """Take a sign of life from the page or program that commands the boat."""
        if self.supervisor is not None:
            self.supervisor.operator_heard()

    def do(self, what: object, value: object, who: str) -> None:
        """Carry out a request. Raises InputError with the reason if it is refused."""
        self.present()
        if what == PRESENT:
            return
        if what not in REQUESTS:
            raise InputError(f"request is {what!r}, expected one of {', '.join(REQUESTS)}")
        LOG.info("%s requests %s%s", who, what, "" if value is None else f" {value}")
        try:
            self._carry_out(str(what), value, who)
        except InputError as error:
            LOG.info("%s: refused: %s", who, error)
            raise

    def state(self) -> dict[str, Any]:
        """The state for other programs: angles in rad, null for unknown."""
        if self.supervisor is None:
            return {"state": None, "reason": "", "mode": None, "target": None, "engaged": False}
        mode, course, dodges, offset, faster = self.supervisor.guide.followed
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

    def _carry_out(self, what: str, value: Any, who: str) -> None:
        if what == "mob":
            self._mark()
        elif what == "mob-over":
            self.mark = None
        elif self.supervisor is None:
            raise InputError("this run has no autopilot, expected a run with --mission")
        else:
            _STEERING[what](self.supervisor, value, who)

    def _mark(self) -> None:
        if not self.row.valid:
            raise InputError("the position is not known and cannot be marked, expected a fix first")
        self.mark = Mark(self.row.time, self.row.latitude, self.row.longitude)
        LOG.warning(
            "man overboard marked at %.6f° %.6f°", math.degrees(self.mark.latitude), math.degrees(self.mark.longitude)
        )


def _number(value: Any, unit: str) -> float | None:
    """The value as a number, or None. Raises InputError for anything else."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < math.inf:
        raise InputError(f"value is {value!r}, expected a number in {unit}")
    if abs(value) > _LARGEST:
        raise InputError(f"value is beyond {_LARGEST:g} {unit}, expected a smaller number")
    return float(value)


def _needed(value: Any) -> float:
    turn = _turn(value)
    if turn is None:
        raise InputError("adjustment is null, expected a number in rad")
    return turn


def _turn(value: Any) -> float | None:
    by = _number(value, "rad")
    if by is not None and abs(by) > _ADJUSTED:
        raise InputError(f"adjustment is {math.degrees(by):.0f}°, expected at most {math.degrees(_ADJUSTED):.0f}°")
    return by


_STEERING: dict[str, Callable[[Supervisor, Any, str], None]] = {
    "start": lambda supervisor, value, who: supervisor.start(),
    "stop": lambda supervisor, value, who: supervisor.stop(f"stopped at {who}"),
    "hold-course": lambda supervisor, value, who: supervisor.guide.hold_course(_number(value, "rad")),
    "adjust": lambda supervisor, value, who: supervisor.guide.adjust(_needed(value)),
    "hold-position": lambda supervisor, value, who: supervisor.guide.hold_position(),
    "route": lambda supervisor, value, who: supervisor.guide.follow(),
    "leg": lambda supervisor, value, who: supervisor.guide.follow(value),
    "dodge": lambda supervisor, value, who: supervisor.guide.dodge(_turn(value)),
    "offset": lambda supervisor, value, who: supervisor.guide.shift(_number(value, "m")),
    "faster": lambda supervisor, value, who: supervisor.guide.change_speed(_number(value, "m/s")),
}
REQUESTS = (*_STEERING, "mob", "mob-over")
"""Names of requests. Their values: a course or turn (rad, + to starboard), m to starboard, m/s, or a leg's number."""
