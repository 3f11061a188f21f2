"""P3's hypothetical USV of 15 m in three degrees of freedom, Table I: two propellers at one speed and a yaw moment.

M ν̇ + C(ν)ν + D ν + B ν|ν| = τ, P3 (3)–(8), with ν through the water. The printed model is unstable in yaw: on a
straight course at the speed u it has the eigenvalue +u √(m11 (m22 − m11)/(m22 m33)) = +0.139 u. A heading loop with a
gain of more than m11 (m22 − m11)/m22 u² = 6.41 u² kN·m/rad stabilizes it.

State x y ψ u v r n (m, m, rad, m/s, m/s, rad/s, rev/s); u and v over ground along the hull's axes.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np

from steerway.control.allocation import ShaftAndMoment
from steerway.control.boats import Boat
from steerway.control.speed_guess import follow
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.kinematics import GroundMotion, in_body, over_ground
from steerway.core.settings import Positive
from steerway.vessels.propeller import Propeller, thrust
from steerway.vessels.surge import (
    CALDAS_LINEAR_DRAG,
    CALDAS_MASS,
    CALDAS_QUADRATIC_DRAG,
    SHAFT,
    ShaftKeys,
    Surge,
    top_speed_of,
)
from steerway.vessels.vessel import (
    CURRENT_EAST,
    CURRENT_NORTH,
    FORCE_EAST,
    FORCE_NORTH,
    MOMENT,
    Actuator,
    CompiledVessel,
    check_shapes,
    moving,
    runge_kutta,
)

MASS = (CALDAS_MASS, 29277.3, 331146.3)
"""m11, m22 in kg, m33 in kg·m²: P3 Table I, printed in t and t·m²."""
LINEAR_DRAG = (CALDAS_LINEAR_DRAG, 1.7, 0.4)
"""d11, d22 in N·s/m, d33 in N·m·s, printed in kN."""
QUADRATIC_DRAG = (CALDAS_QUADRATIC_DRAG, 3037.6, 639483.5)
"""b11, b22 in N·s²/m², b33 in N·m·s², printed in kN."""

_M1, _M2, _M3 = MASS
_D1, _D2, _D3 = LINEAR_DRAG
_B1, _B2, _B3 = QUADRATIC_DRAG


@kernel
def _rates(state: Floats, shaft_rate: float, moment: float, curve: Floats, conditions: Floats) -> Floats:
    heading, u, v, r = state[2], state[3], state[4], state[5]
    stream, set_across = in_body(conditions[CURRENT_NORTH], conditions[CURRENT_EAST], heading)
    force, side = in_body(conditions[FORCE_NORTH], conditions[FORCE_EAST], heading)
    a, b = u - stream, v - set_across
    out = np.empty(7)
    out[0], out[1] = over_ground(u, v, heading)
    out[2] = r
    ahead = thrust(a, state[6], curve) + force + _M2 * b * r - (_D1 + _B1 * abs(a)) * a
    abeam = side - _M1 * a * r - (_D2 + _B2 * abs(b)) * b
    turn = moment + conditions[MOMENT] + (_M1 - _M2) * a * b - (_D3 + _B3 * abs(r)) * r
    # A current that is constant in NED rotates in the body frame of a turning hull.
    out[3] = ahead / _M1 + r * set_across
    out[4] = abeam / _M2 - r * stream
    out[5] = turn / _M3
    out[6] = shaft_rate
    return out


@kernel
def _step(
    state: Floats, command: float, moment: float, machine: Floats, curve: Floats, conditions: Floats, step: float
) -> Floats:
    after = follow(state[6], command, machine[0], machine[1], machine[2], machine[3], step)
    if machine[3] == 0.0 and machine[2] == math.inf:
        state = state.copy()
        state[6] = after
    moment = min(max(moment, -machine[4]), machine[4])
    out = runge_kutta(_rates, state, step, ((after - state[6]) / step, moment, curve, conditions))
    out[6] = after
    return out


@kernel
def _motion(state: Floats, _: Floats, curve: Floats, conditions: Floats) -> GroundMotion:
    stream, set_across = in_body(conditions[CURRENT_NORTH], conditions[CURRENT_EAST], state[2])
    through_water = state[3] - stream, state[4] - set_across
    return moving(_rates, state, (0.0, 0.0, curve, conditions), 0, 2, through_water, (0.0, 0.0), state[6])


class Caldas(CompiledVessel):
    """P3's USV for closed-loop simulation. Command: shaft speed (rev/s), yaw moment (N·m). State (7,): see module."""

    size = 7
    kernels = _step, _motion

    def __init__(self, propeller: Propeller | None = None, shaft: Actuator = SHAFT, moment_limit: float = math.inf):
        self.actuators = (shaft, Actuator("yaw moment", -moment_limit, moment_limit))
        machine = np.array([shaft.low, shaft.high, shaft.rate, shaft.lag, moment_limit])
        self._constants = machine, (propeller or Propeller()).curve()

    def rates(self, state: Floats, moment: float, conditions: Floats) -> np.ndarray:
        """Time derivative (7,) of the state for a yaw moment (N·m), at constant shaft speed."""
        state = np.asarray(state, dtype=np.float64)
        check_shapes(state, 7, conditions)
        return _rates(state, 0.0, moment, self._constants[1], conditions)


_YAW_BANDWIDTH = 2.0
"""Bandwidth ω of the heading loop, rad/s. Its gain K_p = M3 ω² must exceed 6.41 u² kN·m/rad. With 1 rad/s the loop is
unstable above 7 m/s; with 2 rad/s K_p is 1.8 times the value needed at the top speed of 10.6 m/s."""


class CaldasTable(ShaftKeys):
    """The USV of P3; it needs a compass, because it is unstable in yaw."""

    kind: Literal["caldas"] = "caldas"
    length: ClassVar[float] = 15.0
    moment_limit: Annotated[Positive, "N·m"] = 400e3
    """Largest yaw moment."""

    def build(self) -> Caldas:
        return Caldas(Propeller(self.diameter), self.shaft(), self.moment_limit)

    def boat(self) -> Boat:
        """K and T represent the yaw inertia alone, because yaw damping is quadratic: almost 0 on a straight course."""
        thrust_gain, gains = self.guessed(_M1, _D1, _B1)
        shaft = self.shaft()
        top_speed = top_speed_of(Surge(_M1, _D1, _B1, Propeller(self.diameter), shaft))
        time = 10.0
        return Boat(
            nomoto_gain=time / _M3,
            nomoto_time=time,
            yaw_limit=self.moment_limit,
            bandwidth=_YAW_BANDWIDTH,
            propulsion=ShaftAndMoment(thrust_gain, shaft.high, shaft.low, self.moment_limit),
            lookahead=60.0,
            acceptance=25.0,
            cruise=3.0,
            top_speed=top_speed,
            profile="mariner-usv",
            speed=gains,
            full_shaft=shaft.high,
        )
