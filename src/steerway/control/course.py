"""The steering autopilot: PID with reference feedforward on an angle; P0 (54)–(59), P1 (29)–(34) with corrected signs.

With course over ground and course rate it is a course autopilot, with heading and yaw rate a heading autopilot. Its
command, a rudder angle (rad) or a yaw moment (N·m), is the input of the Nomoto model from which its gains follow.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from steerway.core.angles import wrap
from steerway.core.checks import not_negative, positive, positive_or_unlimited
from steerway.core.compiled import kernel
from steerway.core.errors import InputError


@dataclass(frozen=True)
class AnglePIDGains:
    """Gains of the autopilot; u is the command's unit, rad or N·m.

    K_p in u/rad, T_i in s (inf: no integral), T_d in s; feedforward of rate 1/K in u·s/rad and of acceleration T/K in
    u·s²/rad; `limit` of |command| in u.
    """

    proportional: float
    integral_time: float = math.inf
    derivative_time: float = 0.0
    rate_feedforward: float = 0.0
    acceleration_feedforward: float = 0.0
    limit: float = math.inf

    def __post_init__(self) -> None:
        positive("autopilot.proportional", self.proportional)
        positive_or_unlimited("autopilot.integral_time", self.integral_time)
        for name in ("derivative_time", "rate_feedforward", "acceleration_feedforward"):
            not_negative(f"autopilot.{name}", getattr(self, name))
        positive_or_unlimited("autopilot.limit", self.limit)


class YawResponse(NamedTuple):
    """T ω̇ + (d_0 − m U²) ω + n ω|ω| = K u: gain K in rad/s per unit of u, time T (s), linear d_0, munk m (s²/m²; the
    Munk moment of a slender hull grows with the square of the speed), quadratic n (s/rad)."""

    gain: float
    time: float
    linear: float = 1.0
    munk: float = 0.0
    quadratic: float = 0.0

    @property
    def stable_speed(self) -> float:
        """Speed through the water (m/s) up to which the hull is directionally stable."""
        return math.sqrt(max(self.linear, 0.0) / self.munk) if self.munk > 0.0 else math.inf

    def gains(self, bandwidth: float, speed: float, limit: float) -> AnglePIDGains:
        """Gains that place both poles at the bandwidth, at a speed through the water; `order` gives the feedforward.

        There is no integral, because the bias is estimated.

        A response without lag (T = 0) gets proportional action only.
        """
        damping = self.linear - self.munk * speed * speed
        stiffness, spread = self.time * bandwidth**2, 2.0 * self.time * bandwidth - damping
        if spread <= 0.0:  # the hull alone damps more: the slower pole at the bandwidth
            slow = min(bandwidth, 0.5 * damping / self.time) if self.time > 0.0 else bandwidth
            stiffness, spread = slow * (damping - slow * self.time), 0.0
        return AnglePIDGains(stiffness / self.gain, derivative_time=spread / stiffness, limit=limit)

    def order(self, rate: float, acceleration: float, speed: float, bias: float) -> float:
        """Output u for a yaw rate and its acceleration, at a speed through the water and with a bias of the rate."""
        damping = self.linear - self.munk * speed * speed + self.quadratic * abs(rate)
        return (self.time * acceleration + damping * rate - bias) / self.gain


def place_poles(
    nomoto_gain: float, nomoto_time: float, bandwidth: float, damping: float = 1.0, limit: float = math.inf
) -> AnglePIDGains:
    """Gains that give a Nomoto vessel T ω̇ + ω = K u the poles of ω_n (rad/s) and ζ; P0 (57)–(59), feedforward (55).

    The integral, T_i = 10/ω_n, is added afterwards: with ζ = 1 the three poles are then 0.13, 0.59 and 1.28 ω_n. Raises
    InputError for 2ζω_n < 1/T: the vessel alone damps more than demanded, and T_d would be negative.
    """
    gain = positive("nomoto.gain", nomoto_gain)
    time = positive("nomoto.time_constant", nomoto_time)
    positive("autopilot.damping", damping)
    least = 1.0 / (2.0 * damping * time)
    if positive("autopilot.bandwidth", bandwidth) < least:
        raise InputError(
            f"autopilot.bandwidth is {bandwidth:g} rad/s, expected at least {least:g} rad/s, "
            f"1/(2ζT) with the vessel's time constant T of {time:g} s"
        )
    proportional = time / gain * bandwidth**2
    return AnglePIDGains(
        proportional=proportional,
        integral_time=10.0 / bandwidth,
        derivative_time=time / (gain * proportional) * (2.0 * damping * bandwidth - 1.0 / time),
        rate_feedforward=1.0 / gain,
        acceleration_feedforward=time / gain,
        limit=limit,
    )


def course_gains(
    nomoto_gain: float,
    nomoto_time: float,
    bandwidth: float,
    damping: float = 1.0,
    limit: float = math.inf,
    has_bias: bool = True,
) -> AnglePIDGains:
    """Gains for a Nomoto vessel T ω̇ + ω = K u at any bandwidth ω_n (rad/s); T in s, 0 allowed.

    For 2ζω_n T ≥ 1 they are those of `place_poles`. Below that the vessel itself damps more than ζ, and derivative
    action would have to be negative. Proportional action alone, K K_p = ω_n (1 − T ω_n), then puts the slowest pole of
    T s² + s + K K_p at ω_n. For ζ = 1 both designs agree at the boundary. A vessel with its own yaw-rate loop has
    K = 1, and K_p = ω_n if it follows at once. This loop rejects wind and waves, so the command needs no integral:
    `has_bias` False.
    """
    gain = positive("nomoto.gain", nomoto_gain)
    time = not_negative("nomoto.time_constant", nomoto_time)
    positive("autopilot.bandwidth", bandwidth)
    if 2.0 * positive("autopilot.damping", damping) * bandwidth * time >= 1.0:
        placed = place_poles(gain, time, bandwidth, damping, limit)
        return placed if has_bias else replace(placed, integral_time=math.inf)
    slowest = bandwidth if 2.0 * bandwidth * time < 1.0 else 0.5 / time
    return AnglePIDGains(
        proportional=slowest * (1.0 - slowest * time) / gain,
        integral_time=10.0 / bandwidth if has_bias else math.inf,
        rate_feedforward=1.0 / gain,
        acceleration_feedforward=time / gain,
        limit=limit,
    )


@kernel
def _known(value: float) -> float:
    return value if math.isfinite(value) else 0.0


@kernel
def angle_pid(
    desired: float,
    desired_rate: float,
    desired_acceleration: float,
    angle: float,
    rate: float,
    integral: float,
    proportional: float,
    derivative_time: float,
    rate_feedforward: float,
    acceleration_feedforward: float,
) -> tuple[float, float]:
    """(command, error): u = τ_FF + I − K_p (ssa(χ̃) + T_d ω̃), P0 (54)–(55); `integral` I is in the command's unit.

    An unknown (NaN) input contributes nothing; the integral and the terms of known inputs remain.
    """
    error = _known(wrap(angle - desired))
    rate_error = _known(rate - desired_rate)
    feedforward = _known(acceleration_feedforward * desired_acceleration + rate_feedforward * desired_rate)
    return feedforward + integral - proportional * (error + derivative_time * rate_error), error


class AnglePID:
    """PID autopilot of an angle; `step` returns the command within its limit.

    The integral never moves further into a limit: its own, or that of the actuators, which `limited_to` reports.
    `start` takes over from another controller without a jump.
    """

    def __init__(self, gains: AnglePIDGains):
        self.gains = gains
        self.restart()

    @property
    def gains(self) -> AnglePIDGains:
        """The gains; a change between two steps keeps the integral."""
        return self._gains

    @gains.setter
    def gains(self, gains: AnglePIDGains) -> None:
        self._gains = gains
        self._constants = (
            gains.proportional,
            gains.derivative_time,
            gains.rate_feedforward,
            gains.acceleration_feedforward,
        )

    def restart(self) -> None:
        """Reset the integral."""
        self.integral = 0.0
        self.command = 0.0
        self._excess = 0.0

    def start(self, command: float, reference: tuple[float, float, float], angle: float, rate: float) -> None:
        """Set the integral so that the first step on this reference and angle gives `command`, within the limits."""
        self.command = command
        self.integral = 0.0
        free, _ = angle_pid(*reference, angle, rate, 0.0, *self._constants)
        self.integral = _within(command - free, self.gains.limit)
        self._excess = 0.0

    def step(self, reference: tuple[float, float, float], angle: float, rate: float, dt: float) -> float:
        """Command for a boat at `angle` turning at `rate` (rad, rad/s); reference: (angle, rate, acceleration)."""
        gains = self._gains
        wanted, error = angle_pid(*reference, angle, rate, self.integral, *self._constants)
        self.command = _within(wanted, gains.limit)
        push = -gains.proportional / gains.integral_time * error * dt
        # Use the previous saturation: actuator limits are known only after the command.
        excess = wanted - self.command or self._excess
        if push * excess <= 0.0:
            self.integral = _within(self.integral + push, gains.limit)
        self._excess = 0.0
        return self.command

    def limited_to(self, achieved: float) -> None:
        """Report what the actuators achieved of the last command; call it after `step` if they have limits."""
        self._excess = beyond(self.command, achieved)


def beyond(command: float, achieved: float) -> float:
    """The part of a command that limits removed; 0 if only rounding differs, which must not stop an integral."""
    excess = command - achieved
    return excess if abs(excess) > 1e-9 * abs(command) else 0.0


def _within(value: float, limit: float) -> float:
    return limit if value > limit else -limit if value < -limit else value
