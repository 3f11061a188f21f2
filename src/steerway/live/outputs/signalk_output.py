"""Signal K deltas: motion, the leg under way, the state of the autopilot; SI and rad.

A value that becomes unknown is sent as null once and then not at all, so that a server with source priorities changes
to another source. A position is never null.
Paths and states are those of the Signal K specification 1.5.1, groups navigation, steering and notifications.
"""

import json
import math
from typing import Any

from steerway.core.leg import UNKNOWN_LEG, Leg
from steerway.core.timestamps import iso
from steerway.live.links.link import Sink
from steerway.live.outputs.output import Rhythm, SinkOutput, or_null
from steerway.live.rows import FIT, Order, Row, State

POSITION = "navigation.position"
_STATES = {
    State.IDLE: "standby",
    State.READY: "standby",
    State.RUNNING: "route",
    State.DEGRADED: "route",
    State.STOPPED: "alarm",
    State.FINISHED: "standby",
}


class Deltas(SinkOutput):
    """Sends a delta at the first fix of a period (s), at ticks while fixes are missing, and at a change of the state.

    positions: whether the position is sent.
    """

    def __init__(self, sink: Sink, period: float = 1.0, positions: bool = True):
        super().__init__(sink)
        self.period, self.positions = period, positions
        self._known: set[str] = set()  # paths whose last value was not null
        self._rhythm = Rhythm(period)
        self._last = -math.inf
        self._leg: Leg | None = None
        self._order: Order | None = None
        self._on_route = False

    def fix(self, row: Row) -> None:
        """See Output."""
        if self._rhythm.is_due(row.time):
            self._send(row)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        before, self._leg, self._order = self._order, leg, order
        self._on_route |= leg is not None
        changed = order if order is not None and (before is None or before.state is not order.state) else None
        if changed or row.time - self._last >= 1.5 * self.period:
            self._send(row, notification(changed) if changed and _alarms(before, changed) else {})

    def leg_unreachable(self) -> str:
        """The reason why another autopilot does not receive the leg; "" if the link shows none."""
        return "" if self.has_peer else "the Signal K server is not connected"

    def _send(self, row: Row, more: dict[str, Any] | None = None) -> None:
        self._last = row.time
        values = motion(row)
        if not self.positions:
            del values[POSITION]
        if self._on_route:
            fit = self._order is None or self._order.state in FIT
            values |= course(self._leg if fit and not math.isnan(row.cog) else None)
        if self._order is not None:
            values |= autopilot(self._order)
        values |= more or {}
        sent = {path: value for path, value in values.items() if value is not None or path in self._known}
        sent = {path: value for path, value in sent.items() if value is not None or not path.endswith("position")}
        self._known = {path for path, value in values.items() if value is not None}
        if sent:
            self.sink.send(delta(row.time, sent))


def delta(time: float, values: dict[str, Any]) -> bytes:
    """A delta message with values by path; `time` is Unix time, s."""
    update = {
        "$source": "steerway",
        "timestamp": iso(round(time, 3)),
        "values": [{"path": path, "value": value} for path, value in values.items()],
    }
    return json.dumps({"context": "vessels.self", "updates": [update]}).encode()


def motion(row: Row) -> dict[str, Any]:
    """The values of a row by path; course in [0, 2π)."""
    return {
        POSITION: _place(row.latitude, row.longitude),
        "navigation.speedOverGround": or_null(row.sog),
        "navigation.courseOverGroundTrue": _angle(row.cog),
        "navigation.rateOfTurn": or_null(row.course_rate),
    }


def course(leg: Leg | None) -> dict[str, Any]:
    """The values of a leg by path; all null without a leg."""
    leg = leg or UNKNOWN_LEG
    return {
        "navigation.courseGreatCircle.crossTrackError": or_null(leg.cross_track),
        "navigation.courseGreatCircle.bearingTrackTrue": _angle(leg.direction),
        "navigation.courseGreatCircle.nextPoint.position": _place(leg.latitude, leg.longitude),
        "navigation.courseGreatCircle.nextPoint.distance": or_null(leg.distance),
        "navigation.courseGreatCircle.nextPoint.bearingTrue": _angle(leg.bearing),
        "navigation.courseGreatCircle.nextPoint.velocityMadeGood": or_null(leg.closing_speed),
    }


def autopilot(order: Order) -> dict[str, Any]:
    """The state of the autopilot by path.

    Signal K only has a target heading. It gets the course to steer, as the heading field of NMEA's APB does.
    """
    return {
        "steering.autopilot.state": _STATES[order.state],
        "steering.autopilot.target.headingTrue": _angle(order.course),
    }


def notification(order: Order) -> dict[str, Any]:
    """An alarm if the autopilot has stopped; the end of the alarm in any other state."""
    stopped = order.state is State.STOPPED
    value = {
        "state": "alarm" if stopped else "normal",
        "method": ["visual", "sound"] if stopped else [],
        "message": f"Autopilot {order.state}" + (f": {order.reason}" if order.reason else ""),
    }
    return {"notifications.steering.autopilot": value}


def _alarms(before: Order | None, order: Order) -> bool:
    """Whether an alarm begins or ends."""
    return order.state is State.STOPPED or (before is not None and before.state is State.STOPPED)


def _place(latitude: float, longitude: float) -> dict[str, float] | None:
    if math.isnan(latitude) or math.isnan(longitude):
        return None
    return {"latitude": math.degrees(latitude), "longitude": math.degrees(longitude)}


def _angle(value: float) -> float | None:
    return or_null(value % (2.0 * math.pi))
