"""The interface between loop and vessel: actuators, environmental conditions, and the declaration for scenarios.

A vessel object has parameters only; its state is an array kept by the loop, so that a run can be stored, resumed and
repeated. Anything with the three methods of `Vessel` can be simulated: see docs/vessels.md.
"""

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np

from steerway.control.boats import Boat
from steerway.control.thrusters import Thrusters
from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.core.kinematics import GroundMotion
from steerway.core.settings import Table

CURRENT_NORTH, CURRENT_EAST, FORCE_NORTH, FORCE_EAST, MOMENT = range(5)
"""Places in the conditions: current (m/s), forces besides the actuators' (N), their moment in yaw (N·m); NED."""


class Actuated:
    """A vessel, whose representation names its actuators."""

    actuators: tuple["Actuator", ...]

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {', '.join(each.name for each in self.actuators)}"


@dataclass(frozen=True)
class Actuator:
    """One actuator: it takes commands from `low` to `high` and follows with `lag` s, at most `rate` a second."""

    name: str
    low: float
    high: float
    rate: float = math.inf
    lag: float = 0.0


class Vessel(Protocol):
    """A vessel that the loop can step."""

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """One for each entry of a command."""

    def start(self, north: float, east: float, heading: float, speed: float) -> np.ndarray:
        """The state (n,) of a vessel that makes `speed` through the water along `heading`."""

    def step(self, state: np.ndarray, command: Sequence[float], conditions: np.ndarray, step: float) -> np.ndarray:
        """The state (n,) after `step` s of one command, a float an actuator, in the conditions (5,)."""

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
    """Raises InputError unless `state` is an array (size,) and `conditions` (5,): kernels do not check indices."""
    if getattr(state, "shape", None) == (size,) and getattr(conditions, "shape", None) == (5,):
        return  # on every step of every run
    for name, values, expected in (("state", state, size), ("conditions", conditions, 5)):
        if getattr(values, "shape", None) != (expected,):
            raise InputError(f"{name} has shape {np.shape(values)}, expected ({expected},)")


METHODS = ("rk4", "euler")


def checked_method(method: str) -> bool:
    """True for Runge and Kutta's method, False for Euler's; raises InputError for another name."""
    if method not in METHODS:
        raise InputError(f"vessel.method is {method!r}, expected one of {', '.join(METHODS)}")
    return method == "rk4"


def runge_kutta(rates: Callable[[Floats], Floats], state: Floats, step: float) -> Floats:
    """One step of Runge and Kutta's fourth-order method for ẋ = rates(x), in plain Python."""
    k1 = rates(state)
    k2 = rates(state + 0.5 * step * k1)
    k3 = rates(state + 0.5 * step * k2)
    k4 = rates(state + step * k3)
    return state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def euler(rates: Callable[[Floats], Floats], state: Floats, step: float) -> Floats:
    """One step of Euler's method for ẋ = rates(x)."""
    return state + step * rates(state)


class Positioned(NamedTuple):
    """What dynamic positioning uses of a vessel: M and D (3, 3) of P2 (2), and the allocation to its thrusters."""

    inertia: Any
    damping: Any
    thrusters: Thrusters


class VesselTable(Table):
    """The table [vessel] of a scenario. A vessel adds its `kind` (a Literal with itself as default) and its keys.

    `reference` is the kind of reference filter used where the scenario names none; see `guidance.reference`. `length`
    in m, NaN where it is not known.
    """

    method: Literal["rk4", "euler"] = "rk4"
    reference: ClassVar[str] = "low-pass"
    length: ClassVar[float] = math.nan

    @abstractmethod
    def build(self) -> Vessel:
        """The vessel. Raises InputError for numbers that exclude each other."""

    @abstractmethod
    def boat(self) -> Boat:
        """The numbers and default gains its controllers use."""

    def positioned(self) -> Positioned | None:
        """What dynamic positioning uses, None for a vessel that is not moved in every direction."""
        return None

    def boat_in_current(self) -> Boat:
        """The same for steering by an estimator that knows the orders, whose response to them has to fit well."""
        return self.boat()
