"""What a speed controller has to know of a boat: a rough guess of drag and thrust, and the limits of its shaft.

The guessed boat u̇ = −d0 u − b0 u|u| + g0 n|n|, P3 (13), has a top speed U at full throttle and reaches it in the time
T = U/(g0 n²). Gains and bounds of the controllers are numbers in units of the two, so that boats of 10 kg and of
10,000 t behave alike, each in its own time.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from steerway.core.checks import not_negative, positive, positive_or_unlimited
from steerway.core.compiled import kernel
from steerway.core.errors import InputError

SLOWEST, FASTEST = 0.05, 60.0
"""m/s; a guess whose top speed lies outside is no boat's. Chosen: the fastest is 117 kn."""
SHORTEST, LONGEST = 0.02, 3600.0
"""s; nor is one whose time T lies outside. Chosen: a tick at 50 Hz, and an hour."""
_QUICKER_SHAFT = 0.18
"""Part of the reference model's time to which the inner loop shortens a slower shaft's lag. Chosen: 1.5 s for
P3's boat with d_m = 0.12 1/s."""


@dataclass(frozen=True)
class SpeedGuess:
    """The guess of P3 (13), the reference model of (14) and the shaft.

    `linear_drag` d0 in 1/s, `quadratic_drag` b0 in 1/m, `thrust` g0 in m/rev². The shaft turns from `low` to `high`
    rev/s; `shaft_rate` rev/s² and `shaft_lag` s, where known, stand for a shaft that is not measured. A lag that is
    known is shortened by an inner loop to `wanted_lag` s, by default 0.18 of the reference model's time. `model_rate`
    d_m = g_m, 1/s: settling to 2 % takes ln 50/d_m; by default `PACE`/T. As given: P3's boat.

    Raises InputError for numbers that cannot be a boat's.
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
                f"speed.thrust is {self.thrust:g} m/rev², which gives the top speed in {self.time:.3g} s, "
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
        """d_m in force, 1/s."""
        return self.PACE / self.time if self.model_rate is None else self.model_rate

    def shaft(self) -> tuple[float, float, float, float, float]:
        """Low, high, rate, lag and lead of the shaft: what the kernels read."""
        wanted = _QUICKER_SHAFT / self.rate if self.wanted_lag is None else self.wanted_lag
        return self.low, self.high, self.shaft_rate, self.shaft_lag, max(self.shaft_lag / wanted, 1.0)


@kernel
def follow(value: float, command: float, low: float, high: float, rate: float, lag: float, step: float) -> float:
    """Position after `step` s of one command of an actuator at `value`: exact lag, then limited to its rate."""
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
    """n of n|n|."""
    return math.copysign(math.sqrt(abs(square)), square)


@kernel
def commanded(square: float, shaft: float, low: float, high: float, lead: float) -> tuple[float, float]:
    """(command, n before its limits) for a wanted n|n|; `lead` drives a slow shaft at `shaft` harder, if measured."""
    free = signed_root(square)
    if lead > 1.0 and math.isfinite(shaft):
        free = shaft + lead * (min(max(free, low), high) - shaft)
    return min(max(free, low), high), free


@kernel
def shaft_now(
    measured: float, modelled: float, command: float, low: float, high: float, rate: float, lag: float, dt: float
) -> float:
    """The shaft's speed now: measured, else as an `Actuator` follows the last command from where it was."""
    if math.isfinite(measured):
        return measured
    return follow(modelled, command, low, high, rate, lag, dt)
