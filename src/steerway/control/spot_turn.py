"""Turning on the spot: the boat stops at the waypoint of a sharp corner, turns, and goes on.

The boat drifts during the turn. If the current would carry it too far, the boat turns the corner under way.
"""

import math

from steerway.control.in_current import SURE
from steerway.core.angles import wrap
from steerway.core.checks import positive
from steerway.core.estimate import Estimate
from steerway.core.leg import LegState

_SLOWEST = 0.3
"""Final speed of the approach to the waypoint, as a fraction of the route's speed. Slower costs seconds."""
_ROUND = math.radians(10.0)
"""Heading error (rad) to the next leg below which the boat goes on. It turns the rest within its own length."""


class SpotTurn:
    """angle: smallest angle between two legs at which the boat turns on the spot, rad; braking: deceleration, m/s²;
    drift: largest drift with the current during the stop and turn, m."""

    def __init__(self, angle: float, braking: float, drift: float):
        self.angle, self.braking = positive("spot_turn.angle", angle), positive("spot_turn.braking", braking)
        self.drift = positive("spot_turn.drift", drift)
        self.restart()

    def restart(self) -> None:
        """Reset, when the boat begins to steer."""
        self.turns = False  # whether the boat is turning on the spot now
        self._next = -1  # waypoint of the leg that begins with a turn

    def lead(self, leg: LegState, following: float, estimate: Estimate, rate: float) -> float:
        """Distance (m) before the waypoint at which the leg ends; NaN for a corner that is not turned on the spot.

        following: direction of the next leg (rad), NaN for none; rate: yaw rate of the turn, rad/s.
        """
        if leg.target == self._next:
            self.turns, self._next = True, -1
        turn = abs(wrap(following - leg.direction))
        if math.isnan(turn):
            return math.nan
        current = math.hypot(estimate.current_north, estimate.current_east)
        if turn < self.angle or current * (turn / rate + leg.speed / self.braking) > self.drift:
            self._next = -1
            return math.nan
        self._next = leg.target + 1
        return 0.5 * (_SLOWEST * leg.speed) ** 2 / self.braking

    def speed(self, leg: LegState, speed: float) -> float:
        """Desired speed (m/s): that of the route, reduced before a corner that is turned on the spot."""
        if self._next != leg.target + 1:
            return speed
        return min(speed, max(_SLOWEST * speed, math.sqrt(2.0 * self.braking * max(leg.remaining, 0.0))))

    def stays(self, wanted: float, estimate: Estimate) -> bool:
        """Whether the boat is still turning on the spot, towards the heading `wanted` (rad).

        Positions do not observe the heading at rest: the turn also ends when the heading's σ reaches `SURE`.
        """
        self.turns = self.turns and abs(wrap(wanted - estimate.heading)) > _ROUND and estimate.heading_std < SURE
        return self.turns
