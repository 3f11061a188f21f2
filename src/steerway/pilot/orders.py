"""The interfaces of a pilot's blocks, and the output of one step of a pilot."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Protocol

from steerway.core.estimate import Estimate
from steerway.core.leg import LegState
from steerway.core.reference import Reference
from steerway.guidance.waypoints import Phase


class Mode(IntEnum):
    """Mode of the pilot."""

    WAITING = 0  # no position yet: no command
    UNDER_WAY = 1  # on the route
    HOLDING = 2  # keeping station
    STOPPED = 3  # the route is finished, engines off
    BLIND = 4  # no position for too long, engines off
    OVERPOWERED = 5  # no headway: the current exceeds the boat's speed; engines off
    IDLE = 6  # another program or a person steers: no command


class Steered(NamedTuple):
    """Output of control in one step."""

    command: tuple[float, ...]  # one per actuator
    force: float  # demanded surge force, N
    yaw: float  # the autopilot's output
    reference: Reference  # the autopilot's reference


class Orders(NamedTuple):
    """Output of the pilot in one step: the commands, and the values that led to them."""

    command: tuple[float, ...]  # one per actuator
    estimate: Estimate
    leg: LegState
    desired: Reference  # from guidance: a course, or a heading if the law gives one
    reference: Reference  # the autopilot's reference
    speed: float  # desired speed, m/s
    force: float  # demanded surge force, N
    yaw: float  # the autopilot's output
    mode: Mode
    by_course: bool  # whether the autopilot controls course; else it controls heading


class LegSource(Protocol):
    """Source of the current leg: `guidance.waypoints.Mission`, `guidance.voyage.Voyage`, on board a `Guide`."""

    lead: float
    preview: float

    @property
    def phase(self) -> Phase: ...

    @property
    def given_course(self) -> float:
        """Course (rad) to steer in place of the guidance law's; NaN for none."""

    @property
    def following(self) -> float: ...

    def step(self, north: float, east: float, dt: float, effort: float = 0.0) -> LegState: ...


class SpeedLoop(Protocol):
    """Controller that turns a desired speed into a surge force (N): `control.speed_pi.SpeedPI`, `SteadyForce`."""

    def step(self, desired: float, speed: float, dt: float) -> float: ...

    def limited_to(self, achieved: float) -> None: ...

    def restart(self) -> None: ...

    def speed_of(self, force: float) -> float: ...


@dataclass
class SteadyForce:
    """A constant thrust (N) in place of speed control, as in the papers."""

    force: float = 0.0

    def step(self, desired: float, speed: float, dt: float) -> float:
        """The force while the desired speed is above 0."""
        return self.force if desired > 0.0 else 0.0

    def speed_of(self, force: float) -> float:
        """NaN: unknown."""
        return math.nan

    def limited_to(self, achieved: float) -> None:
        """Does nothing: there is no integral."""

    def restart(self) -> None:
        """Does nothing: there is no state."""
