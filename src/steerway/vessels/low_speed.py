"""A low-speed vessel with the matrices M and D and any number of thrusters: M ν̇ + D ν = B f + Rᵀ(ψ) b; P2 (1)–(2).

State N E ψ u v r, as in `cybership2`. Velocities are through the water; a current adds to them over ground.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from steerway.control.allocation import Thrusters, thruster_matrix
from steerway.control.boats import Boat
from steerway.control.speed_pi import SpeedPIGains
from steerway.core.arrays import Floats
from steerway.core.checks import array_of
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.kinematics import GroundMotion, in_body, over_ground
from steerway.core.settings import NotNegative, Number, Positive, Table, Triple
from steerway.vessels.vessel import (
    CURRENT_EAST,
    CURRENT_NORTH,
    FORCE_EAST,
    FORCE_NORTH,
    MOMENT,
    Actuator,
    CompiledVessel,
    Positioned,
    VesselTable,
    checked_method,
    moving,
    stepped,
)


@kernel
def _rates(state: Floats, force: Floats, inverse: Floats, damping: Floats, conditions: Floats) -> Floats:
    heading, velocity = state[2], state[3:6]
    x, y = in_body(conditions[FORCE_NORTH], conditions[FORCE_EAST], heading)
    push = np.array([x + force[0], y + force[1], conditions[MOMENT] + force[2]])
    for i in range(3):
        push[i] -= damping[i, 0] * velocity[0] + damping[i, 1] * velocity[1] + damping[i, 2] * velocity[2]
    north, east = over_ground(velocity[0], velocity[1], heading)
    out = np.empty(6)
    out[0] = north + conditions[CURRENT_NORTH]
    out[1] = east + conditions[CURRENT_EAST]
    out[2] = velocity[2]
    for i in range(3):
        out[3 + i] = inverse[i, 0] * push[0] + inverse[i, 1] * push[1] + inverse[i, 2] * push[2]
    return out


@kernel
def _step(
    state: Floats,
    force: Floats,
    inverse: Floats,
    damping: Floats,
    conditions: Floats,
    step: float,
    by_runge_kutta: bool,
) -> Floats:
    return stepped(_rates, state, step, (force, inverse, damping, conditions), by_runge_kutta)


@kernel
def _motion(state: Floats, inverse: Floats, damping: Floats, conditions: Floats) -> GroundMotion:
    return moving(_rates, state, (np.zeros(3), inverse, damping, conditions), 0, 2, (state[3], state[4]))


class LowSpeedVessel(CompiledVessel):
    """The vessel for closed-loop simulation. Command: a thrust (N) for each thruster.

    Raises InputError for matrices that are not (3, 3), and unless M + Mᵀ and D + Dᵀ are positive definite.
    """

    size = 6
    kernels = _step, _motion

    def __init__(self, inertia: ArrayLike, damping: ArrayLike, thrusters: Thrusters, method: str = "rk4"):
        inertia, damping = array_of("inertia", inertia, (3, 3)), array_of("damping", damping, (3, 3))
        for name, matrix in (("inertia", inertia), ("damping", damping)):
            if not np.linalg.eigvalsh(matrix + matrix.T).min() > 0.0:
                raise InputError(f"vessel.{name} is {matrix.tolist()}, expected a positive definite matrix")
        ends = zip(thrusters.low.tolist(), thrusters.high.tolist(), strict=True)
        self.actuators = tuple(Actuator(f"thruster {k}", low, high) for k, (low, high) in enumerate(ends, 1))
        self._thrusters = thrusters
        self._constants = np.ascontiguousarray(np.linalg.inv(inertia)), np.ascontiguousarray(damping)
        self._options = (checked_method(method),)

    def step(self, state: Floats, command: Sequence[float], conditions: Floats, step: float) -> np.ndarray:
        limits = self._thrusters
        force = limits.matrix @ np.clip(np.asarray(command, dtype=np.float64), limits.low, limits.high)
        return super().step(state, (force,), conditions, step)


_FASTEST = 0.35
"""Largest heading bandwidth, rad/s. The course estimate at 0.8 m/s, from fixes of 0.15 m at 5 Hz, allows 0.7 rad/s."""
_MOST = 1e12
"""A force (N) or moment (N·m) that exceeds what any thrusters give."""


def low_speed_boat(positioned: Positioned, cruise: float) -> Boat:
    """Parameters for steering along a route, in surge and yaw: K = 1/D_33 and T = M_33/D_33.

    The bandwidth is 1/T, limited to what the course estimate allows, but never less than half of 1/T.
    """
    inertia, damping, thrusters = positioned
    *_, ahead, _ = thrusters.step(_MOST, 0.0)
    *_, moment = thrusters.step(0.0, _MOST)
    time = inertia[2][2] / damping[2][2]
    return Boat(
        nomoto_gain=1.0 / damping[2][2],
        nomoto_time=time,
        yaw_limit=moment,
        bandwidth=max(min(1.0 / time, _FASTEST), 0.5 / time),
        propulsion=thrusters,
        lookahead=10.0 * cruise * time,
        acceptance=2.0 * cruise * time,
        cruise=cruise,
        top_speed=ahead / damping[0][0],
        profile="small-usv",
        speed=SpeedPIGains(
            inertia[0][0],
            damping[0][0],
            bandwidth=damping[0][0] / inertia[0][0],
            limit=ahead,
            acceleration=0.1 * cruise,
        ),
    )


class ThrusterTable(Table):
    """A fixed thruster."""

    ahead: Annotated[Number, "m"] = 0.0
    """Position ahead of the vessel's origin."""
    starboard: Annotated[Number, "m"] = 0.0
    """Position to starboard of the vessel's origin."""
    angle_deg: Number = 0.0
    """Direction of the thrust from the bow, positive to starboard."""
    limit: Annotated[Positive, "N"]
    """Largest thrust."""
    limit_astern: Annotated[NotNegative | None, "N"] = None
    """Largest thrust in the opposite direction; by default `limit`."""


class LowSpeedTable(VesselTable):
    """A vessel at low speed: inertia M (kg, kg·m, kg·m²), damping D (the same per second) and fixed thrusters."""

    kind: Literal["low-speed"] = "low-speed"
    inertia: Annotated[tuple[Triple, Triple, Triple], "kg, kg·m, kg·m²"] = (
        (85.0, 0.0, 0.0),
        (0.0, 165.0, 10.0),
        (0.0, 10.0, 40.0),
    )
    """Mass matrix M in surge, sway and yaw, with added mass."""
    damping: Annotated[tuple[Triple, Triple, Triple], "kg/s, kg·m/s, kg·m²/s"] = (
        (80.0, 0.0, 0.0),
        (0.0, 160.0, 0.0),
        (0.0, 0.0, 25.0),
    )
    """Linear damping matrix D in surge, sway and yaw."""
    thrusters: Annotated[tuple[ThrusterTable, ...], Field(min_length=1)] = (
        ThrusterTable(ahead=-0.8, starboard=-0.4, limit=100.0),
        ThrusterTable(ahead=-0.8, starboard=0.4, limit=100.0),
        ThrusterTable(ahead=0.8, angle_deg=90.0, limit=50.0),
        ThrusterTable(ahead=-0.8, angle_deg=90.0, limit=50.0),
    )
    """Fixed thrusters."""
    cruise: Annotated[Positive, "m/s"] = 0.8
    """Cruise speed."""

    def positioned(self) -> Positioned:
        """M, D and the thrusters."""
        places = [(each.ahead, each.starboard, math.radians(each.angle_deg)) for each in self.thrusters]
        low = [-(each.limit if each.limit_astern is None else each.limit_astern) for each in self.thrusters]
        thrusters = Thrusters(thruster_matrix(places), low, [each.limit for each in self.thrusters])
        return Positioned(self.inertia, self.damping, thrusters)

    def build(self) -> LowSpeedVessel:
        return LowSpeedVessel(*self.positioned(), self.method)

    def boat(self) -> Boat:
        return low_speed_boat(self.positioned(), self.cruise)
