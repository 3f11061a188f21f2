"""The papers' rules for switching waypoints as printed: P1 (45)–(46), corrected with `printed=False`, and P4 (22) with
its missed-waypoint test (Motwani, Sharma, Sutton and Culverhouse: weighted interval Kalman filter on Springer). For
studies and tests.
"""

import math

from steerway.core import LegState


def along_track(north, east, north_0, east_0, direction, printed=True):
    """P1 (46): along-track error x_e (m) from a leg's beginning; printed with sine and cosine exchanged."""
    c, s = math.cos(direction), math.sin(direction)
    if printed:
        c, s = s, c
    return (north - north_0) * c + (east - east_0) * s


def switches(length, along, radius, printed=True):
    """P1 (45): whether the next waypoint is taken; printed with |x_e|, so that a ship behind the leg switches."""
    return length - (abs(along) if printed else along) <= radius


class RangeRatePassing:
    """P4's missed-waypoint test. Reached inside the circle of acceptance, P4 (22); missed when it rises again.

    Beside a waypoint that is what is meant; a boat that turns round after switching triggers it too. Stands in for
    `Passing` in one mission.
    """

    time_factor = None
    time_margin = 0.0

    def __init__(self):
        self._target, self._last, self._fell = -1, math.inf, False

    def verdict(self, leg: LegState, acceptance: float, _: float = math.nan) -> tuple[bool, str] | None:
        if leg.target != self._target:
            self._target, self._last, self._fell = leg.target, math.inf, False
        rises, self._last = leg.distance > self._last, leg.distance
        if leg.distance <= acceptance:
            return True, "circle"
        missed = self._fell and rises
        self._fell = self._fell or not rises
        return (False, "range rate") if missed else None
