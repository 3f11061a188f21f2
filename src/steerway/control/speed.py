"""Speed control of a boat with unknown drag and thrust: model reference adaptive control of the shaft speed.

P3 (13)–(18), changed where the paper's own runs miss its requirements:

- gains and bounds are in units of the guessed boat (`speed_guess`), and the adaptation rate of each parameter does not
  depend on the set-point;
- the speed error is fed back in addition to the adaptation;
- the reference is slowed by the thrust that the shaft still lacks (pseudo-control hedging; Johnson and Calise 2000), so
  that limits, rate and lag of the shaft do not change the parameters;
- the regressor of the adaptation is computed from the reference before it is slowed, not from the measured speed: noise
  and waves in the measurement are then uncorrelated with it and cause no drift (Sastry and Bodson 1989, 5.1).

A measured shaft with a known lag gets lead compensation.
"""

import math
from dataclasses import dataclass

import numpy as np

from steerway.control.speed_guess import SpeedGuess, commanded, shaft_now, signed_square
from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel

_SLOW = 0.08
"""Least S in the adaptation rate, as a fraction of the top speed. Without this limit 1/S² would be unbounded."""
_LARGEST = 0.5
"""Least S in the adaptation rate, as a fraction of the reference speed. For a boat under way with a set-point near 0,
the regressor would otherwise be hundreds of times the regressor at a steady speed."""


@dataclass(frozen=True)
class AdaptiveSpeedGains(SpeedGuess):
    """A guess of the boat, and the gains of its adaptation.

    `error_gain` k_z in units of d_m; `adaptation` γ̄ of Γ = γ̄ d_m²/g0 diag(S⁻², S⁻², S⁻⁴), with S the set-point;
    `reach`: half width of the parameter bounds about the guess, in units of (d_m + d0 + b0 U)/g0.
    """

    error_gain: float = 2.5
    adaptation: float = 2.0
    reach: float = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        not_negative("speed.error_gain", self.error_gain)
        not_negative("speed.adaptation", self.adaptation)
        positive("speed.reach", self.reach)

    def guess(self) -> np.ndarray:
        """(3,) parameters â_s, â_u, â_u|u| with which the guessed boat follows the model; below P3 (15)."""
        wanted = (self.rate, self.linear_drag - self.rate, self.quadratic_drag)
        return np.array(wanted, dtype=np.float64) / self.thrust

    def bounds(self) -> np.ndarray:
        """(2, 3) least and largest parameters; â_s stays positive."""
        whole = (self.rate + self.linear_drag + self.quadratic_drag * self.top_speed) / self.thrust
        middle = self.guess()
        reach = self.reach * whole * np.array((1.0, 1.0, 1.0 / self.top_speed))
        low, high = middle - reach, middle + reach
        low[0] = middle[0] / (1.0 + 2.0 * self.reach)
        return np.stack((low, high))


class AdaptiveSpeed:
    """Adaptive speed loop: `step` returns the shaft speed to command, rev/s.

    `model` is the reference model's speed u_m, `parameters` (3,) the â. The first step begins at the boat's speed.
    """

    def __init__(self, gains: AdaptiveSpeedGains | None = None):
        self.gains = gains = gains or AdaptiveSpeedGains()
        self._bounds = gains.bounds()
        self._constants = np.array(
            [
                gains.rate,
                gains.error_gain * gains.rate,
                gains.thrust,
                gains.adaptation * gains.rate**2 / gains.thrust,
                _SLOW * gains.top_speed,
                *gains.shaft(),
            ]
        )
        self.restart()

    def restart(self) -> None:
        """Reset the parameters and the reference."""
        self.parameters = self.gains.guess()
        self.model = math.nan
        self._planned = math.nan
        self.command = 0.0
        self._shaft = math.nan

    @property
    def at_bounds(self) -> bool:
        """Whether a parameter is at its bound: the guess is too far off, or there is a fault."""
        return bool(((self.parameters <= self._bounds[0]) | (self.parameters >= self._bounds[1])).any())

    def step(self, setpoint: float, speed: float, dt: float, shaft: float = math.nan) -> float:
        """Shaft speed (rev/s) to command for a set-point and an actual speed (m/s).

        `shaft` is the measured shaft speed (rev/s), from which the achieved part of the last command follows. Without
        it (NaN) the shaft is modelled by its rate limit and lag. An unknown (NaN) speed is replaced by the reference
        speed, and the parameters do not change.
        """
        if math.isnan(self.model):
            self.model = self._planned = speed if math.isfinite(speed) else 0.0
        self.model, self._planned, self.command, self._shaft = _adaptive_step(
            self.parameters,
            self._bounds,
            self.model,
            self._planned,
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
def _adaptive_step(
    parameters: Floats,
    bounds: Floats,
    model: float,
    planned: float,
    setpoint: float,
    speed: float,
    measured: float,
    modelled: float,
    last: float,
    dt: float,
    constants: Floats,
) -> tuple[float, float, float, float]:
    """(u_m, u_p, command, shaft now): one step of (14)–(18), in place on `parameters`.

    n|n| = φᵀâ − (k_z/g0) z with φ = [s, u, u|u|], then dâ/dt = −Γ φ_p z, with φ_p of the planned u̇_p = d_m (s − u_p);
    the reference is u̇_m = d_m (s − u_m) − g0 (commanded n|n| minus that of the shaft).
    """
    rate, error_gain, thrust, adaptation, slow = constants[0], constants[1], constants[2], constants[3], constants[4]
    low, high, shaft_rate, lag, lead = constants[5], constants[6], constants[7], constants[8], constants[9]
    known = math.isfinite(speed)
    u = speed if known else model
    z = u - model
    # The gain that gives the exact decay of the error over a step: stable for every dt.
    feedback = -math.expm1(-error_gain * dt) / dt if dt > 0.0 else error_gain
    wanted = setpoint * parameters[0] + u * parameters[1] + u * abs(u) * parameters[2] - feedback / thrust * z
    first = not (math.isfinite(measured) or math.isfinite(modelled))
    now = 0.0 if first else shaft_now(measured, modelled, last, low, high, shaft_rate, lag, dt)
    command, free = commanded(wanted, now if math.isfinite(measured) else math.nan, low, high, lead)
    # Anti-windup: no adaptation that would push the command further into a limit.
    if known and (free - command) * z >= 0.0:
        scale = max(abs(setpoint), _LARGEST * abs(planned), slow)
        square = scale * scale
        regressor = (setpoint / square, planned / square, planned * abs(planned) / (square * square))
        for i in range(3):
            moved = parameters[i] - adaptation * regressor[i] * z * dt
            parameters[i] = min(max(moved, bounds[0, i]), bounds[1, i])
    given = now
    if not math.isfinite(measured):
        # Not measured: without rate and lag the shaft follows at once.
        given = shaft_now(math.nan, now, command, low, high, shaft_rate, lag, 0.5 * dt)
        if lag == 0.0 and shaft_rate == math.inf:
            given = command
    lacking = wanted - signed_square(given)
    pace = -math.expm1(-rate * dt)
    model += pace * (setpoint - model) - thrust * lacking * dt
    planned += pace * (setpoint - planned)
    return model, planned, command, now
