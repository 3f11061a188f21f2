"""P4's missed-waypoint test as printed."""

import math

from steerway.core import LegState


class RangeRatePassing:
    """Reached inside the circle of acceptance, P4 (22); missed when the distance, having fallen, rises.

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
