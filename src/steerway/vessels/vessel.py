"""The interface of vessels: actuators, environmental conditions, and the declaration for scenarios.

A vessel object has parameters only; its state is an array kept by the simulation loop, so that a run can be stored,
resumed and repeated. Anything with the three methods of `Vessel` can be simulated: see docs/vessels.md.
"""

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np

from steerway.control.allocation import Thrusters
from steerway.control.boats import Boat
from steerway.core.arrays import Floats
from steerway.core.checks import one_of
from steerway.core.compiled import jitable
from steerway.core.errors import InputError
from steerway.core.kinematics import SHORTLY, GroundMotion, over_ground, turning_rate
from steerway.core.settings import Table

CURRENT_NORTH, CURRENT_EAST, FORCE_NORTH, FORCE_EAST, MOMENT = range(5)
"""Indices of the conditions: current (m/s), force of the environment (N), its yaw moment (N·m); NED."""


@dataclass(frozen=True)
class Actuator:
    """One actuator: commands from `low` to `high`, first-order `lag` in s, change of at most `rate` per second."""

    name: str
    low: float
    high: float
    rate: float = math.inf
    lag: float = 0.0


class Vessel(Protocol):
    """A vessel that the simulation loop can step."""

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """One for each entry of a command."""

    def start(self, north: float, east: float, heading: float, speed: float) -> np.ndarray:
        """The state (n,) of a vessel that moves at `speed` through the water along `heading`."""

    def step(self, state: np.ndarray, command: Sequence[float], conditions: np.ndarray, step: float) -> np.ndarray:
        """The state (n,) after `step` s of one command, one number per actuator, in the conditions (5,)."""

    def motion(self, state: np.ndarray, conditions: np.ndarray) -> GroundMotion:
        """Position and motion over ground."""


def conditions(
    current: tuple[float, float] = (0.0, 0.0), force: tuple[float, float] = (0.0, 0.0), moment: float = 0.0
) -> np.ndarray:
    """The (5,) conditions of a current, a force (north, east) and a moment in yaw."""
    return np.array([*current, *force, moment], dtype=np.float64)


CALM = conditions()
CALM.flags.writeable = False


def check_shapes(state: Floats, size: int, conditions: Floats = CALM) -> None:
    """Raise InputError unless `state` is an array (size,) and `conditions` (5,): kernels do not check indices."""
    if getattr(state, "shape", None) == (size,) and getattr(conditions, "shape", None) == (5,):
        return  # the fast path, taken at every step
    for name, values, expected in (("state", state, size), ("conditions", conditions, 5)):
        if getattr(values, "shape", None) != (expected,):
            raise InputError(f"{name} has shape {np.shape(values)}, expected ({expected},)")


METHODS = ("rk4", "euler")


def checked_method(method: str) -> bool:
    """True for Runge and Kutta's method, False for Euler's; raises InputError for another name."""
    return one_of("vessel.method", method, METHODS) == "rk4"


@jitable
def runge_kutta(rates: Callable[..., Floats], state: Floats, step: float, inputs: tuple[Any, ...] = ()) -> Floats:
    """One step of Runge and Kutta's fourth-order method for ẋ = rates(x, *inputs), in kernels and in plain Python."""
    k1 = rates(state, *inputs)
    k2 = rates(state + 0.5 * step * k1, *inputs)
    k3 = rates(state + 0.5 * step * k2, *inputs)
    k4 = rates(state + step * k3, *inputs)
    return state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@jitable
def stepped(
    rates: Callable[..., Floats], state: Floats, step: float, inputs: tuple[Any, ...], by_runge_kutta: bool
) -> Floats:
    """One step for ẋ = rates(x, *inputs), by Runge and Kutta's method or by Euler's."""
    if by_runge_kutta:
        return runge_kutta(rates, state, step, inputs)
    return state + step * rates(state, *inputs)


@jitable
def moving(
    rates: Callable[..., Floats],
    state: Floats,
    inputs: tuple[Any, ...],
    place: int,
    heading: int,
    through_water: tuple[float, float],
    lean: tuple[float, float] = (0.0, 0.0),
    shaft: float = math.nan,
) -> GroundMotion:
    """Motion for ẋ = rates(x, *inputs); `place` is the index of north in the state, the next index is east.

    heading: its index. through_water: surge and sway, m/s. lean: roll and pitch, rad. shaft: rev/s.
    """
    now = rates(state, *inputs)
    before = rates(state - SHORTLY * now, *inputs)
    after = rates(state + SHORTLY * now, *inputs)
    acceleration = (after - before) / (2.0 * SHORTLY)
    north, east = now[place], now[place + 1]
    course_rate = turning_rate(north, east, acceleration[place], acceleration[place + 1])
    velocity = north, east, now[heading], course_rate
    return GroundMotion(state[place], state[place + 1], state[heading], *velocity, *through_water, *lean, shaft)


@jitable
def turning(
    north: float, east: float, heading: float, yaw_rate: float, surge: float, sway: float, conditions: Floats
) -> GroundMotion:
    """Motion of a boat at a position (m) whose velocity through the water (m/s) is constant in the body frame."""
    ahead, aside = over_ground(surge, sway, heading)
    velocity = ahead + conditions[CURRENT_NORTH], aside + conditions[CURRENT_EAST]
    course_rate = turning_rate(*velocity, -aside * yaw_rate, ahead * yaw_rate)
    return GroundMotion(north, east, heading, *velocity, yaw_rate, course_rate, surge, sway, 0.0, 0.0)


class CompiledVessel:
    """A vessel defined by two `kernels`: one for a step, one for the motion.

    Both are called with the state (`size`,), the `_constants` and the conditions. For a step, the command follows the
    state, and the step length and `_options` come last. For a vessel with a choice of method, `_options` is (True,) for
    Runge and Kutta's, (False,) for Euler's.
    """

    actuators: tuple[Actuator, ...]
    size: ClassVar[int]
    kernels: ClassVar[tuple[Callable[..., Any], Callable[..., Any]]]
    _constants: tuple[Any, ...]
    _options: tuple[bool, ...] = ()

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {', '.join(each.name for each in self.actuators)}"

    def start(self, north: float = 0.0, east: float = 0.0, heading: float = 0.0, speed: float = 0.0) -> np.ndarray:
        """The state (n,) on a straight course at `speed` through the water."""
        state = np.zeros(self.size)
        state[:4] = north, east, heading, speed
        return state

    def step(self, state: Floats, command: Sequence[Any], conditions: Floats, step: float) -> np.ndarray:
        """The state (n,) after `step` s of one command, in the conditions (5,)."""
        check_shapes(state, self.size, conditions)
        return self.kernels[0](state, *command, *self._constants, conditions, step, *self._options)

    def motion(self, state: Floats, conditions: Floats) -> GroundMotion:
        """Position and motion over ground, in the conditions (5,)."""
        check_shapes(state, self.size, conditions)
        return self.kernels[1](state, *self._constants, conditions)


def check_speed(kind: str, speed: float | None, own: float) -> None:
    """Raise InputError if a vessel of constant speed would start at another speed."""
    if speed is not None and speed != own:
        raise InputError(f"{kind}: start at {speed} m/s, expected its constant speed of {own} m/s")


class Positioned(NamedTuple):
    """Parameters for dynamic positioning: M and D (3, 3) of P2 (2), and the thrust allocation."""

    inertia: Any
    damping: Any
    thrusters: Thrusters


class VesselTable(Table):
    """The table [vessel] of a scenario. A vessel adds its `kind` (a Literal with itself as default) and its keys.

    `reference` is the kind of the default reference filter; see `core.reference`. `length` in m, NaN if unknown.
    """

    method: Literal["rk4", "euler"] = "rk4"
    """Integration by Runge and Kutta's fourth-order method or by Euler's."""
    reference: ClassVar[str] = "low-pass"
    length: ClassVar[float] = math.nan

    @abstractmethod
    def build(self) -> Vessel:
        """The vessel. Raises InputError for contradictory numbers."""

    @abstractmethod
    def boat(self) -> Boat:
        """Parameters and default gains for the controllers."""

    def positioned(self) -> Positioned | None:
        """Parameters for dynamic positioning; None for a vessel without force in one of surge, sway and yaw."""
        return None

    def boat_in_current(self) -> Boat:
        """As `boat`, for the steering filter, which needs an accurate yaw response."""
        return self.boat()
