"""Vector-field guidance, P1's alternative to line of sight: far away, the boat approaches the path at a chosen angle.

The field is that of a straight line in Nelson, Barber, McLain and Beard, "Vector field path following for miniature air
vehicles", IEEE Transactions on Robotics 23(3), 2007. The autopilot replaces the paper's sliding-mode course loop.
"""

import math
from dataclasses import dataclass

from steerway.core.angles import wrap
from steerway.core.checks import positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.leg import LegState
from steerway.core.reference import Reference
from steerway.guidance.line_of_sight import cross_track_rate


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
    """Vector field for course. `steepness` k in 1/m, `approach` χ∞ in (0, π/2]: the angle to the path from far away.

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
