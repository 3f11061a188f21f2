"""Thrust allocation: from generalized force to two propellers, one shaft, a rudder or any number of thrusters.

The generalized force in surge, sway and yaw is τ = B f, with f the thrusts and B the thruster configuration matrix. The
allocation is f = B⁺ τ (Fossen 2021, section 11.2). A thruster beyond its limit is held there, and the other thrusters
supply the rest of τ (redistributed pseudo-inverse; Bordignon 1996).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from steerway.control.speed_guess import signed_root, signed_square
from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError


class Actuation(Protocol):
    """Converts a surge force and the autopilot's output (yaw moment, rudder angle or yaw rate) to actuator commands."""

    def step(self, surge_force: float, yaw: float, /) -> tuple[float, ...]:
        """One command per actuator, then the achieved surge force, then the achieved autopilot output."""


class PropellerCommand(NamedTuple):
    """Commands of two propellers, and the force and moment that they achieve."""

    port: float  # rad/s
    starboard: float  # rad/s
    surge_force: float  # N
    yaw_moment: float  # N·m, + to starboard


@kernel
def shaft_speed(thrust: float, gain_ahead: float, gain_astern: float) -> float:
    """Propeller speed n (rad/s) for a thrust (N): T = k n|n|, with k the gain ahead or astern."""
    return math.sqrt(thrust / gain_ahead) if thrust >= 0.0 else -math.sqrt(-thrust / gain_astern)


@kernel
def thrust(speed: float, gain_ahead: float, gain_astern: float) -> float:
    """Thrust T = k n|n| (N) of a propeller at the speed n (rad/s), with k the gain ahead or astern."""
    return (gain_ahead if speed >= 0.0 else gain_astern) * speed * abs(speed)


@kernel
def allocate(
    surge_force: float,
    yaw_moment: float,
    arm: float,
    gain_ahead: float,
    gain_astern: float,
    max_thrust: float,
    min_thrust: float,
) -> tuple[float, float, float, float]:
    """(port rad/s, starboard rad/s, force N, moment N·m) by P0 (60)–(63), with limits and one gain per direction.

    The yaw moment has priority: the force is reduced first, and the moment only above the largest moment of the pair.
    """
    half = yaw_moment / (2.0 * arm)
    room = 0.5 * (max_thrust - min_thrust)
    half = min(room, max(-room, half))
    mean = min(max_thrust - abs(half), max(min_thrust + abs(half), 0.5 * surge_force))
    port = shaft_speed(mean + half, gain_ahead, gain_astern)
    starboard = shaft_speed(mean - half, gain_ahead, gain_astern)
    return port, starboard, 2.0 * mean, 2.0 * arm * half


@dataclass(frozen=True)
class TwoPropellers:
    """Two propellers at ± `arm` (m) from the centre line: T = k n|n| (k in N·s²), with limits of the speed n (rad/s).

    Set `min_speed` to 0 for propellers that do not reverse. The yaw moment of the pair is arm · (T_port − T_starboard).
    """

    arm: float
    gain_ahead: float
    gain_astern: float
    max_speed: float
    min_speed: float
    _constants: tuple[float, float, float, float, float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("arm", "gain_ahead", "gain_astern", "max_speed"):
            positive(f"propellers.{name}", getattr(self, name))
        if not self.min_speed <= 0.0:
            raise InputError(f"propellers.min_speed is {self.min_speed:g} rad/s, expected at most 0")
        limits = (thrust(n, self.gain_ahead, self.gain_astern) for n in (self.max_speed, self.min_speed))
        constants = (self.arm, self.gain_ahead, self.gain_astern, *limits)
        object.__setattr__(self, "_constants", tuple(map(float, constants)))

    def step(self, surge_force: float, yaw_moment: float) -> PropellerCommand:
        """Propeller speeds for a surge force (N) and yaw moment (N·m), with the force and moment achieved."""
        return PropellerCommand(*allocate(surge_force, yaw_moment, *self._constants))

    @property
    def max_moment(self) -> float:
        """Largest yaw moment (N·m) of the pair, whatever the surge force."""
        _, _, _, max_thrust, min_thrust = self._constants
        return self.arm * (max_thrust - min_thrust)


OTTER_PROPELLERS = TwoPropellers(
    arm=0.395,
    gain_ahead=0.02216 / 2.0,
    gain_astern=0.01289 / 2.0,
    max_speed=math.sqrt(0.5 * 24.4 * 9.81 / (0.02216 / 2.0)),
    min_speed=-math.sqrt(0.5 * 13.6 * 9.81 / (0.01289 / 2.0)),
)
"""The Otter's propellers: the pair has a bollard pull of 24.4 kgf ahead and 13.6 kgf astern (Fossen's public MSS)."""


class RudderCommand(NamedTuple):
    """The rudder command (rad), and the surge force and rudder angle achieved."""

    rudder: float
    surge_force: float
    yaw: float


@dataclass(frozen=True)
class Rudder:
    """One rudder, ± `limit` rad, + turns to starboard. The autopilot's output is the rudder angle itself."""

    limit: float

    def __post_init__(self) -> None:
        positive("rudder.limit", self.limit)

    def step(self, surge_force: float, yaw: float) -> RudderCommand:
        """The command for a demanded rudder angle (rad), within the limit; the surge force is returned unchanged."""
        rudder = max(-self.limit, min(self.limit, yaw))
        return RudderCommand(rudder, surge_force, rudder)


@dataclass(frozen=True)
class ShaftSpeed:
    """One command, the shaft speed (rev/s) from `low` to `high`; `gain` in N per (rev/s)². Yaw is not actuated."""

    gain: float
    high: float
    low: float = 0.0

    def __post_init__(self) -> None:
        positive("shaft.gain", self.gain)
        positive("shaft.high", self.high)
        not_negative("shaft.low", -self.low)

    def turning(self, surge_force: float) -> tuple[float, float]:
        """(shaft speed in rev/s, its bollard thrust in N) for a demanded force (N)."""
        shaft = min(max(signed_root(surge_force / self.gain), self.low), self.high)
        return shaft, self.gain * signed_square(shaft)

    def step(self, surge_force: float, yaw: float) -> tuple[float, ...]:
        """(shaft speed, achieved force, achieved yaw) for a force (N)."""
        shaft, force = self.turning(surge_force)
        return shaft, force, 0.0


@dataclass(frozen=True)
class ShaftAndMoment(ShaftSpeed):
    """Two commands, the shaft speed and a yaw moment within ± `moment` N·m."""

    moment: float = math.inf

    def step(self, surge_force: float, yaw: float) -> tuple[float, ...]:
        """(shaft speed, yaw moment, achieved force, achieved moment) for a force (N) and a moment (N·m)."""
        shaft, force = self.turning(surge_force)
        moment = min(max(yaw, -self.moment), self.moment)
        return shaft, moment, force, moment


_RANK = 1e-9
"""Singular values below this fraction of the largest count as 0."""


def thruster_matrix(places: Sequence[tuple[float, float, float]]) -> Floats:
    """Configuration matrix B (3, n) of thrusters: (m forward, m to starboard, thrust direction in rad from the bow)."""
    columns = [(math.cos(a), math.sin(a), x * math.sin(a) - y * math.cos(a)) for x, y, a in places]
    return np.array(columns, dtype=np.float64).reshape(-1, 3).T


class Thrusters:
    """Thrust allocation for a configuration matrix B (3, n) and thrusts from `low` to `high` (n,), N.

    Raises InputError for shapes that do not match, limits that do not contain 0 N, and a B of rank below 3.
    """

    def __init__(self, matrix: ArrayLike, low: ArrayLike, high: ArrayLike):
        self.matrix, self.low, self.high = (np.array(each, dtype=np.float64) for each in (matrix, low, high))
        if self.matrix.ndim != 2 or self.matrix.shape[0] != 3 or not np.isfinite(self.matrix).all():
            raise InputError(f"thrusters.matrix has shape {self.matrix.shape}, expected (3, n) numbers")
        for name, limits in (("low", self.low), ("high", self.high)):
            if limits.shape != self.matrix.shape[1:]:
                raise InputError(f"thrusters.{name} has shape {limits.shape}, expected {self.matrix.shape[1:]}")
        if not ((self.low <= 0.0) & (self.high > 0.0)).all():
            raise InputError(f"thrusters have limits {self.low} to {self.high} N, expected low at most 0, high above 0")
        if np.linalg.matrix_rank(self.matrix, _RANK) < 3:
            raise InputError("thrusters do not give surge, sway and yaw together, expected three independent ones")

    def allocate(self, force: ArrayLike) -> tuple[Floats, Floats]:
        """(thrusts (n,), achieved generalized force (3,)) for a desired one (surge N, sway N, yaw N·m)."""
        wanted = np.asarray(force, dtype=np.float64)
        thrusts, free = np.zeros(len(self.low)), np.ones(len(self.low), dtype=bool)
        while free.any():
            missing = wanted - self.matrix[:, ~free] @ thrusts[~free]
            thrusts[free] = np.linalg.pinv(self.matrix[:, free], _RANK) @ missing
            beyond = free & ((thrusts < self.low) | (thrusts > self.high))
            thrusts = np.clip(thrusts, self.low, self.high)
            if not beyond.any():
                break
            free &= ~beyond
        return thrusts, self.matrix @ thrusts

    def step(self, surge_force: float, yaw: float) -> tuple[float, ...]:
        """The thrusts (N) without a sway force, then the achieved surge force and yaw moment; for `pilot.Pilot`."""
        thrusts, (surge, _, moment) = self.allocate((surge_force, 0.0, yaw))
        return (*thrusts.tolist(), float(surge), float(moment))
