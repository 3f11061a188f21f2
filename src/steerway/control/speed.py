"""Holding a speed without knowing the boat: model reference adaptive control of the shaft speed.

After P3 (13)–(18), bettered where the paper's own runs miss its requirements: each parameter adapts at a rate that does
not depend on the speed asked for, the error is fed back beside the adaptation, parameters stay within what boats have
and stand still while the shaft is at its limit. A shaft that follows slowly can be driven harder until it is there.
"""

import math
from dataclasses import dataclass

import numpy as np

from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError

PROJECTION = ((0.0, 120.0), (-60.0, 20.0), (-10.0, 20.0))
"""Where the parameters â_s, â_u, â_u|u| may be, in (rev/s)² per (m/s), per (m/s) and per (m/s)²."""


@dataclass(frozen=True)
class AdaptiveSpeedGains:
    """What the boat is asked to follow, a guess of what she is, and how fast the guess is bettered.

    `model_rate` d_m = g_m of (14), 1/s: settling to 2 % takes ln 50/d_m, 32.6 s as given. `error_gain` k_z and
    `adaptation` γ̄ in 1/s and (rev/s)²·s/m... each over the set-point as Γ = γ̄ diag(s⁻², s⁻², s⁻⁴). The guess of (13):
    `linear_drag` d0 in 1/s, `quadratic_drag` b0 in 1/m, `thrust` g0 in m/rev². The shaft turns from `low` to `high`
    rev/s. `shaft_lag` τ̂ s of the shaft's first-order lag, which the inner loop shortens to `wanted_lag` s where it is
    longer. `projection`: bounds of the three parameters. Raises InputError for numbers that cannot be.
    """

    model_rate: float = 0.12
    error_gain: float = 0.5
    adaptation: float = 10.0
    linear_drag: float = 0.0015
    quadratic_drag: float = 0.01
    thrust: float = 0.0049
    low: float = 0.0
    high: float = 17.5
    shaft_lag: float = 0.0
    wanted_lag: float = 1.5
    projection: tuple[tuple[float, float], ...] = PROJECTION

    def __post_init__(self):
        for name in ("model_rate", "thrust", "wanted_lag"):
            positive(f"speed.{name}", getattr(self, name))
        for name in ("error_gain", "adaptation", "linear_drag", "quadratic_drag", "shaft_lag"):
            not_negative(f"speed.{name}", getattr(self, name))
        if not self.high > self.low:
            raise InputError(f"speed.high is {self.high:g} rev/s, expected more than speed.low, {self.low:g} rev/s")
        if len(self.projection) != 3 or any(not low < high for low, high in self.projection):
            raise InputError(f"speed.projection is {self.projection}, expected three pairs of rising bounds")

    def guess(self) -> np.ndarray:
        """(3,) â_s, â_u, â_u|u| that make the guessed boat follow the model; under P3 (15)."""
        wanted = (self.model_rate, self.linear_drag - self.model_rate, self.quadratic_drag)
        return np.array(wanted, dtype=np.float64) / self.thrust


SETPOINT, MODEL, A_S, A_U, A_UU = range(5)


class AdaptiveSpeed:
    """One speed loop: `step` gives the shaft speed to command, rev/s.

    `model` is the reference model's speed u_m, `parameters` (3,) the â. The first step sets out from the boat's speed.
    """

    def __init__(self, gains: AdaptiveSpeedGains | None = None):
        self.gains = gains = gains or AdaptiveSpeedGains()
        bounds = np.array(gains.projection, dtype=np.float64)
        self._constants = np.array(
            [
                gains.model_rate,
                gains.error_gain / gains.thrust,
                gains.adaptation,
                gains.low,
                gains.high,
                max(gains.shaft_lag / gains.wanted_lag, 1.0),
                *bounds.ravel(),
            ]
        )
        self.restart()

    def restart(self) -> None:
        """Forget what was learned, and the reference."""
        self.parameters = self.gains.guess()
        self.model = math.nan
        self.command = 0.0

    def step(self, setpoint: float, speed: float, dt: float, shaft: float = math.nan) -> float:
        """Shaft speed (rev/s) to command for a set-point and an actual speed (m/s).

        `shaft`, the shaft's own speed now, lets the inner loop drive a slow one. While the speed is unknown (NaN) the
        reference itself is held and nothing is learned.
        """
        if math.isnan(self.model):
            self.model = speed if math.isfinite(speed) else 0.0
        self.model, self.command = _adaptive_step(
            self.parameters, self.model, float(setpoint), speed, shaft, dt, self._constants
        )
        return self.command


@kernel
def _signed_root(square):
    return math.copysign(math.sqrt(abs(square)), square)


@kernel
def _adaptive_step(parameters, model, setpoint, speed, shaft, dt, constants):
    """(u_m, n): one step of (14)–(18) with error feedback, in place on `parameters`.

    n|n| = φᵀâ − (k_z/g0) z with φ = [s, u, u|u|], then dâ/dt = −Γ φ z with Γ = γ̄ diag(s⁻², s⁻², s⁻⁴).
    """
    rate, error_gain, adaptation, low, high, lead = (
        constants[0],
        constants[1],
        constants[2],
        constants[3],
        constants[4],
        constants[5],
    )
    known = math.isfinite(speed)
    u = speed if known else model
    z = u - model
    wanted = setpoint * parameters[0] + u * parameters[1] + u * abs(u) * parameters[2] - error_gain * z
    free = _signed_root(wanted)
    if lead > 1.0 and math.isfinite(shaft):
        free = shaft + lead * (min(max(free, low), high) - shaft)
    command = min(max(free, low), high)
    # A parameter that would push further into the limit stands still, or it would have to be unlearned afterwards.
    beyond = free - command
    if known and beyond * z >= 0.0:
        scale = max(abs(setpoint), 1.0)
        square = scale * scale
        regressor = (setpoint / square, u / square, u * abs(u) / (square * square))
        for i in range(3):
            moved = parameters[i] - adaptation * regressor[i] * z * dt
            parameters[i] = min(max(moved, constants[6 + 2 * i]), constants[7 + 2 * i])
    model += -math.expm1(-rate * dt) * (setpoint - model)
    return model, command
