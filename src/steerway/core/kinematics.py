"""The current triangle: relations between heading, course, crab angle and sideslip; P1 (1)–(10) and (28).

Angles in rad, course and heading from true north, sideslip and crab positive to starboard.
"""

import math
from typing import NamedTuple

from steerway.core.angles import wrap
from steerway.core.compiled import kernel


class GroundMotion(NamedTuple):
    """A vessel's true motion over ground: the input of sensors, and the reference of estimates."""

    north: float
    east: float
    heading: float
    north_velocity: float
    east_velocity: float
    yaw_rate: float
    course_rate: float  # rad/s, + starboard; NaN at rest
    surge: float  # through the water, along the hull
    sway: float  # through the water, to starboard
    roll: float
    pitch: float
    shaft: float = math.nan  # of the propeller, rev/s; NaN for a vessel whose model has none

    @property
    def along(self) -> float:
        """Speed over ground along the hull, m/s."""
        return self.north_velocity * math.cos(self.heading) + self.east_velocity * math.sin(self.heading)

    @property
    def sog(self) -> float:
        """Speed over ground, P1 (6)."""
        return math.hypot(self.north_velocity, self.east_velocity)

    @property
    def cog(self) -> float:
        """Course over ground in [−π, π), P1 (3)–(4)."""
        return wrap(math.atan2(self.east_velocity, self.north_velocity))

    @property
    def crab_angle(self) -> float:
        """Angle from the bow to the velocity over ground, P1 (5)."""
        return wrap(self.cog - self.heading)

    @property
    def sideslip(self) -> float:
        """Angle from the bow to the velocity through the water, P1 (10)."""
        return drift_angle(self.surge, self.sway)

    @property
    def water_speed(self) -> float:
        """Speed through the water, P1 (9)."""
        return math.hypot(self.surge, self.sway)


class WaveMotion(NamedTuple):
    """Wave motion, added to a vessel's mean motion: displacement north and east (m), roll and pitch (rad)."""

    north: float = 0.0
    east: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0


SHORTLY = 1e-4
"""Half the step of the central difference for the acceleration over ground, s."""


@kernel
def over_ground(surge: float, sway: float, heading: float) -> tuple[float, float]:
    """North and east velocity from surge and sway; P1 (1)–(2)."""
    c, s = math.cos(heading), math.sin(heading)
    return surge * c - sway * s, surge * s + sway * c


@kernel
def in_body(north_velocity: float, east_velocity: float, heading: float) -> tuple[float, float]:
    """Surge and sway of a velocity given as north and east, such as the current's: the inverse of P1 (1)–(2)."""
    c, s = math.cos(heading), math.sin(heading)
    return north_velocity * c + east_velocity * s, east_velocity * c - north_velocity * s


@kernel
def drift_angle(surge: float, sway: float) -> float:
    """Crab angle from a velocity over ground, P1 (7), or sideslip from one through the water, (10), in [−π, π).

    By atan2: the printed atan and asin are right only for motion ahead.
    """
    return wrap(math.atan2(sway, surge))


@kernel
def turning_rate(
    north_velocity: float, east_velocity: float, north_acceleration: float, east_acceleration: float
) -> float:
    """Course rate (rad/s) of a point over ground, P1 (28) without computing the crab angle; NaN at rest."""
    squared = north_velocity * north_velocity + east_velocity * east_velocity
    if squared == 0.0:
        return math.nan
    return (north_velocity * east_acceleration - east_velocity * north_acceleration) / squared


_STEEPEST = 0.98
"""Sine of the largest crab angle: about 79°."""


@kernel
def heading_for(course: float, water_speed: float, current_north: float, current_east: float) -> tuple[float, float]:
    """(heading ψ, speed over ground along the course) that yield a course in a current; rad, m/s.

    If the current across the course is too strong for this, the crab angle is the largest one (`_STEEPEST`), and the
    boat drifts off the course. The speed is negative if the boat is set back.
    """
    c, s = math.cos(course), math.sin(course)
    along, across = current_north * c + current_east * s, current_east * c - current_north * s
    if not water_speed > 0.0:
        return course, along
    sine = min(_STEEPEST, max(-_STEEPEST, -across / water_speed))
    return wrap(course + math.asin(sine)), along + water_speed * math.sqrt(1.0 - sine * sine)


@kernel
def water_speed_for(
    course: float, speed: float, current_north: float, current_east: float, least: float, most: float
) -> float:
    """Speed through the water (m/s), within limits, that yields a speed over ground along a course in a current."""
    north, east = speed * math.cos(course) - current_north, speed * math.sin(course) - current_east
    return min(most, max(least, math.hypot(north, east)))


@kernel
def course_per_heading(water_speed: float, sog: float, crab_angle: float) -> float:
    """dχ/dψ = (U_r/U) cos(χ − ψ); crab_angle χ − ψ in rad. If the current has half the speed U_r, it is 2/3 to 2."""
    return water_speed / sog * math.cos(crab_angle)
