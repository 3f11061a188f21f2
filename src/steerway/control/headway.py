"""Whether a boat makes headway along the legs of its route."""

import math

from steerway.core.leg import LegState

LEAST_HEADWAY = 0.03
"""Smallest speed over ground along a leg, as a fraction of the top speed."""
_PATIENCE = 15.0
"""Time (s) for which the current has to exceed the boat's speed before the boat stops."""
_LONGEST_WITHOUT = 60.0
"""Longest time (s) without coming nearer to the waypoint; multiplied by the yaw time constant if that is above 1 s."""
_CARRIED, _CARRIED_TIME = 4.0, 8.0
"""Distance by which a boat may be carried back from its nearest approach to the waypoint: the larger of _CARRIED radii
of the tightest turn and _CARRIED_TIME s at top speed. On squares in a current of 65 % of its speed, a turn carries the
boat back by up to 12 m."""


class Headway:
    """Watches a boat's distance from its waypoint. top_speed: m/s; yaw_time: time constant of the yaw rate, s."""

    def __init__(self, top_speed: float, yaw_time: float):
        self._top_speed, self._least = top_speed, LEAST_HEADWAY * top_speed
        self._longest_without = _LONGEST_WITHOUT * max(1.0, yaw_time)
        self.restart()

    def restart(self) -> None:
        """Reset, when the boat begins to steer."""
        self.target = -1
        self._overpowered = self._without = self._carried_back = self._allowed_back = 0.0
        self._nearest = self._before = self._closest = math.inf

    @property
    def trouble(self) -> str:
        """Why the boat cannot follow the leg, "" while it can."""
        if self._overpowered > _PATIENCE:
            return "the current exceeds the boat's speed"
        if self._carried_back > self._allowed_back:
            return f"the boat is carried away from the waypoint, by {self._carried_back:.0f} m"
        if self._without > self._longest_without:
            return f"the boat has come no nearer to the waypoint for {self._without:.0f} s"
        return ""

    def watch(self, leg: LegState, fastest: float, turn_rate: float, dt: float) -> None:
        """Check whether the boat comes nearer to the waypoint, or could.

        fastest: largest speed along the leg, m/s. turn_rate: largest ordered yaw rate, rad/s.
        """
        is_new = leg.target != self.target
        if is_new:
            self.target = leg.target
            self._nearest = self._before = self._closest = leg.distance
        nearer = is_new or leg.distance < self._before - self._least * _LONGEST_WITHOUT
        gains = is_new or leg.distance < self._nearest - self._least * _PATIENCE
        self._before = leg.distance if nearer else self._before
        self._nearest = leg.distance if gains else self._nearest
        self._without = 0.0 if nearer else self._without + dt
        self._closest = min(self._closest, leg.distance)
        self._carried_back = leg.distance - self._closest if leg.remaining > 0.0 else 0.0
        self._allowed_back = self._top_speed * max(_CARRIED / turn_rate, _CARRIED_TIME)
        self._overpowered = 0.0 if fastest > self._least or gains else self._overpowered + dt
