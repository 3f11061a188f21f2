"""PI speed control with drag feedforward, from desired speed to surge force."""

import math
from dataclasses import dataclass

from steerway.control.course import beyond
from steerway.core.checks import not_negative, positive, positive_or_unlimited
from steerway.core.compiled import kernel


@dataclass(frozen=True)
class SpeedPIGains:
    """Gains of a PI speed loop. mass with added mass, kg; drag in N·s/m and N·s²/m²; bandwidth ω of the loop, rad/s.

    `limit` of the force ahead and `limit_astern` of the force astern in N (both positive; limit_astern 0: no reverse);
    `acceleration` of the reference towards the desired speed, m/s²; the speed estimate must be able to follow.
    """

    mass: float
    linear_drag: float = 0.0
    quadratic_drag: float = 0.0
    bandwidth: float = 0.5
    limit: float = math.inf
    limit_astern: float = 0.0
    acceleration: float = math.inf

    def __post_init__(self) -> None:
        positive("speed.mass", self.mass)
        positive("speed.bandwidth", self.bandwidth)
        not_negative("speed.linear_drag", self.linear_drag)
        not_negative("speed.quadratic_drag", self.quadratic_drag)
        positive_or_unlimited("speed.limit", self.limit)
        positive_or_unlimited("speed.acceleration", self.acceleration)
        if self.limit_astern != math.inf:
            not_negative("speed.limit_astern", self.limit_astern)


@kernel
def speed_pi(
    desired: float,
    speed: float,
    integral: float,
    mass: float,
    linear_drag: float,
    quadratic_drag: float,
    bandwidth: float,
) -> tuple[float, float]:
    """(force, error): drag at the desired speed, plus 2 m ω of the error, plus the integral (N)."""
    error = desired - speed if math.isfinite(speed) else 0.0
    drag = (linear_drag + quadratic_drag * abs(desired)) * desired
    return drag + 2.0 * mass * bandwidth * error + integral, error


class SpeedPI:
    """PI speed loop with both poles at ω for a boat without drag; drag makes one pole faster and one slower.

    The loop follows a reference speed. Without a limit of acceleration, the reference's acceleration is fed forward.
    The integral never moves further into a limit, as in the autopilot.
    """

    def __init__(self, gains: SpeedPIGains):
        self.gains = gains
        self._constants = (gains.mass, gains.linear_drag, gains.quadratic_drag, gains.bandwidth)
        self.restart()

    def restart(self) -> None:
        """Reset the integral and the reference."""
        self.integral = 0.0
        self.force = 0.0
        self._excess = 0.0
        self._approached = math.nan

    def step(self, desired: float, speed: float, dt: float, along: float = 0.0) -> float:
        """Surge force (N) for a desired and an actual speed (m/s; NaN for unknown).

        along: current along the bow (m/s), added to both speeds where the speed over ground is controlled.
        """
        gains = self.gains
        held = self._approach(desired, speed, dt)
        wanted, error = speed_pi(held + along, speed + along, self.integral, *self._constants)
        if gains.acceleration == math.inf:
            wanted += gains.mass * gains.bandwidth * (desired - held)
        self.force = max(-gains.limit_astern, min(gains.limit, wanted))
        push = gains.mass * gains.bandwidth**2 * error * dt
        excess = wanted - self.force or self._excess
        if push * excess <= 0.0:
            self.integral += push
        self._excess = 0.0
        return self.force

    def _approach(self, desired: float, speed: float, dt: float) -> float:
        """The reference speed, which moves from the boat's own speed to the desired one.

        Without a limit of acceleration it is a first-order model with the loop's bandwidth. A step fed directly to the
        loop would overshoot by e⁻² = 14 %.
        """
        before = self._approached
        if math.isnan(before):
            if math.isnan(speed):
                return 0.0  # begin from the boat's own speed, once it is known
            before = speed
        gains = self.gains
        if gains.acceleration == math.inf:
            self._approached = desired + (before - desired) * math.exp(-gains.bandwidth * dt)
        else:
            most = gains.acceleration * dt
            self._approached = before + max(-most, min(most, desired - before))
        return self._approached

    def speed_of(self, force: float) -> float:
        """Speed (m/s) at which the drag balances a force (N); NaN without drag."""
        return settled_speed(force, self.gains.linear_drag, self.gains.quadratic_drag)

    def limited_to(self, achieved: float) -> None:
        """Report the part of the last force (N) that the propellers achieved."""
        self._excess = beyond(self.force, achieved)


def settled_speed(force: float, linear_drag: float, quadratic_drag: float) -> float:
    """Speed (m/s) at which the drag balances a force (N); NaN without drag."""
    if linear_drag + quadratic_drag == 0.0:
        return math.nan
    size = abs(force)
    return math.copysign(2.0 * size / (linear_drag + math.sqrt(linear_drag**2 + 4.0 * quadratic_drag * size)), force)
