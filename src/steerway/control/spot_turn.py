"""Turning on the spot: a boat that can sails up to the waypoint of a sharp corner, stops, turns, and goes on.

It drifts meanwhile: where the current carries it too far, the corner is turned under way.
"""

import math

from steerway.control.in_current import SURE
from steerway.core.angles import wrap
from steerway.core.checks import positive
from steerway.core.estimate import Estimate
from steerway.core.leg import LegState

_SLOWEST = 0.3
"""Share of the route's speed at which the waypoint is approached at the last. Chosen: slower it is late by seconds."""
_ROUND = math.radians(10.0)
"""rad from the heading of the next leg within which the boat goes on. Chosen: the rest is turned within its length."""


class SpotTurn:
    """angle: rad between two legs from which on the boat turns on the spot; braking: m/s² at which it stops; drift: m
    that the current may carry it meanwhile.
    """

    def __init__(self, angle: float, braking: float, drift: float):
        self.angle, self.braking = positive("spot_turn.angle", angle), positive("spot_turn.braking", braking)
        self.drift = positive("spot_turn.drift", drift)
        self.restart()

    def restart(self) -> None:
        """The boat begins to steer."""
        self.turns = False  # on the spot, now
        self._next = -1  # waypoint of the leg that begins with a turn

    def lead(self, leg: LegState, following: float, estimate: Estimate, rate: float) -> float:
        """Distance (m) before the waypoint at which the leg ends; NaN where the corner is not turned on the spot.

        following: direction of the next leg, NaN for none; rate: at which the boat turns, rad/s.
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
        """The speed (m/s) towards such a corner for that of the route."""
        if self._next != leg.target + 1:
            return speed
        return min(speed, max(_SLOWEST * speed, math.sqrt(2.0 * self.braking * max(leg.remaining, 0.0))))

    def stays(self, wanted: float, estimate: Estimate) -> bool:
        """Whether the boat turns on the spot still, for the heading of the leg (rad).

        At rest positions do not show the heading: it ends where that is no longer sure.
        """
        self.turns = self.turns and abs(wrap(wanted - estimate.heading)) > _ROUND and estimate.heading_std < SURE
        return self.turns
