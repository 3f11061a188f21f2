"""The Otter in six degrees of freedom, with two propellers.

Newton–Euler equations about the centre of gravity for the rigid body, Kirchhoff's equations for added mass, damping,
cross-flow drag by strip theory, buoyancy. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed.
(2021): FH below; particulars and editions in `otter_hull`.

State u v w p q r x y z φ θ ψ (m/s and rad/s in the body frame, m in NED, rad), followed in the closed loop by the two
propeller speeds (rad/s).
"""

import math
from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from steerway.control.allocation import OTTER_PROPELLERS
from steerway.control.allocation import thrust as propeller_thrust
from steerway.control.boats import Boat
from steerway.control.course import YawResponse
from steerway.control.speed_pi import SpeedPIGains
from steerway.control.station import StationGains
from steerway.core.arrays import Floats
from steerway.core.checks import not_negative
from steerway.core.compiled import kernel
from steerway.core.kinematics import GroundMotion, in_body
from steerway.core.settings import NotNegative, Triple
from steerway.vessels.otter_hull import (
    ADDED,
    CENTRE,
    CENTRE_OF_FLOTATION,
    CURRENT_TURNS,
    DAMPING,
    INERTIA,
    INVERSE,
    LENGTH,
    MUNK,
    PAYLOAD,
    PONTOON_ARM,
    PROPELLER_GAIN_AHEAD,
    PROPELLER_GAIN_ASTERN,
    PROPELLER_MAX,
    PROPELLER_MIN,
    SIDE_DRAG,
    STIFFNESS,
    STRIPS,
    TOTAL_MASS,
    TRIM_MOMENT,
    VERTICAL_DRAG,
    WEIGHT,
    loaded,
)
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
    conditions,
    moving,
    stepped,
)

_STATION = LENGTH / (STRIPS - 1)


def derivatives(
    state: ArrayLike,
    propeller_speeds: Sequence[float],
    payload_mass: float = 0.0,
    payload_position: Sequence[float] = (0.0, 0.0, 0.0),
    current_speed: float = 0.0,
    current_direction: float = 0.0,
    edition: str = "today",
) -> np.ndarray:
    """Time derivative (12,) of the state (12,) u v w p q r x y z φ θ ψ.

    `propeller_speeds` left and right, rad/s, saturate at the limits of `Otter.actuators`; `payload_mass` 0 to 45 kg at
    `payload_position` (forward, starboard, down) m; the current flows at `current_speed` m/s towards
    `current_direction` rad from true north. Editions: see `otter_hull`. Source: FH (3.42), (6.1), (6.61), (6.86).

    Raises InputError for a payload beyond the limit and an unknown edition.
    """
    out, (left, right) = np.empty(12), propeller_speeds
    current = current_speed * math.cos(current_direction), current_speed * math.sin(current_direction)
    hull = loaded(payload_mass, payload_position, edition)
    _rates(np.asarray(state, dtype=np.float64), left, right, hull, conditions(current), out)
    return out


@kernel
def thrust(speed: float) -> float:
    """Thrust (N) of one propeller at `speed` rad/s, saturated."""
    return propeller_thrust(min(max(speed, PROPELLER_MIN), PROPELLER_MAX), PROPELLER_GAIN_AHEAD, PROPELLER_GAIN_ASTERN)


@kernel
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@kernel
def _inertial_forces(
    hull: Floats, u: float, v: float, w: float, p: float, q: float, r: float
) -> tuple[float, float, float, float, float, float]:
    """−C(ν)ν, rigid body (FH 3.59) and added mass (FH 6.44), from velocities through the water: X Y Z K M N."""
    gx, gy, gz = hull[CENTRE], hull[CENTRE + 1], hull[CENTRE + 2]
    mass = hull[TOTAL_MASS]
    ax, ay, az = _cross(p, q, r, gx, gy, gz)
    fx, fy, fz = _cross(p, q, r, mass * (u + ax), mass * (v + ay), mass * (w + az))
    tx, ty, tz = _cross(gx, gy, gz, fx, fy, fz)
    hx = hull[INERTIA] * p + hull[INERTIA + 1] * q + hull[INERTIA + 2] * r
    hy = hull[INERTIA + 3] * p + hull[INERTIA + 4] * q + hull[INERTIA + 5] * r
    hz = hull[INERTIA + 6] * p + hull[INERTIA + 7] * q + hull[INERTIA + 8] * r
    sx, sy, sz = _cross(p, q, r, hx, hy, hz)
    mx, my, mz = hull[ADDED] * u, hull[ADDED + 1] * v, hull[ADDED + 2] * w
    cx, cy, cz = _cross(p, q, r, mx, my, mz)
    ex, ey, ez = _cross(p, q, r, hull[ADDED + 3] * p, hull[ADDED + 4] * q, hull[ADDED + 5] * r)
    kx, ky, kz = _cross(u, v, w, mx, my, mz)
    return (
        -(fx + cx),
        -(fy + cy),
        -(fz + cz),
        -(tx + sx + ex + kx),
        -(ty + sy + ey + ky),
        -(tz + sz + ez + kz * hull[MUNK]),
    )


@kernel
def _cross_flow(v: float, w: float, q: float, r: float) -> tuple[float, float, float, float]:
    """Sums over the strips of |v + x r|(v + x r) and x times it, and of the same for w + x q; FH (6.91)–(6.92)."""
    side, turn, heave, pitch = 0.0, 0.0, 0.0, 0.0
    for i in range(STRIPS):
        x = i * _STATION - 0.5 * LENGTH
        across, down = v + x * r, w + x * q
        across *= abs(across)
        down *= abs(down)
        side += across
        turn += x * across
        heave += down
        pitch += x * down
    return side, turn, heave, pitch


@kernel
def _rates(state: Floats, left: float, right: float, hull: Floats, conditions: Floats, out: Floats) -> None:
    """Write the 12 rates of the state into `out`."""
    u, v, w, p, q, r = state[0], state[1], state[2], state[3], state[4], state[5]
    z, phi, theta, psi = state[8], state[9], state[10], state[11]
    current_u, current_v = in_body(conditions[CURRENT_NORTH], conditions[CURRENT_EAST], psi)
    force_u, force_v = in_body(conditions[FORCE_NORTH], conditions[FORCE_EAST], psi)
    ur, vr = u - current_u, v - current_v
    fx, fy, fz, tx, ty, tz = _inertial_forces(hull, ur, vr, w, p, q, r)
    side, turn, heave, pitch = _cross_flow(vr, w, q, r)

    # The payload's weight; its vertical part and moments shift the equilibrium (FH 4.2), the rest is left out.
    c_phi, s_phi, c_theta, s_theta = math.cos(phi), math.sin(phi), math.cos(theta), math.sin(theta)
    weight = hull[WEIGHT]
    wx, wy, wz = -weight * s_theta, weight * c_theta * s_phi, weight * c_theta * c_phi
    lx, ly, _ = _cross(hull[PAYLOAD], hull[PAYLOAD + 1], hull[PAYLOAD + 2], wx, wy, wz)
    sunk = z - CENTRE_OF_FLOTATION * theta
    buoyancy = -hull[STIFFNESS] * sunk

    port, starboard = thrust(left), thrust(right)
    d = DAMPING
    fx += port + starboard + force_u - hull[d] * ur
    fy += force_v - hull[d + 1] * vr - hull[SIDE_DRAG] * side
    fz += buoyancy + wz - hull[d + 2] * w - hull[VERTICAL_DRAG] * heave
    tx += lx - hull[STIFFNESS + 1] * phi - hull[d + 3] * p
    ty += ly - hull[STIFFNESS + 2] * theta - CENTRE_OF_FLOTATION * buoyancy - hull[d + 4] * q
    ty -= hull[VERTICAL_DRAG] * pitch + hull[TRIM_MOMENT]
    tz += PONTOON_ARM * (port - starboard) + conditions[MOMENT] - hull[SIDE_DRAG] * turn
    tz -= hull[d + 5] * (1.0 + 10.0 * abs(r)) * r

    for i in range(6):
        k = INVERSE + 6 * i
        out[i] = hull[k] * fx + hull[k + 1] * fy + hull[k + 2] * fz
        out[i] += hull[k + 3] * tx + hull[k + 4] * ty + hull[k + 5] * tz
    if hull[CURRENT_TURNS] != 0.0:
        out[0] += r * current_v
        out[1] -= r * current_u
        out[2] += q * current_u - p * current_v

    phi -= lx / hull[STIFFNESS + 1]
    theta -= (ly + CENTRE_OF_FLOTATION * wz) / hull[STIFFNESS + 2]
    out[6], out[7], out[8] = _to_ned(u, v, w, phi, theta, psi)
    tangent = (q * math.sin(phi) + r * math.cos(phi)) / math.cos(theta)
    out[9] = p + tangent * math.sin(theta)
    out[10] = q * math.cos(phi) - r * math.sin(phi)
    out[11] = tangent


@kernel
def _to_ned(u: float, v: float, w: float, phi: float, theta: float, psi: float) -> tuple[float, float, float]:
    """Body to NED by roll, pitch and yaw; FH (2.31)."""
    c, s = math.cos(phi), math.sin(phi)
    abeam, below = v * c - w * s, v * s + w * c
    ahead = u * math.cos(theta) + below * math.sin(theta)
    c, s = math.cos(psi), math.sin(psi)
    return ahead * c - abeam * s, ahead * s + abeam * c, below * math.cos(theta) - u * math.sin(theta)


@kernel
def _sailing_rates(state: Floats, left: float, right: float, lag: float, hull: Floats, conditions: Floats) -> Floats:
    """The 14 rates: those of the hull, and of the propellers towards their commands."""
    out = np.zeros(14)
    _rates(state, state[12], state[13], hull, conditions, out)
    if lag > 0.0:
        out[12] = (left - state[12]) / lag
        out[13] = (right - state[13]) / lag
    return out


@kernel
def _step(
    state: Floats,
    left: float,
    right: float,
    lag: float,
    hull: Floats,
    conditions: Floats,
    step: float,
    by_runge_kutta: bool,
) -> Floats:
    left = min(max(left, PROPELLER_MIN), PROPELLER_MAX)
    right = min(max(right, PROPELLER_MIN), PROPELLER_MAX)
    if lag == 0.0:
        state = state.copy()
        state[12], state[13] = left, right
    return stepped(_sailing_rates, state, step, (left, right, lag, hull, conditions), by_runge_kutta)


@kernel
def _motion(state: Floats, _: float, hull: Floats, conditions: Floats) -> GroundMotion:
    current_u, current_v = in_body(conditions[CURRENT_NORTH], conditions[CURRENT_EAST], state[11])
    through_water = state[0] - current_u, state[1] - current_v
    held = 0.0, 0.0, 0.0, hull, conditions
    return moving(_sailing_rates, state, held, 6, 11, through_water, (state[9], state[10]))


class Otter(CompiledVessel):
    """An Otter for closed-loop simulation: its load, edition, propeller lag (s) and integration method.

    Command: propeller speeds left and right, rad/s. State (14,): the twelve of `derivatives` and the two propeller
    speeds, which follow their command with a first-order lag. Raises InputError as `derivatives` does, and for a
    negative lag or an unknown method.
    """

    size = 14
    kernels = _step, _motion

    def __init__(
        self,
        payload_mass: float = 0.0,
        payload_position: tuple[float, float, float] = (0.0, 0.0, 0.0),
        edition: str = "today",
        propeller_lag: float = 0.1,
        method: str = "rk4",
    ):
        lag = not_negative("otter.propeller_lag", propeller_lag)
        names = ("left propeller speed", "right propeller speed")
        self.actuators = tuple(Actuator(name, PROPELLER_MIN, PROPELLER_MAX, lag=lag) for name in names)
        self._constants = lag, loaded(payload_mass, payload_position, edition)
        self._options = (checked_method(method),)

    def start(self, north: float = 0.0, east: float = 0.0, heading: float = 0.0, speed: float = 0.0) -> np.ndarray:
        state = np.zeros(14)
        state[0], state[6], state[7], state[11] = speed, north, east, heading
        return state


BOAT = Boat(
    nomoto_gain=0.0242,
    nomoto_time=1.0,
    yaw_limit=OTTER_PROPELLERS.max_moment,
    bandwidth=0.5,
    propulsion=OTTER_PROPELLERS,
    lookahead=12.0,
    acceptance=4.0,
    cruise=1.2,
    top_speed=3.0,
    profile="simulated-otter",
    speed=SpeedPIGains(mass=85.0, linear_drag=77.5, bandwidth=0.4, limit=200.0, acceleration=0.15),
    station=StationGains(mass=85.0, limit=200.0, limit_astern=100.0),
)
"""Parameters for the controllers, with 25 kg of payload. K and T are P0's (64)–(65), valid for yaw moments of about 4
N·m. For small moments at 1.3 m/s they are 0.05 and 2.5 s, with about the same K/T. These two values allow a bandwidth
of 0.35 rad/s, for inaccurate fixes on long legs with wide turns."""


BOAT_IN_CURRENT = BOAT.but(
    bandwidth=1.0,
    lookahead=8.0,
    turn_rate=math.radians(12.0),
    yaw=YawResponse(0.0243, 1.86, 1.0, 0.714, 12.9),
    pivot=0.43,
    yaw_wander=math.radians(0.15),
    yaw_doubt=0.2,
)
"""The yaw response is a fit to the model's yaw rate in squares and surveys at 0.5 to 1.3 m/s. The error of the fit is
0.15°/s RMS, some hundredths of the ordered rate; with T = 1 s it is 0.55°/s. Above 1.2 m/s the response is
directionally unstable. The model's sway velocity is −0.43 m times its yaw rate. Bandwidth and lookahead gave the best
results of the demo on seeds other than its own."""


class OtterTable(VesselTable):
    """An Otter USV, 2 m long, with two propellers."""

    kind: Literal["otter"] = "otter"
    length: ClassVar[float] = LENGTH
    payload_mass: Annotated[float, Field(strict=True, ge=0.0, le=45.0), "kg"] = 25.0
    """Mass of the payload."""
    payload_position: Annotated[Triple, "m"] = (0.05, 0.0, -0.35)
    """Position of the payload from the vessel's origin: forward, starboard, down."""
    edition: Literal["today", "2021"] = "today"
    """Edition of the public model; "2021" is that of P0."""
    propeller_lag: Annotated[NotNegative, "s"] = 0.1
    """Time constant of the propeller speed."""
    reference: ClassVar[str] = "tracking"

    def build(self) -> Otter:
        return Otter(self.payload_mass, self.payload_position, self.edition, self.propeller_lag, self.method)

    def boat(self) -> Boat:
        return BOAT

    def boat_in_current(self) -> Boat:
        return BOAT_IN_CURRENT
