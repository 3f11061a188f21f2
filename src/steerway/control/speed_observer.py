"""Speed control of a boat with unknown drag and thrust: a disturbance observer on the measured shaft speed.

One disturbance δ stands for all errors of the guess of P3 (13): u̇ = −d0 u − b0 u|u| + g0 n|n| + δ. An observer with
both poles at ω_o estimates u and δ from the measured speed and shaft (Chen, Yang, Guo and Li 2016), and the shaft is
commanded so that u̇ = d_m (s − u). The observer uses the achieved shaft speed: limits, rate and lag do not affect δ.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from steerway.control.speed_guess import SpeedGuess, commanded, shaft_now, signed_square
from steerway.core.arrays import Floats
from steerway.core.checks import positive
from steerway.core.compiled import kernel


@dataclass(frozen=True)
class SpeedObserverGains(SpeedGuess):
    """A guess of the boat; `observer_rate` ω_o in units of d_m."""

    PACE: ClassVar[float] = 2.0

    observer_rate: float = 4.0

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("speed.observer_rate", self.observer_rate)


class ObservedSpeed:
    """Speed loop with a disturbance observer: `step` returns the shaft speed to command, rev/s.

    `speed` is the estimated speed (m/s), `disturbance` the estimated δ (m/s²).
    """

    def __init__(self, gains: SpeedObserverGains | None = None):
        self.gains = gains = gains or SpeedObserverGains()
        self._constants = np.array(
            [
                gains.rate,
                gains.observer_rate * gains.rate,
                gains.linear_drag,
                gains.quadratic_drag,
                gains.thrust,
                *gains.shaft(),
            ]
        )
        self.restart()

    def restart(self) -> None:
        """Reset the estimated speed and disturbance."""
        self.speed = math.nan
        self.disturbance = 0.0
        self.command = 0.0
        self._shaft = math.nan

    def step(self, setpoint: float, speed: float, dt: float, shaft: float = math.nan) -> float:
        """Shaft speed (rev/s) to command for a set-point and an actual speed (m/s); see `AdaptiveSpeed.step`."""
        if math.isnan(self.speed):
            self.speed = speed if math.isfinite(speed) else 0.0
        self.speed, self.disturbance, self.command, self._shaft = _observed_step(
            self.speed,
            self.disturbance,
            float(setpoint),
            speed,
            shaft,
            self._shaft,
            self.command,
            dt,
            self._constants,
        )
        return self.command


@kernel
def _observed_step(
    estimate: float,
    disturbance: float,
    setpoint: float,
    speed: float,
    measured: float,
    before: float,
    last: float,
    dt: float,
    constants: Floats,
) -> tuple[float, float, float, float]:
    """(û, δ̂, command, shaft now): predict to the end of the last step, correct, command."""
    rate, observer_rate = constants[0], constants[1]
    linear_drag, quadratic_drag, thrust = constants[2], constants[3], constants[4]
    low, high, shaft_rate, lag, lead = constants[5], constants[6], constants[7], constants[8], constants[9]
    first = not math.isfinite(before)
    now = measured if math.isfinite(measured) else 0.0
    if not first:
        now = shaft_now(measured, before, last, low, high, shaft_rate, lag, dt)
        given = 0.5 * (signed_square(before) + signed_square(now))
        if not math.isfinite(measured) and lag == 0.0 and shaft_rate == math.inf:
            given = signed_square(now)
        drag = (linear_drag + quadratic_drag * abs(estimate)) * estimate
        # Implicit in the drag: stable for every step length.
        damping = 1.0 + dt * (linear_drag + 2.0 * quadratic_drag * abs(estimate))
        estimate += dt * (thrust * given - drag + disturbance) / damping
    if math.isfinite(speed) and dt > 0.0:
        left = math.exp(-observer_rate * dt)
        error = speed - estimate
        estimate += (1.0 - left * left) * error
        if not first:
            disturbance += (1.0 - left) ** 2 / dt * error
    drag = (linear_drag + quadratic_drag * abs(estimate)) * estimate
    wanted = (rate * (setpoint - estimate) + drag - disturbance) / thrust
    command, _ = commanded(wanted, now if math.isfinite(measured) else math.nan, low, high, lead)
    return estimate, disturbance, command, now
