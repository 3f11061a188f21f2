"""One step of the loop: estimate, guide, control, supervise. Simulation, replay and live all drive this one object.

A pilot takes what instruments say and the time since the step before, and gives what the actuators are to do. It knows
no vessel model, no clock and no I/O; everything it does is done by a block that it was given.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Protocol

from steerway.control.handover import Helm
from steerway.control.station import StationKeeper
from steerway.core.checks import one_of, positive
from steerway.core.estimate import Estimate, Estimator, Measurements
from steerway.core.leg import LegState
from steerway.guidance.line_of_sight import GuidanceLaw
from steerway.guidance.reference import Reference
from steerway.guidance.waypoints import Phase

__all__ = ["Mission", "Mode", "Orders", "Pilot", "Propulsion", "SpeedLoop", "SteadyForce"]


class Mode(IntEnum):
    """What the pilot is doing."""

    WAITING = 0  # no position yet: nothing is done
    UNDER_WAY = 1  # sailing the route
    HOLDING = 2  # keeping station
    STOPPED = 3  # the route is done, engines off
    BLIND = 4  # no position for too long: engines off


STEERED = (Mode.UNDER_WAY, Mode.HOLDING)


class Mission(Protocol):
    """What says which leg is under way: `guidance.waypoints.Mission`, `guidance.voyage.Voyage`."""

    phase: Phase

    def step(self, north: float, east: float, dt: float, effort: float = 0.0) -> LegState: ...


class SpeedLoop(Protocol):
    """What makes a surge force (N) of a desired speed: `control.speed_pi.SpeedPI`, `SteadyForce`."""

    def step(self, desired: float, speed: float, dt: float) -> float: ...

    def limited_to(self, achieved: float) -> None: ...

    def restart(self) -> None: ...


class Propulsion(Protocol):
    """What makes commands of a surge force and of the autopilot's output (a yaw moment or a rudder angle)."""

    def step(self, surge_force: float, yaw: float) -> tuple[float, ...]:
        """The commands, one an actuator, then what they give of the force, then what they give of the yaw."""


@dataclass
class SteadyForce:
    """The same thrust always (N): what the papers do instead of holding a speed."""

    force: float = 0.0

    def step(self, desired: float, speed: float, dt: float) -> float:
        """The force, while any speed is wanted."""
        return self.force if desired > 0.0 else 0.0

    def limited_to(self, achieved: float) -> None:
        """Nothing is learned, nothing winds up."""

    def restart(self) -> None:
        """Nothing to forget."""


class Orders(NamedTuple):
    """What one step of the pilot gave and why."""

    command: tuple[float, ...]  # one an actuator
    estimate: Estimate
    leg: LegState
    desired: Reference  # what guidance asks for: course, or heading where the law gives one
    reference: Reference  # what the autopilot was to follow
    speed: float  # asked for, m/s
    force: float  # asked of the propulsion, N
    yaw: float  # the autopilot's output
    mode: Mode
    by_course: bool  # whether course steers, else heading


UNKNOWN = Reference(math.nan, 0.0, 0.0)


class Pilot:
    """Steers a boat along a mission by what it is told.

    estimator:  measurements → estimate.
    mission:    position → leg under way; may be exchanged at any time.
    law:        leg → course to steer, or heading.
    helm:       course or heading → yaw moment or rudder angle.
    propulsion: force and yaw → commands.
    speed:      speed → surge force; without it no force is asked for.
    station:    keeps a point where the mission says so; without it the pilot stops there. Needs a compass.
    cruise:     speed where the mission asks for none, m/s.
    steer_by:   "course", or "heading" for a law that gives a heading.
    patience:   s without a position after which the engines stop.
    """

    def __init__(
        self,
        estimator: Estimator,
        mission: Mission,
        law: GuidanceLaw,
        helm: Helm,
        propulsion: Propulsion,
        speed: SpeedLoop | None = None,
        station: StationKeeper | None = None,
        *,
        cruise: float = math.nan,
        steer_by: str = "course",
        patience: float = 10.0,
    ):
        self.estimator, self.mission, self.law, self.helm = estimator, mission, law, helm
        self.propulsion, self.speed, self.station = propulsion, speed, station
        self.cruise = cruise
        self.patience = positive("pilot.patience", patience)
        self._law_of_course = one_of("pilot.steer_by", steer_by, ("course", "heading")) == "course"
        self._blind = 0.0
        self._was = Mode.WAITING

    @property
    def finished(self) -> bool:
        """Whether the route is done and the engines are off."""
        return self._was is Mode.STOPPED

    def step(self, measurements: Measurements, dt: float) -> Orders:
        """What to do now, dt s after the step before."""
        estimate = self.estimator.step(measurements, dt)
        leg = self.mission.step(estimate.north, estimate.east, dt)
        mode = self._supervise(measurements, estimate, dt)
        if mode is Mode.UNDER_WAY:
            desired, asked, force, yaw = self._sail(leg, estimate, dt)
        elif mode is Mode.HOLDING:
            desired, asked, force, yaw = self._hold(leg, estimate, dt)
        else:
            self.helm.release()
            desired, asked, force, yaw = UNKNOWN, 0.0, 0.0, 0.0
        *command, given_force, given_yaw = self.propulsion.step(force, yaw)
        if mode in STEERED:
            self._learn_limits(given_force, given_yaw)
        reference = self.helm.shaper.reference or UNKNOWN
        by_course = self.helm.by_course
        return Orders(tuple(command), estimate, leg, desired, reference, asked, force, yaw, mode, by_course)

    def _supervise(self, measurements, estimate, dt):
        """What the pilot may do, by what it knows and by where the mission is."""
        self._blind = 0.0 if not math.isnan(measurements.north) else self._blind + dt
        if math.isnan(estimate.north):
            mode = Mode.WAITING
        elif self._blind > self.patience:
            mode = Mode.BLIND
        elif self.mission.phase is Phase.STOPPED or (self.mission.phase is Phase.HOLDING and self.station is None):
            mode = Mode.STOPPED
        else:
            mode = Mode.HOLDING if self.mission.phase is Phase.HOLDING else Mode.UNDER_WAY
        if mode is not self._was:
            self._change(mode)
        return mode

    def _change(self, mode):
        """What was learned for one thing is no use for another."""
        if mode is Mode.HOLDING:
            self.station.restart()
        if self.speed is not None and mode is not Mode.UNDER_WAY:
            self.speed.restart()
        self._was = mode

    def _sail(self, leg, estimate, dt):
        _, _, sog, cog, course_rate, *_, heading, yaw_rate = estimate
        desired = self.law.step(leg, cog, sog, dt)
        asked = self.cruise if math.isnan(leg.speed) else leg.speed
        force = 0.0 if self.speed is None else self.speed.step(asked, sog, dt)
        yaw = self.helm.step(desired, cog, course_rate, heading, yaw_rate, sog, dt, self._law_of_course)
        return desired, asked, force, yaw

    def _hold(self, leg, estimate, dt):
        _, _, sog, cog, course_rate, *_, heading, yaw_rate = estimate
        wanted, force = self.station.step(leg.distance, leg.bearing, cog, sog, heading, dt)
        desired = Reference(*wanted)
        yaw = self.helm.step(desired, cog, course_rate, heading, yaw_rate, sog, dt, course_wanted=False)
        return desired, 0.0, force, yaw

    def _learn_limits(self, force, yaw):
        """Integrals learn what limits made of the orders."""
        self.helm.limited_to(yaw)
        if self.speed is not None:
            self.speed.limited_to(force)
