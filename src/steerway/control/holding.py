"""Position holding with surge thrust and steering only, by a boat with estimated heading and current.

In a current strong enough for steering, the boat points its bow into the current and matches its speed; small changes
of speed and heading bring the boat back to the point. In a weaker current the boat drifts. Once it has left a circle
around the point, it returns slowly.
"""

import math
from typing import NamedTuple

from steerway.core.checks import positive
from steerway.core.estimate import Estimate
from steerway.core.kinematics import heading_for

_STEERS = 0.25
"""Smallest speed through the water at which a boat can be turned, as a fraction of `slowest`. The rudder force is then
a sixteenth of the force at `slowest`."""
_LEAST = 0.5
"""Smallest speed through the water of a boat that drops back, as a fraction of the current's speed. The rudder force is
then a quarter of the force at the current's speed."""
_RETURNED = 0.4
"""Distance at which a returning boat begins to drift again, as a fraction of the radius. It is below 1, so that
drifting and returning do not alternate."""
_FAR = 3.0
"""Distance, in radii, beyond which the boat sails straight to the point. Stemming the current would be too slow."""
_PULL = 0.1
"""Speed towards the point per metre of distance, 1/s. The distance decays in 10 s, more slowly than the boat's speed
changes."""


class Wanted(NamedTuple):
    """Desired heading (rad) and speed through the water (m/s); a speed of 0 means no thrust."""

    heading: float
    water_speed: float


class PositionHold:
    """Holds a boat near a point.

    radius: radius of the circle in which the boat may drift, m; slowest: least speed through the water at which it
    steers well, m/s.
    """

    def __init__(self, radius: float, slowest: float):
        self.radius = positive("station.radius", radius)
        self.slowest = positive("in_current.slowest", slowest)
        self.restart()

    def restart(self) -> None:
        """Reset, for another point or after a pause."""
        self._returns = True

    def step(self, distance: float, bearing: float, estimate: Estimate) -> Wanted:
        """Desired heading and speed for a point at a distance (m) and bearing (rad)."""
        north, east = estimate.current_north, estimate.current_east
        current = math.hypot(north, east)
        if current > _STEERS * self.slowest and distance < _FAR * self.radius:
            return self._stem(distance, bearing, math.atan2(-east, -north), current)
        self._returns = distance > (_RETURNED if self._returns else 1.0) * self.radius
        if not self._returns:
            return Wanted(estimate.heading, 0.0)
        # Far away the speed over ground is at least `slowest`: an overestimated current would else keep the boat away.
        speed = max(self.slowest, 1.2 * current) if distance < _FAR * self.radius else self.slowest + current
        return Wanted(float(heading_for(bearing, speed, north, east)[0]), speed)

    def _stem(self, distance: float, bearing: float, upstream: float, current: float) -> Wanted:
        towards = min(_PULL * distance, 0.5 * self.slowest)
        ahead = max(current + towards * math.cos(bearing - upstream), _LEAST * current)
        aside = max(-ahead, min(ahead, towards * math.sin(bearing - upstream)))
        return Wanted(upstream + math.atan2(aside, ahead), math.hypot(ahead, aside))
