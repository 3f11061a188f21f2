"""Holding a position with thrust and steering alone, by a boat whose heading and current are estimated.

In a current that it can steer in, the boat lies with its bow into it and goes as fast through the water as the water
goes: a distance from the point changes speed and heading by little. In less it drifts, and sails back to the point
slowly when it has left a circle about it.
"""

import math
from typing import NamedTuple

from steerway.core.checks import positive
from steerway.core.estimate import Estimate
from steerway.core.kinematics import heading_for

_STEERS = 0.25
"""Share of the slowest speed through the water at which a boat can still be turned. Chosen: a rudder has a sixteenth of
its force there."""
_LEAST = 0.5
"""Share of the current's speed that is kept through the water by a boat that drops back. Chosen: a rudder keeps a
quarter of its force."""
_RETURNED = 0.4
"""Share of the radius within which a boat that came back drifts again. Chosen: below 1, so that drifting and
returning do not alternate."""
_FAR = 3.0
"""Radii beyond which it sails straight to the point. Chosen: stemming the current it would come back too slowly."""
_PULL = 0.1
"""1/s: speed towards the point for a distance from it. Chosen: it dies away in 10 s, slower than the boat's speed
changes."""


class Wanted(NamedTuple):
    """Heading (rad) and speed through the water (m/s); a speed of 0: no thrust."""

    heading: float
    water_speed: float


class PositionHold:
    """Keeps a boat about a point.

    radius (m) of the circle in which it may drift; slowest (m/s) speed through the water at which it steers well.
    """

    def __init__(self, radius: float, slowest: float):
        self.radius = positive("station.radius", radius)
        self.slowest = positive("in_current.slowest", slowest)
        self.restart()

    def restart(self) -> None:
        """Begin with another point, or after a pause."""
        self._returns = True

    def step(self, distance: float, bearing: float, estimate: Estimate) -> Wanted:
        """What to do about a point at a distance (m) and bearing (rad)."""
        north, east = estimate.current_north, estimate.current_east
        current = math.hypot(north, east)
        if current > _STEERS * self.slowest and distance < _FAR * self.radius:
            return self._stem(distance, bearing, math.atan2(-east, -north), current)
        self._returns = distance > (_RETURNED if self._returns else 1.0) * self.radius
        if not self._returns:
            return Wanted(estimate.heading, 0.0)
        # Far away by as much over ground as it steers with: a current that is taken for too strong would else hold it.
        speed = max(self.slowest, 1.2 * current) if distance < _FAR * self.radius else self.slowest + current
        return Wanted(float(heading_for(bearing, speed, north, east)[0]), speed)

    def _stem(self, distance: float, bearing: float, upstream: float, current: float) -> Wanted:
        towards = min(_PULL * distance, 0.5 * self.slowest)
        ahead = max(current + towards * math.cos(bearing - upstream), _LEAST * current)
        aside = max(-ahead, min(ahead, towards * math.sin(bearing - upstream)))
        return Wanted(upstream + math.atan2(aside, ahead), math.hypot(ahead, aside))
