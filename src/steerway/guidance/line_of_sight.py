"""Line-of-sight guidance for course: steer towards a point on the path a look-ahead distance ahead; P1 (35)–(39).

Course control needs no estimate of current or crab angle: a boat on the desired course converges to the path. Heading
control leaves a cross-track error of Δ tan β, which `IntegralLineOfSight` and `AdaptiveLineOfSight` remove.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from steerway.core.angles import wrap
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.leg import LegState
from steerway.core.reference import Reference


class GuidanceLaw(Protocol):
    """A guidance law: desired course or heading for a position relative to a leg."""

    def step(self, leg: LegState, course: float, speed: float, dt: float) -> Reference:
        """The desired angle and its rate, for a course and speed over ground; the rate is 0 if either is NaN."""


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


@kernel
def integral_line_of_sight(
    direction: float,
    cross_track: float,
    cross_track_rate: float,
    integral: float,
    lookahead: float,
    integral_gain: float,
    dt: float,
) -> tuple[float, float, float]:
    """(heading, its rate, next integral): ψ = π_p − atan((y_e + κ y_int)/Δ), ẏ_int = Δ y_e/(Δ² + (y_e + κ y_int)²).

    The integral grows more slowly far from the path, so that a long approach does not wind it up.
    """
    aim = cross_track + integral_gain * integral
    spread = lookahead * lookahead + aim * aim
    integral_rate = lookahead * cross_track / spread
    rate = -lookahead * (cross_track_rate + integral_gain * integral_rate) / spread
    return wrap(direction - math.atan(aim / lookahead)), rate, integral + dt * integral_rate


@dataclass
class IntegralLineOfSight:
    """Integral line of sight (ILOS) for heading, which keeps the path in a current by integral action.

    Børhaug, Pavlov and Pettersen, CDC 2008, in the form of Fossen, Handbook of Marine Craft Hydrodynamics and Motion
    Control, 2nd edition, section 12.5. `lookahead` Δ in m, `integral_gain` κ in m/s (0: proportional).

    `integral` is y_int in s: κ y_int/Δ converges to the tangent of the crab angle. It is kept from leg to leg.
    """

    lookahead: float
    integral_gain: float
    integral: float = 0.0

    def __post_init__(self) -> None:
        positive("integral_line_of_sight.lookahead", self.lookahead)
        not_negative("integral_line_of_sight.integral_gain", self.integral_gain)

    def step(self, leg: LegState, course: float, speed: float, dt: float) -> Reference:
        """Desired heading and its rate; an unknown position leaves the integral unchanged. See GuidanceLaw."""
        heading, rate, integral = integral_line_of_sight(
            leg.direction,
            leg.cross_track,
            cross_track_rate(leg.direction, course, speed),
            self.integral,
            self.lookahead,
            self.integral_gain,
            dt,
        )
        if math.isfinite(integral):
            self.integral = integral
        return Reference(heading, rate, 0.0)


@kernel
def adaptive_line_of_sight(
    direction: float,
    cross_track: float,
    cross_track_rate: float,
    crab_angle: float,
    lookahead: float,
    gain: float,
    dt: float,
) -> tuple[float, float, float]:
    """(heading, its rate, next crab angle): ψ = π_p − β̂ − atan(y_e/Δ), β̂' = γ Δ y_e/√(Δ² + y_e²)."""
    spread = lookahead * lookahead + cross_track * cross_track
    crab_rate = gain * lookahead * cross_track / math.sqrt(spread)
    heading = wrap(direction - crab_angle - math.atan(cross_track / lookahead))
    return heading, -crab_rate - lookahead * cross_track_rate / spread, crab_angle + dt * crab_rate


@dataclass
class AdaptiveLineOfSight:
    """Adaptive line of sight (ALOS) for heading, which keeps the path in a current by estimating the crab angle.

    Fossen, "An adaptive line-of-sight (ALOS) guidance law for path following of aircraft and marine craft", IEEE
    Transactions on Control Systems Technology 31(6), 2023. `lookahead` Δ in m, `gain` γ in rad/(m·s).

    `crab_angle` β̂ is the estimate, kept from leg to leg. A long approach could wind it up until the heading leads back
    along the path; its limit ± `largest_crab` prevents this.
    """

    lookahead: float
    gain: float
    crab_angle: float = 0.0
    largest_crab: float = math.radians(60.0)

    def __post_init__(self) -> None:
        positive("adaptive_line_of_sight.lookahead", self.lookahead)
        not_negative("adaptive_line_of_sight.gain", self.gain)
        positive("adaptive_line_of_sight.largest_crab", self.largest_crab)

    def step(self, leg: LegState, course: float, speed: float, dt: float) -> Reference:
        """Desired heading and its rate; an unknown position leaves `crab_angle` unchanged. See GuidanceLaw."""
        heading, rate, crab_angle = adaptive_line_of_sight(
            leg.direction,
            leg.cross_track,
            cross_track_rate(leg.direction, course, speed),
            self.crab_angle,
            self.lookahead,
            self.gain,
            dt,
        )
        if math.isfinite(crab_angle):
            self.crab_angle = max(-self.largest_crab, min(self.largest_crab, crab_angle))
        return Reference(heading, rate, 0.0)


@kernel
def vector_field(
    direction: float, cross_track: float, cross_track_rate: float, steepness: float, approach: float
) -> tuple[float, float]:
    """Desired course and its rate (rad, rad/s): χ = π_p − χ∞ (2/π) atan(k y_e)."""
    slope = steepness * cross_track
    share = approach * 2.0 / math.pi
    return wrap(direction - share * math.atan(slope)), -share * steepness * cross_track_rate / (1.0 + slope * slope)


@dataclass(frozen=True)
class VectorField:
    """Vector field for course, P1's alternative to line of sight: far away, the boat approaches at a chosen angle.

    The field is that of a straight line in Nelson, Barber, McLain and Beard, "Vector field path following for miniature
    air vehicles", IEEE Transactions on Robotics 23(3), 2007. The autopilot replaces the paper's sliding-mode course
    loop. `steepness` k in 1/m, `approach` χ∞ in (0, π/2]: the angle to the path from far away.

    With χ∞ = π/2 it is proportional line of sight with the look-ahead distance 1/k.
    """

    steepness: float
    approach: float = math.pi / 2.0

    def __post_init__(self) -> None:
        positive("vector_field.steepness", self.steepness)
        if not 0.0 < self.approach <= math.pi / 2.0:
            raise InputError(f"vector_field.approach is {self.approach:g}, expected an angle in (0, π/2] rad")

    def step(self, leg: LegState, course: float, speed: float, dt: float) -> Reference:
        """Desired course and its rate; see GuidanceLaw."""
        rate = cross_track_rate(leg.direction, course, speed)
        return Reference(*vector_field(leg.direction, leg.cross_track, rate, self.steepness, self.approach), 0.0)
