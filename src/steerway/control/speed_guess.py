"""A rough guess of a boat's drag and thrust, and the limits of its shaft, for speed controllers.

The guessed boat u̇ = −d0 u − b0 u|u| + g0 n|n|, P3 (13), has a top speed U at full throttle and the time scale T =
U/(g0 n²). The controllers' gains and bounds are in units of U and T, so that boats of 10 kg and of 10,000 t behave
alike, each on its own time scale.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from steerway.core.checks import not_negative, positive, positive_or_unlimited
from steerway.core.compiled import kernel
from steerway.core.errors import InputError

SLOWEST, FASTEST = 0.05, 60.0
"""Accepted range of the guessed top speed, m/s. The largest is 117 kn."""
SHORTEST, LONGEST = 0.02, 3600.0
"""Accepted range of the guessed time scale T, s: one tick at 50 Hz to one hour."""
_QUICKER_SHAFT = 0.18
"""Default lag of a shaft with lead compensation, in units of 1/d_m: 1.5 s for P3's boat with d_m = 0.12 1/s."""


@dataclass(frozen=True)
class SpeedGuess:
    """The guess of P3 (13), the reference model of (14) and the shaft; the default is P3's boat.

    `linear_drag` d0 in 1/s, `quadratic_drag` b0 in 1/m, `thrust` g0 in m/rev². The shaft turns from `low` to `high`
    rev/s. `shaft_rate` (rev/s²) and `shaft_lag` (s), if known, model a shaft that is not measured. If the shaft is
    measured, an inner loop shortens the known lag to `wanted_lag` s, by default 0.18/d_m. `model_rate` d_m = g_m, 1/s:
    settling to 2 % takes ln 50/d_m; by default `PACE`/T.

    Raises InputError for numbers that no boat has.
    """

    PACE: ClassVar[float] = 1.8

    linear_drag: float = 0.0015
    quadratic_drag: float = 0.01
    thrust: float = 0.0049
    low: float = 0.0
    high: float = 17.5
    shaft_lag: float = 0.0
    shaft_rate: float = math.inf
    wanted_lag: float | None = None
    model_rate: float | None = None

    def __post_init__(self) -> None:
        positive("speed.thrust", self.thrust)
        for name in ("linear_drag", "quadratic_drag", "shaft_lag"):
            not_negative(f"speed.{name}", getattr(self, name))
        positive_or_unlimited("speed.shaft_rate", self.shaft_rate)
        for name in ("wanted_lag", "model_rate"):
            if getattr(self, name) is not None:
                positive(f"speed.{name}", getattr(self, name))
        if not (self.high > self.low and self.high > 0.0):
            raise InputError(
                f"speed.high is {self.high:g} rev/s, expected more than 0 and than speed.low, {self.low:g} rev/s"
            )
        if not SLOWEST <= self.top_speed <= FASTEST:
            raise InputError(
                f"speed.thrust is {self.thrust:g} m/rev², which with the drag guessed gives a top speed of "
                f"{self.top_speed:.3g} m/s at {self.high:g} rev/s, expected {SLOWEST:g} to {FASTEST:g} m/s"
            )
        if not SHORTEST <= self.time <= LONGEST:
            raise InputError(
                f"speed.thrust is {self.thrust:g} m/rev², which reaches the top speed in {self.time:.3g} s, "
                f"expected {SHORTEST:g} to {LONGEST:g} s"
            )

    @property
    def top_speed(self) -> float:
        """U of the guessed boat, m/s; infinite without drag."""
        push, d, b = self.thrust * self.high**2, self.linear_drag, self.quadratic_drag
        if b == 0.0:
            return push / d if d > 0.0 else math.inf
        return 2.0 * push / (d + math.sqrt(d * d + 4.0 * b * push))

    @property
    def time(self) -> float:
        """T = U/(g0 n²) at full throttle, s."""
        return self.top_speed / (self.thrust * self.high**2)

    @property
    def rate(self) -> float:
        """Rate d_m of the reference model, 1/s."""
        return self.PACE / self.time if self.model_rate is None else self.model_rate

    def shaft(self) -> tuple[float, float, float, float, float]:
        """(low, high, rate, lag, lead) of the shaft, for the kernels."""
        wanted = _QUICKER_SHAFT / self.rate if self.wanted_lag is None else self.wanted_lag
        return self.low, self.high, self.shaft_rate, self.shaft_lag, max(self.shaft_lag / wanted, 1.0)


@kernel
def follow(value: float, command: float, low: float, high: float, rate: float, lag: float, step: float) -> float:
    """Actuator position after `step` s of one command, from `value`: exact first-order lag, then the rate limit."""
    wanted = min(max(command, low), high)
    change = wanted - value
    if lag > 0.0:
        change *= -math.expm1(-step / lag)
    most = rate * step
    return value + min(max(change, -most), most)


@kernel
def signed_square(shaft: float) -> float:
    """n|n|, to which thrust is proportional."""
    return shaft * abs(shaft)


@kernel
def signed_root(square: float) -> float:
    """The n of a given n|n|."""
    return math.copysign(math.sqrt(abs(square)), square)


@kernel
def commanded(square: float, shaft: float, low: float, high: float, lead: float) -> tuple[float, float]:
    """(command, n before its limits) for a desired n|n|; `lead` above 1 drives a measured slow `shaft` harder."""
    free = signed_root(square)
    if lead > 1.0 and math.isfinite(shaft):
        free = shaft + lead * (min(max(free, low), high) - shaft)
    return min(max(free, low), high), free


@kernel
def shaft_now(
    measured: float, modelled: float, command: float, low: float, high: float, rate: float, lag: float, dt: float
) -> float:
    """Present shaft speed: the measured one, else `modelled` after the last command has acted for dt."""
    if math.isfinite(measured):
        return measured
    return follow(modelled, command, low, high, rate, lag, dt)
