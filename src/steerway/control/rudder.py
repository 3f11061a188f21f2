"""Actuation by one rudder; the speed is not controlled."""

from dataclasses import dataclass
from typing import NamedTuple

from steerway.core.checks import positive


class RudderCommand(NamedTuple):
    """The command (rad), and what it achieves of the demanded force and rudder angle."""

    rudder: float
    surge_force: float
    yaw: float


@dataclass(frozen=True)
class Rudder:
    """One rudder, ± `limit` rad, + turns to starboard. The autopilot's output is the rudder angle itself."""

    limit: float

    def __post_init__(self):
        positive("rudder.limit", self.limit)

    def step(self, surge_force: float, yaw: float) -> RudderCommand:
        """The command for a demanded rudder angle; the force is passed on as it is."""
        rudder = max(-self.limit, min(self.limit, yaw))
        return RudderCommand(rudder, surge_force, rudder)
