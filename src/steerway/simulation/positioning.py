"""Dynamic positioning in a scenario: the pilot that holds ordered positions and headings, its estimators and keys."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import Field

from steerway.control.allocation import Thrusters
from steerway.control.positioning import PositionPID, by_bandwidth
from steerway.core.estimate import NOTHING_KNOWN, Estimate, Estimator, Measurements
from steerway.core.kinematics import in_body, over_ground
from steerway.core.reference import Reference
from steerway.core.settings import Flag, NotNegative, Positive, Table
from steerway.estimation.positioning.changing_noise import TimeVaryingNoise
from steerway.estimation.positioning.passive import ObserverGains, PassiveObserver
from steerway.estimation.positioning.vessel_filter import Observer, VesselFilter, VesselNoise
from steerway.guidance.ordered import Ordered
from steerway.pilot import Mode, Orders
from steerway.vessels.vessel import Positioned

KINDS = ("vessel-filter", "tekf", "passive-observer")
"""Estimators by a vessel's M, D and forces: Kalman filter, P2's time-varying filter (TEKF), passive observer."""


class PositioningEstimatorTable(Table):
    """Noise assumed by the estimators "vessel-filter" and "tekf" (position, heading and process noise)."""

    position_std: Annotated[Positive, "m"] = 0.1
    """1σ of a fix."""
    heading_std_deg: Positive = 0.5
    """1σ of a compass reading."""
    force_std: Annotated[tuple[NotNegative, NotNegative, NotNegative], "N, N, N·m"] = (0.0, 0.0, 0.0)
    """1σ of the estimated environmental force, north and east, and moment; 0: not estimated."""
    force_time: Annotated[Positive, "s"] = 50.0
    """Time constant of the environmental force."""
    wave_std: Annotated[NotNegative, "m"] = 0.0
    """1σ of the wave motion in a fix; 0: not estimated."""
    wave_frequency: Annotated[Positive, "rad/s"] = 0.8
    """Frequency of the wave motion."""
    process_noise: Annotated[float, Field(strict=True, gt=0.0, le=1e6), "1"] = 1.0
    """Factor on the process noise Q of P2 (19), for "tekf"."""

    def observer(self, kind: str, vessel: Positioned, fix_interval: float) -> Observer:
        """The observer of kind `kind` for fixes `fix_interval` s apart."""
        inertia, damping, _ = vessel
        if kind == "passive-observer":
            return PassiveObserver(inertia, damping, ObserverGains.of_inertia(inertia), fix_interval=fix_interval)
        noise = VesselNoise(
            force_std=self.force_std,
            force_time=self.force_time,
            wave_std=self.wave_std,
            wave_frequency=self.wave_frequency,
            position_std=self.position_std,
            heading_std=math.radians(self.heading_std_deg),
        )
        if kind == "vessel-filter":
            return VesselFilter(inertia, damping, noise)
        # P2 estimates no force and has no gate.
        noise = replace(noise, force_std=(0.0, 0.0, 0.0), wave_std=0.0)
        varying = TimeVaryingNoise(scale=self.process_noise, yaw=self.process_noise)
        return VesselFilter(inertia, damping, noise, math.inf, None, varying)


class PositioningTable(Table):
    """The PID of P2 (30)–(33): K_p = ω² M, K_d = 2ζω M, K_i = `integral` ω K_p."""

    bandwidth: Annotated[Positive | None, "rad/s"] = None
    """Bandwidth ω of the position loop; by default 2/T with the time constant T in surge."""
    damping: Annotated[Positive, "1"] = 1.0
    """Damping ratio ζ of the position loop."""
    integral: Annotated[NotNegative, "1"] = 0.1
    """Integral gain, relative to ω K_p."""
    anti_windup: Flag = True
    """Whether the integral stops at the limits of the thrusters; in the paper it does not."""

    def controller(self, vessel: Positioned) -> PositionPID:
        """The controller for a vessel; its limits are the largest forces of the thrusters in each direction alone."""
        inertia, damping, thrusters = vessel
        limits = [float(thrusters.allocate(1e12 * direction)[1][k]) for k, direction in enumerate(np.eye(3))]
        bandwidth = self.bandwidth or 2.0 * damping[0][0] / inertia[0][0]
        gains = by_bandwidth(inertia, bandwidth, self.damping, self.integral, limits)
        return PositionPID(gains, self.anti_windup)


class PositioningEstimator:
    """An observer of a vessel's motion as an `Estimator`; it starts at a known position and heading."""

    def __init__(self, observer: Observer, north: float, east: float, heading: float):
        self.observer = observer
        observer.start(north, east, heading)
        self._force: Sequence[float] | None = None

    def order(self, force: Sequence[float]) -> None:
        """Set the generalized force (surge N, sway N, yaw N·m) of the thrusters until the next step."""
        self._force = force

    def step(self, measurements: Measurements, dt: float) -> Estimate:
        """The estimated motion. Measurements of the first step, before any force, are not used."""
        if self._force is not None:
            self.observer.predict(np.asarray(self._force), dt)
            self.observer.update_heading(measurements.heading)
            self.observer.update(measurements.north, measurements.east)
        north, east, heading, (surge, sway, yaw_rate), _ = self.observer.motion
        velocity_north, velocity_east = over_ground(surge, sway, heading)
        sog, cog = math.hypot(velocity_north, velocity_east), math.atan2(velocity_east, velocity_north)
        return NOTHING_KNOWN._replace(north=north, east=east, sog=sog, cog=cog, heading=heading, yaw_rate=yaw_rate)


class PositioningPilot:
    """Holds the position and heading of the order in force; the loop uses it as a `pilot.Pilot`."""

    finished = False

    def __init__(self, estimator: Estimator, mission: Ordered, controller: PositionPID, thrusters: Thrusters):
        self.estimator, self.mission, self.controller = estimator, mission, controller
        self._thrusters = thrusters
        self._tell = getattr(estimator, "order", lambda force: None)

    def step(self, measurements: Measurements, dt: float) -> Orders:
        """The thrusts (N), dt s after the previous step."""
        estimate = self.estimator.step(measurements, dt)
        leg = self.mission.step(estimate.north, estimate.east, dt)
        order = self.mission.now
        ahead, abeam = in_body(
            estimate.sog * math.cos(estimate.cog), estimate.sog * math.sin(estimate.cog), estimate.heading
        )
        wanted = self.controller.step(
            (order.north, order.east, order.course),
            estimate.north,
            estimate.east,
            estimate.heading,
            (ahead, abeam, estimate.yaw_rate),
            dt,
        )
        thrusts, achieved = self._thrusters.allocate(wanted)
        self._tell(achieved)
        away = math.hypot(order.north - estimate.north, order.east - estimate.east)
        bearing = math.atan2(order.east - estimate.east, order.north - estimate.north)
        leg = leg._replace(distance=away, bearing=bearing, speed=math.nan)
        desired = Reference(order.course, 0.0, 0.0)
        force, yaw = float(wanted[0]), float(wanted[2])
        return Orders(
            tuple(thrusts.tolist()), estimate, leg, desired, desired, math.nan, force, yaw, Mode.UNDER_WAY, False
        )
