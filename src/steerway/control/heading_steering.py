"""Predictive and LQG heading control as an autopilot's controller: a step a sample of its model, held in between."""

import math
from typing import Protocol

from steerway.control.heading_lqg import HeadingLqg
from steerway.control.heading_mpc import HeadingMpc
from steerway.control.heading_plant import BiasObserver, HeadingResponse
from steerway.core.checks import one_of, positive

KINDS = ("pole-placement", "mpc", "lqg")
"""Of autopilots; the first is `control.course.AnglePID`."""


class Sampled(Protocol):
    """`HeadingMpc`, `HeadingLqg`."""

    input: float
    observer: BiasObserver

    def step(self, wanted: float, estimated: float) -> float: ...


class SampledSteering:
    """Takes the place of `AnglePID` in an `Autopilot`. `command` is the input in force.

    design: the controller. sample: s between its steps.
    """

    def __init__(self, design: Sampled, sample: float):
        self.design, self.sample = design, positive("steering.sample", sample)
        self.restart()

    @property
    def integral(self) -> float:
        """The trim: what makes up for the estimated bias."""
        return -self.design.observer.bias

    def restart(self) -> None:
        """Forget the trim."""
        self.design.reset()
        self.command = 0.0
        self._left = 0.0

    def start(self, command: float, reference: tuple[float, float, float], angle: float, rate: float) -> None:
        """Go on from a command at an angle (rad), with the trim learned so far."""
        bias = self.design.observer.bias
        self.design.reset(applied=command)
        self.design.observer.state[-1] = bias
        self.command = command
        self._left = 0.0

    def step(self, reference: tuple[float, float, float], angle: float, rate: float, dt: float) -> float:
        """Command for a boat at `angle` (rad) and a reference whose first number is the angle wanted."""
        self._left -= dt
        if self._left <= 0.5 * dt:
            self._left += self.sample
            if self._left <= 0.0:
                self._left = self.sample  # the loop is slower than the design
            wanted = reference[0] if math.isfinite(reference[0]) else angle
            if math.isfinite(wanted):
                self.command = self.design.step(wanted, angle)
        return self.command

    def limited_to(self, achieved: float) -> None:
        """What the actuators made of the last command."""
        self.design.input = achieved


def steering(kind: str, nomoto_gain: float, nomoto_time: float, limit: float, angle_std: float) -> SampledSteering:
    """The controller of a kind ("mpc", "lqg") for a boat by Nomoto's K and T; `limit` of its output, in its unit.

    angle_std: of one estimated course or heading, rad. Raises InputError for numbers that cannot be used, and without
    the package that solves the MPC's problem.
    """
    one_of("autopilot.kind", kind, KINDS[1:])
    response = HeadingResponse.of_nomoto(nomoto_gain, nomoto_time)
    design = HeadingMpc if kind == "mpc" else HeadingLqg
    return SampledSteering(design.for_(response, limit, angle_std=angle_std), response.sample)
