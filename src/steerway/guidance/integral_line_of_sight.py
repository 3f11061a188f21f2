"""Integral line of sight (ILOS): a desired heading that keeps the path in a current by integral action.

Børhaug, Pavlov and Pettersen, CDC 2008, in the form of Fossen, Handbook of Marine Craft Hydrodynamics and Motion
Control, 2nd edition, section 12.5.
"""

import math
from dataclasses import dataclass

from steerway.core.angles import wrap
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.leg import LegState
from steerway.core.reference import Reference
from steerway.guidance.line_of_sight import cross_track_rate


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
    """Integral line of sight for heading. `lookahead` Δ in m, `integral_gain` κ in m/s (0: proportional).

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
