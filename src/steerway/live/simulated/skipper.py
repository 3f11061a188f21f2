"""Manual control while no other is on: in a circle, since a boat at rest has no course."""

import math

from steerway.core.angles import wrap
from steerway.core.kinematics import GroundMotion
from steerway.live.simulated.rover import Target

SPEED = 1.0
"""m/s"""
RADIUS = 15.0
"""m, around the position at the start."""
_GAIN, _MOST = 0.3, 0.3  # 1/s from course error to yaw rate, and rad/s


class Skipper:
    """Keeps the boat near its start, whatever the current."""

    def __init__(self, motion: GroundMotion):
        self._north, self._east = motion.north, motion.east

    def step(self, motion: GroundMotion) -> Target:
        """Target yaw rate and speed: clockwise along the circle, back to it from inside and outside."""
        north, east = motion.north - self._north, motion.east - self._east
        outside = math.hypot(north, east) / RADIUS - 1.0
        course = math.atan2(east, north) + 0.5 * math.pi + math.atan(outside)
        yaw_rate = SPEED / RADIUS + _GAIN * wrap(course - motion.cog)
        return Target(max(-_MOST, min(_MOST, yaw_rate)), SPEED, math.nan)
