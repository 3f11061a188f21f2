"""Line-of-sight guidance for course: steer towards a point on the path a look-ahead distance ahead; P1 (35)–(39).

Course control needs no estimate of current or crab angle: a boat on the desired course converges to the path. Heading
control leaves a cross-track error of Δ tan β; see `integral_line_of_sight` and `adaptive_line_of_sight`.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from steerway.core.angles import wrap
from steerway.core.checks import positive
from steerway.core.compiled import kernel
from steerway.core.leg import LegState
from steerway.core.reference import Reference


class GuidanceLaw(Protocol):
    """A guidance law: desired course or heading for a position relative to a leg."""

    def step(self, leg: LegState, course: float, speed: float, dt: float) -> Reference:
        """The desired angle and its rate, for a course (rad) and speed over ground; the rate is 0 if one is NaN."""


@kernel
def cross_track_rate(direction: float, course: float, speed: float) -> float:
    """ẏ_e = U sin(χ − π_p), P1 (37) corrected; 0 while course or speed is unknown."""
    if math.isnan(course) or math.isnan(speed):
        return 0.0
    return speed * math.sin(course - direction)


@kernel
def line_of_sight(
    direction: float, cross_track: float, cross_track_rate: float, lookahead: float
) -> tuple[float, float]:
    """Desired course and its rate (rad, rad/s) of proportional line of sight; P1 (35) and (39)."""
    slope = cross_track / lookahead
    return wrap(direction - math.atan(slope)), -cross_track_rate / lookahead / (1.0 + slope * slope)


@dataclass(frozen=True)
class LineOfSight:
    """Proportional line of sight, P1 (35) with the feedforward rate (39). `lookahead` Δ in m.

    A good first choice is three to ten boat lengths, longer for a faster boat. The cross-track error decays at the rate
    U/Δ; the autopilot must be faster.
    """

    lookahead: float

    def __post_init__(self) -> None:
        positive("line_of_sight.lookahead", self.lookahead)

    def step(self, leg: LegState, course: float, speed: float, dt: float) -> Reference:
        """Desired course and its rate; see GuidanceLaw."""
        rate = cross_track_rate(leg.direction, course, speed)
        return Reference(*line_of_sight(leg.direction, leg.cross_track, rate, self.lookahead), 0.0)


@dataclass(frozen=True)
class PurePursuit:
    """Pure pursuit: steer straight at the waypoint, P4 (21), for waypoint missions without a path."""

    def step(self, leg: LegState, course: float, speed: float, dt: float) -> Reference:
        """The bearing of the waypoint and its rate; see GuidanceLaw."""
        return Reference(wrap(leg.bearing), bearing_rate(leg.bearing, leg.distance, course, speed), 0.0)


@kernel
def bearing_rate(bearing: float, distance: float, course: float, speed: float) -> float:
    """Rate of a fixed point's bearing, rad/s; 0 at the point, and while course or speed is unknown."""
    if math.isnan(course) or math.isnan(speed) or not distance > 0.0:
        return 0.0
    return -speed * math.sin(course - bearing) / distance
