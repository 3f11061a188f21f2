"""Predictive and LQG heading control as an autopilot's controller: one step per sample, held in between."""

import math

from steerway.control.heading_mpc import LONGEST_HORIZON, HeadingLqg, HeadingMpc
from steerway.control.heading_plant import HeadingResponse, SampledHeading
from steerway.core.checks import one_of, positive

KINDS = ("pole-placement", "mpc", "lqg")
"""Kinds of autopilots; the first is `control.course.AnglePID`."""
_LOOK_AHEAD = 6.0
"""Horizon of an MPC in units of 1/ω; later errors have no cost. A first-order error is then e⁻⁶, 0.25 %."""


class SampledSteering:
    """An MPC or LQG in place of the `AnglePID` of an `Autopilot`. `command` is the present input.

    design: the controller; sample: interval of its steps, s.
    """

    def __init__(self, design: SampledHeading, sample: float):
        self.design, self.sample = design, positive("steering.sample", sample)
        self.restart()

    @property
    def integral(self) -> float:
        """The trim: the estimated bias of the input with its sign changed."""
        return -self.design.observer.bias

    def restart(self) -> None:
        """Reset the controller and its estimated bias."""
        self.design.reset()
        self.command = 0.0
        self._left = 0.0

    def start(self, command: float, reference: tuple[float, float, float], angle: float, rate: float) -> None:
        """Continue from a command, with the bias estimated so far."""
        bias = self.design.observer.bias
        self.design.reset(applied=command)
        self.design.observer.state[-1] = bias
        self.command = command
        self._left = 0.0

    def step(self, reference: tuple[float, float, float], angle: float, rate: float, dt: float) -> float:
        """Command for an estimated angle (rad) and a reference whose first number is the desired angle."""
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
        """Report the part of the last command that the actuators achieved."""
        self.design.input = achieved


def steering(
    kind: str,
    response: HeadingResponse,
    limit: float,
    slew: float = math.inf,
    angle_std: float = 0.0,
    bandwidth: float | None = None,
) -> SampledSteering:
    """An MPC or LQG (`kind` "mpc" or "lqg") for a heading response.

    `limit`: largest output; `slew`: its largest change per second, in its unit; angle_std: 1σ of an estimated course or
    heading, rad; bandwidth: bandwidth of the loop for Nomoto's response, rad/s; without it the limits give the weights.
    Raises InputError for numbers that cannot be used, and if the package that solves the MPC's QP is missing.
    """
    one_of("autopilot.kind", kind, KINDS[1:])
    design = HeadingMpc if kind == "mpc" else HeadingLqg
    weights: dict[str, float] = {}
    if bandwidth is not None:
        weights["change_weight"] = change_weight(response, bandwidth)
        if kind == "mpc":
            weights["horizon"] = min(max(10, round(_LOOK_AHEAD / (bandwidth * response.sample))), LONGEST_HORIZON)
    return SampledSteering(design.for_(response, limit, slew, angle_std, **weights), response.sample)


def change_weight(response: HeadingResponse, bandwidth: float) -> float:
    """Weight R for a loop of `bandwidth` ω (rad/s), with Q = 1 per degree².

    Above 1/T the heading is K/T times the triple integral of the input's rate, and min ∫ Q e² + R u̇² puts its poles at
    ω⁶ = (K/T)² Q/R.
    """
    h = response.sample
    time = -h / math.log(response.poles[1])
    return math.degrees(1.0) ** 2 * (response.gains[0] / (h * time)) ** 2 / (bandwidth**6 * h**2)
