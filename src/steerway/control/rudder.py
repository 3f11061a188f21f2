"""A boat steered by one rudder, whose speed is none of the autopilot's business."""

from dataclasses import dataclass
from typing import NamedTuple

from steerway.core.checks import positive


class Steering(NamedTuple):
    """What the rudder is told, and what was given of the force and of the rudder angle asked for."""

    rudder: float
    surge_force: float
    yaw: float


@dataclass(frozen=True)
class Rudder:
    """One rudder, ± `limit` rad, + turns to starboard. The autopilot's output is the rudder angle itself."""

    limit: float

    def __post_init__(self):
        positive("rudder.limit", self.limit)

    def step(self, surge_force: float, yaw: float) -> Steering:
        """The command for a rudder angle asked for; the force is passed over."""
        rudder = max(-self.limit, min(self.limit, yaw))
        return Steering(rudder, surge_force, rudder)
