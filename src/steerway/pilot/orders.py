"""What a pilot is made of, and what one step of it gives."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Protocol

from steerway.core.estimate import Estimate
from steerway.core.leg import LegState
from steerway.core.reference import Reference
from steerway.guidance.waypoints import Phase


class Mode(IntEnum):
    """What the pilot does."""

    WAITING = 0  # no position yet: no command
    UNDER_WAY = 1  # on the route
    HOLDING = 2  # keeping station
    STOPPED = 3  # the route is finished, engines off
    BLIND = 4  # no position for too long, engines off
    OVERPOWERED = 5  # no way is made: the current exceeds the boat's speed; engines off
    IDLE = 6  # someone else steers: no command


class Steered(NamedTuple):
    """What one step of control gave."""

    command: tuple[float, ...]  # one an actuator
    force: float  # demanded of the actuation, N
    yaw: float  # the autopilot's output
    reference: Reference  # what the autopilot followed


class Orders(NamedTuple):
    """What one step of the pilot gave and why."""

    command: tuple[float, ...]  # one an actuator
    estimate: Estimate
    leg: LegState
    desired: Reference  # of guidance: course, or heading where the law gives one
    reference: Reference  # what the autopilot followed
    speed: float  # desired, m/s
    force: float  # demanded of the actuation, N
    yaw: float  # the autopilot's output
    mode: Mode
    by_course: bool  # whether the course is steered by, else the heading


class LegSource(Protocol):
    """What gives the leg under way: `guidance.waypoints.Mission`, `guidance.voyage.Voyage`, aboard a `Guide`."""

    lead: float
    preview: float

    @property
    def phase(self) -> Phase: ...

    @property
    def given_course(self) -> float:
        """Course (rad) that is steered in place of that of a guidance law; NaN for none."""

    @property
    def following(self) -> float: ...

    def step(self, north: float, east: float, dt: float, effort: float = 0.0) -> LegState: ...


class SpeedLoop(Protocol):
    """What makes a surge force (N) of a desired speed: `control.speed_pi.SpeedPI`, `SteadyForce`."""

    def step(self, desired: float, speed: float, dt: float) -> float: ...

    def limited_to(self, achieved: float) -> None: ...

    def restart(self) -> None: ...

    def speed_of(self, force: float) -> float: ...


@dataclass
class SteadyForce:
    """The same thrust always (N), as the papers do instead of speed control."""

    force: float = 0.0

    def step(self, desired: float, speed: float, dt: float) -> float:
        """The force while the desired speed is above 0."""
        return self.force if desired > 0.0 else 0.0

    def speed_of(self, force: float) -> float:
        """Not known."""
        return math.nan

    def limited_to(self, achieved: float) -> None:
        """Does nothing: there is no integral."""

    def restart(self) -> None:
        """Does nothing: there is no state."""
