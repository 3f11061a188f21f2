"""A small motorboat with one steered outboard, the size of a test boat for autopilots: 2 m/s, turns of 25 °/s.

State x y ψ u v r (m, m, rad, m/s, m/s, rad/s), velocities through the water. Surge, sway and yaw are first-order
systems, with sideslip in a turn: T_u u̇ + u = U_max √n, T_v v̇ + v = −T_v u r, T_r ṙ + r = R s f, with the steering s
(−1 to 1) and the throttle n (0 to 1). The steering force depends on the propeller's slipstream and the boat's speed:
f = min(1, (u/U_max + √n)/2 + 0.1).
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np

from steerway.control.boats import Boat
from steerway.control.speed_pi import SpeedPIGains
from steerway.control.station import StationGains
from steerway.core.arrays import Floats
from steerway.core.checks import positive
from steerway.core.compiled import kernel
from steerway.core.kinematics import GroundMotion, in_body, over_ground
from steerway.core.settings import Positive
from steerway.vessels.vessel import (
    CURRENT_EAST,
    CURRENT_NORTH,
    FORCE_EAST,
    FORCE_NORTH,
    MOMENT,
    Actuator,
    CompiledVessel,
    VesselTable,
    checked_method,
    stepped,
    turning,
)

MASS, INERTIA = 20.0, 5.0
"""Mass (kg) and yaw inertia (kg·m²) with added mass, on which disturbing forces and moments act."""
SWAY_TIME = 0.5
"""T_v, s."""


class OutboardCommand(NamedTuple):
    """Steering (−1 to 1) and throttle (0 to 1), and the surge force (N) and steering that they achieve."""

    steering: float
    throttle: float
    surge_force: float
    yaw: float


@dataclass(frozen=True)
class Outboard:
    """One steered propeller, `max_force` N; the autopilot's output is the steering. The propeller does not reverse."""

    max_force: float

    def __post_init__(self) -> None:
        positive("outboard.max_force", self.max_force)

    def step(self, surge_force: float, yaw: float) -> OutboardCommand:
        """Commands for a surge force (N) and a steering."""
        force, steering = min(self.max_force, max(0.0, surge_force)), min(1.0, max(-1.0, yaw))
        return OutboardCommand(steering, force / self.max_force, force, steering)


@kernel
def _rates(state: Floats, steering: float, throttle: float, parameters: Floats, conditions: Floats) -> Floats:
    top, turn_rate, surge_time, yaw_time = parameters[0], parameters[1], parameters[2], parameters[3]
    heading, u, v, r = state[2], state[3], state[4], state[5]
    pushed = math.sqrt(min(1.0, max(0.0, throttle)))
    bite = min(1.0, 0.5 * (max(0.0, u) / top + pushed) + 0.1)
    ahead, abeam = in_body(conditions[FORCE_NORTH], conditions[FORCE_EAST], heading)
    north, east = over_ground(u, v, heading)
    out = np.empty(6)
    out[0], out[1], out[2] = north + conditions[CURRENT_NORTH], east + conditions[CURRENT_EAST], r
    out[3] = (top * pushed - u) / surge_time + ahead / MASS
    out[4] = -v / SWAY_TIME - u * r + abeam / MASS
    out[5] = (turn_rate * min(1.0, max(-1.0, steering)) * bite - r) / yaw_time + conditions[MOMENT] / INERTIA
    return out


@kernel
def _step(
    state: Floats,
    steering: float,
    throttle: float,
    parameters: Floats,
    conditions: Floats,
    step: float,
    by_runge_kutta: bool,
) -> Floats:
    return stepped(_rates, state, step, (steering, throttle, parameters, conditions), by_runge_kutta)


@kernel
def _motion(state: Floats, _: Floats, conditions: Floats) -> GroundMotion:
    return turning(state[0], state[1], state[2], state[5], state[3], state[4], conditions)


class Motorboat(CompiledVessel):
    """A motorboat for closed-loop simulation. Command: steering, throttle. State (6,): see the module.

    top_speed U_max m/s, turn_rate R rad/s, surge_time T_u and yaw_time T_r in s.
    """

    actuators = (Actuator("steering", -1.0, 1.0), Actuator("throttle", 0.0, 1.0))
    size = 6
    kernels = _step, _motion

    def __init__(
        self,
        top_speed: float = 2.0,
        turn_rate: float = math.radians(25.0),
        surge_time: float = 2.0,
        yaw_time: float = 0.6,
        method: str = "rk4",
    ):
        given = {"top_speed": top_speed, "turn_rate": turn_rate, "surge_time": surge_time, "yaw_time": yaw_time}
        self._constants = (np.array([positive(f"motorboat.{name}", value) for name, value in given.items()]),)
        self._options = (checked_method(method),)


class MotorboatTable(VesselTable):
    """A motorboat with one steered outboard."""

    kind: Literal["motorboat"] = "motorboat"
    top_speed: Annotated[Positive, "m/s"] = 2.0
    """Speed through the water at full throttle."""
    turn_rate_deg: Positive = 25.0
    """Yaw rate at full steering and full throttle."""
    surge_time: Annotated[Positive, "s"] = 2.0
    """Time constant of the speed."""
    yaw_time: Annotated[Positive, "s"] = 0.6
    """Time constant of the yaw rate."""
    reference: ClassVar[str] = "model"

    def build(self) -> Motorboat:
        rate = math.radians(self.turn_rate_deg)
        return Motorboat(self.top_speed, rate, self.surge_time, self.yaw_time, self.method)

    def boat(self) -> Boat:
        """The autopilot's output is the steering; full throttle corresponds to the force MASS U_max/T_u."""
        drag = MASS / self.surge_time
        force = drag * self.top_speed
        return Boat(
            nomoto_gain=math.radians(self.turn_rate_deg),
            nomoto_time=self.yaw_time,
            yaw_limit=1.0,
            bandwidth=1.0 / max(self.yaw_time, 1.0),
            propulsion=Outboard(force),
            lookahead=6.0 * self.top_speed,
            acceptance=2.0 * self.top_speed,
            cruise=0.75 * self.top_speed,
            top_speed=self.top_speed,
            turn_rate=0.8 * math.radians(self.turn_rate_deg),
            profile="small-usv",
            speed=SpeedPIGains(mass=MASS, linear_drag=drag, bandwidth=0.4, limit=force, acceleration=0.3),
            station=StationGains(mass=MASS, limit=force, limit_astern=0.0, least_force=0.1 * force),
        )


BOAT = MotorboatTable().boat()
"""The boat with the default keys."""
