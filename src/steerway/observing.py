"""What a step of a pilot gives, and who watches it: an observer asked between the stages, in simulation a `Lookout`."""

import math
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, Protocol

from steerway.core.checks import positive
from steerway.core.estimate import Estimate, Measurements
from steerway.core.leg import LegState
from steerway.guidance.reference import Reference
from steerway.guidance.waypoints import Phase

if TYPE_CHECKING:
    from steerway.pilot import Pilot


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


class Observer(Protocol):
    """What is called between the stages of a step: `Lookout`, aboard `live.autopilot.supervisor.Supervisor`."""

    def judge(self, pilot: "Pilot", measurements: Measurements, estimate: Estimate, leg: LegState, dt: float) -> Mode:
        """What the pilot does in this step, with the leg known."""

    def ask(
        self, pilot: "Pilot", desired: Reference, speed: float, estimate: Estimate
    ) -> tuple[Reference, float, Estimate]:
        """Before control: the course or heading, the speed (m/s) and the estimate that it goes by."""

    def allows(self, pilot: "Pilot", steered: Steered, estimate: Estimate) -> bool:
        """After control: whether the commands may be carried out."""


class Lookout:
    """The observer of a simulation: no engines without a position for too long, nor where no way is made."""

    def __init__(self, max_dead_reckoning: float):
        self.max_dead_reckoning = positive("pilot.max_dead_reckoning", max_dead_reckoning)
        self._blind = 0.0

    def judge(self, pilot: "Pilot", measurements: Measurements, estimate: Estimate, leg: LegState, dt: float) -> Mode:
        """The mode, by what is known and by the phase of the mission."""
        pilot.measured_shaft(measurements.shaft)
        self._blind = 0.0 if not math.isnan(measurements.north) else self._blind + dt
        phase = pilot.mission.phase
        if math.isnan(estimate.north):
            return Mode.WAITING
        if self._blind > self.max_dead_reckoning:
            return Mode.BLIND
        if phase is Phase.STOPPED or (phase is Phase.HOLDING and pilot.station is None):
            return Mode.STOPPED
        if pilot.mode is Mode.OVERPOWERED or (pilot.in_current is not None and pilot.in_current.trouble):
            return Mode.OVERPOWERED
        return Mode.HOLDING if phase is Phase.HOLDING else Mode.UNDER_WAY

    def ask(
        self, pilot: "Pilot", desired: Reference, speed: float, estimate: Estimate
    ) -> tuple[Reference, float, Estimate]:
        """What guidance wants."""
        return desired, speed, estimate

    def allows(self, pilot: "Pilot", steered: Steered, estimate: Estimate) -> bool:
        """Always."""
        return True
