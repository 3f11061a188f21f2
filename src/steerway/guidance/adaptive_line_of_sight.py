"""Adaptive line of sight (ALOS): a desired heading that keeps the path in a current by estimating the crab angle.

Fossen, "An adaptive line-of-sight (ALOS) guidance law for path following of aircraft and marine craft", IEEE
Transactions on Control Systems Technology 31(6), 2023.
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
    """Adaptive line of sight for heading. `lookahead` Δ in m, `gain` γ in rad/(m·s).

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
