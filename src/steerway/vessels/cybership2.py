"""CyberShip II: a 1:70 model of a supply vessel, 1.255 m and 23.8 kg, driven by forces in surge, sway and yaw.

There are two identifications. "linear" is for dynamic positioning: P2 Tables I and II, with linear damping and without
Coriolis forces. Its x_g is 0.0425 m, as P2's gains and the vessel's public simulator imply; Table I prints 0.046 m.
"nonlinear": R. Skjetne, T. I. Fossen and P. V. Kokotović (2005), Adaptive maneuvering, with experiments, for a model
ship in a marine control laboratory, Automatica 41(2).

State N E ψ u v r: position in m, heading in rad, surge and sway through the water in m/s, yaw rate in rad/s.
"""

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from steerway.control.allocation import Thrusters
from steerway.control.boats import Boat
from steerway.core.arrays import Floats
from steerway.core.checks import one_of
from steerway.core.compiled import kernel
from steerway.core.kinematics import GroundMotion, in_body, over_ground
from steerway.vessels.low_speed import low_speed_boat
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

LENGTH = 1.255
MASS, YAW_INERTIA = 23.8, 1.76
_SURGE_MASS, _SWAY_MASS, _YAW_MASS = MASS + 2.0, MASS + 10.0, YAW_INERTIA + 1.0  # with added mass
_LINEAR_ARM, _NONLINEAR_ARM = MASS * 0.0425, MASS * 0.046  # m x_g; Y_ṙ = N_v̇ = 0

INERTIA = np.array([[_SURGE_MASS, 0.0, 0.0], [0.0, _SWAY_MASS, _LINEAR_ARM], [0.0, _LINEAR_ARM, _YAW_MASS]])
"""M of P2 (28)."""
DAMPING = np.array([[2.0, 0.0, 0.0], [0.0, 7.0, 0.1], [0.0, 0.1, 0.5]])
"""D of P2 (29)."""

THRUST = (
    Actuator("surge force", -2.0, 2.0),
    Actuator("sway force", -1.5, 1.5),
    Actuator("yaw moment", -1.5, 1.5),
)
"""Limits of propellers, rudders and bow thruster together: N, N, N·m."""
_LIMITS = np.array([each.high for each in THRUST])

_CRUISE = 0.6
"""Cruise speed, m/s; Froude number 0.17."""

IDENTIFICATIONS = ("linear", "nonlinear")


def derivatives(
    state: ArrayLike, force: ArrayLike, identification: str = "linear", conditions: ArrayLike | None = None
) -> np.ndarray:
    """Time derivative (6,) of the state (6,) under an unlimited generalized force (surge N, sway N, yaw N·m).

    P2 (1)–(2), with the environment's force given in NED and rotated to the body frame. `conditions`: see `vessel`.
    """
    weather = np.zeros(5) if conditions is None else np.asarray(conditions, dtype=np.float64)
    return _rates(np.asarray(state, float), np.asarray(force, float), identification == "nonlinear", weather)


@kernel
def _linear_damping(u: float, v: float, r: float) -> tuple[float, float, float]:
    return 2.0 * u, 7.0 * v + 0.1 * r, 0.1 * v + 0.5 * r


@kernel
def _nonlinear_damping(u: float, v: float, r: float) -> tuple[float, float, float]:
    """Damping and Coriolis forces, D(ν) ν + C(ν) ν."""
    x = u * (0.72253 + 1.32742 * abs(u) + 5.86643 * u * u)
    y = v * (0.88965 + 36.47287 * abs(v) + 0.805 * abs(r)) + r * (7.25 + 0.845 * abs(v) + 3.45 * abs(r))
    n = -v * (0.0313 + 3.95645 * abs(v) + 0.13 * abs(r)) + r * (1.9 - 0.08 * abs(v) + 0.75 * abs(r))
    across, along = _SWAY_MASS * v + _NONLINEAR_ARM * r, _SURGE_MASS * u
    return x - across * r, y + along * r, n + across * u - along * v


@kernel
def _rates(state: Floats, force: Floats, nonlinear: bool, conditions: Floats) -> Floats:
    heading, u, v, r = state[2], state[3], state[4], state[5]
    x, y = in_body(conditions[FORCE_NORTH], conditions[FORCE_EAST], heading)
    x, y, n = x + force[0], y + force[1], conditions[MOMENT] + force[2]
    drag_x, drag_y, drag_n = _nonlinear_damping(u, v, r) if nonlinear else _linear_damping(u, v, r)
    x, y, n = x - drag_x, y - drag_y, n - drag_n
    arm = _NONLINEAR_ARM if nonlinear else _LINEAR_ARM
    determinant = _SWAY_MASS * _YAW_MASS - arm * arm
    north, east = over_ground(u, v, heading)
    out = np.empty(6)
    out[0] = north + conditions[CURRENT_NORTH]
    out[1] = east + conditions[CURRENT_EAST]
    out[2] = r
    out[3] = x / _SURGE_MASS
    out[4] = (_YAW_MASS * y - arm * n) / determinant
    out[5] = (_SWAY_MASS * n - arm * y) / determinant
    return out


@kernel
def _step(
    state: Floats,
    surge: float,
    sway: float,
    yaw: float,
    nonlinear: bool,
    conditions: Floats,
    step: float,
    by_runge_kutta: bool,
) -> Floats:
    force = np.minimum(np.maximum(np.array([surge, sway, yaw]), -_LIMITS), _LIMITS)
    return stepped(_rates, state, step, (force, nonlinear, conditions), by_runge_kutta)


@kernel
def _motion(state: Floats, nonlinear: bool, conditions: Floats) -> GroundMotion:
    return moving(_rates, state, (np.zeros(3), nonlinear, conditions), 0, 2, (state[3], state[4]))


class CyberShip2(CompiledVessel):
    """CyberShip II for closed-loop simulation. Command: (surge force N, sway force N, yaw moment N·m), limited.

    `identification` is "linear" or "nonlinear", see the module. Velocities are through the water; a current adds to
    them over ground. Raises InputError for another identification and an unknown method.
    """

    actuators = THRUST
    size = 6
    kernels = _step, _motion

    def __init__(self, identification: str = "linear", method: str = "rk4"):
        self._constants = (one_of("cybership2.identification", identification, IDENTIFICATIONS) == "nonlinear",)
        self._options = (checked_method(method),)


class CyberShip2Table(VesselTable):
    """The model ship CyberShip II of P2."""

    kind: Literal["cybership2"] = "cybership2"
    length: ClassVar[float] = LENGTH
    identification: Literal["linear", "nonlinear"] = "linear"
    """Linear damping, as in P2, or the nonlinear model from manoeuvring experiments."""

    def positioned(self) -> Positioned:
        """M and D of P2; each of the three forces counts as a thruster."""
        return Positioned(INERTIA, DAMPING, Thrusters(np.eye(3), [each.low for each in THRUST], _LIMITS))

    def build(self) -> CyberShip2:
        return CyberShip2(self.identification, self.method)

    def boat(self) -> Boat:
        return low_speed_boat(self.positioned(), _CRUISE)
