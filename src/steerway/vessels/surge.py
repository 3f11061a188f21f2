"""A surge-only boat: u̇ = −d u_r − b u_r|u_r| + T(u_r, n)/m + F/m; P3 (12)–(13).

u is the speed over ground along the hull, u_r = u − current the speed through the water, n the shaft speed in rev/s.
State x y ψ u n (m, m, rad, m/s, rev/s). The heading is constant; a cross current moves the boat sideways.
"""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from steerway.control.allocation import ShaftSpeed
from steerway.control.boats import Boat
from steerway.control.speed_guess import follow
from steerway.control.speed_pi import SpeedPIGains
from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.kinematics import GroundMotion, in_body, over_ground
from steerway.core.settings import Flag, NotNegative, Positive
from steerway.vessels.propeller import Propeller, thrust, thrust_coefficient
from steerway.vessels.vessel import (
    CURRENT_EAST,
    CURRENT_NORTH,
    FORCE_EAST,
    FORCE_NORTH,
    Actuator,
    CompiledVessel,
    VesselTable,
)

SHAFT = Actuator("shaft speed", 0.0, 17.5)
"""P3's shaft, without dynamics; its limit of 17.5 rev/s is not printed."""

CALDAS_MASS, CALDAS_LINEAR_DRAG, CALDAS_QUADRATIC_DRAG = 19801.1, 820.8, 101.2
"""m11, d11 and b11 of P3 Table I in kg, N·s/m and N·s²/m²."""


@kernel
def surge_rate(speed: float, shaft: float, linear_drag: float, quadratic_drag: float, curve: Floats) -> float:
    """u̇ (m/s²) at a speed through the water (m/s) and a shaft speed (rev/s); P3 (13), all per unit of mass."""
    return thrust(speed, shaft, curve) - (linear_drag + quadratic_drag * abs(speed)) * speed


@kernel
def surge_step(
    speed: float,
    before: float,
    after: float,
    stream: float,
    push: float,
    linear_drag: float,
    quadratic_drag: float,
    curve: Floats,
    step: float,
) -> float:
    """Speed over ground after `step` s, by RK4; the shaft speed changes linearly from `before` to `after`."""
    middle = 0.5 * (before + after)
    k1 = surge_rate(speed - stream, before, linear_drag, quadratic_drag, curve) + push
    k2 = surge_rate(speed + 0.5 * step * k1 - stream, middle, linear_drag, quadratic_drag, curve) + push
    k3 = surge_rate(speed + 0.5 * step * k2 - stream, middle, linear_drag, quadratic_drag, curve) + push
    k4 = surge_rate(speed + step * k3 - stream, after, linear_drag, quadratic_drag, curve) + push
    return speed + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@kernel
def _step(state: Floats, command: float, hull: Floats, curve: Floats, conditions: Floats, step: float) -> Floats:
    heading, speed, before = state[2], state[3], state[4]
    stream, across = in_body(conditions[CURRENT_NORTH], conditions[CURRENT_EAST], heading)
    force, _ = in_body(conditions[FORCE_NORTH], conditions[FORCE_EAST], heading)
    after = follow(before, command, hull[3], hull[4], hull[5], hull[6], step)
    if hull[6] == 0.0 and hull[5] == math.inf:
        before = after
    faster = surge_step(speed, before, after, stream, force / hull[0], hull[1], hull[2], curve, step)
    north, east = over_ground(0.5 * (speed + faster), across, heading)
    out = np.empty(5)
    out[0] = state[0] + step * north
    out[1] = state[1] + step * east
    out[2], out[3], out[4] = heading, faster, after
    return out


@kernel
def _motion(state: Floats, _: Floats, __: Floats, conditions: Floats) -> GroundMotion:
    heading, speed = state[2], state[3]
    stream, across = in_body(conditions[CURRENT_NORTH], conditions[CURRENT_EAST], heading)
    velocity = over_ground(speed, across, heading)
    return GroundMotion(state[0], state[1], heading, *velocity, 0.0, 0.0, speed - stream, 0.0, 0.0, 0.0, state[4])


class Surge(CompiledVessel):
    """A surge-only vessel for closed-loop simulation. Command: the shaft speed, rev/s. State (5,): see the module.

    mass including added mass in kg; drag linear in N·s/m and quadratic in N·s²/m². The default is P3's USV of Table I.
    Raises InputError for numbers out of range.
    """

    size = 5
    kernels = _step, _motion

    def __init__(
        self,
        mass: float = CALDAS_MASS,
        linear_drag: float = CALDAS_LINEAR_DRAG,
        quadratic_drag: float = CALDAS_QUADRATIC_DRAG,
        propeller: Propeller | None = None,
        shaft: Actuator = SHAFT,
    ):
        positive("surge.mass", mass)
        not_negative("surge.linear_drag", linear_drag)
        not_negative("surge.quadratic_drag", quadratic_drag)
        propeller = propeller or Propeller()
        self.mass, self.propeller, self.actuators = mass, propeller, (shaft,)
        machine = (shaft.low, shaft.high, shaft.rate, shaft.lag)
        hull = np.array([mass, linear_drag / mass, quadratic_drag / mass, *machine], dtype=np.float64)
        self._constants = hull, propeller.curve(propeller.gain / mass)

    def acceleration(self, speed: float, shaft: float) -> float:
        """u̇ (m/s²) at a speed through the water (m/s) and a shaft speed (rev/s)."""
        hull, curve = self._constants
        return surge_rate(speed, shaft, hull[1], hull[2], curve)


def published_surrogate() -> Surge:
    """A boat fitted to P3's figures, which the numbers printed in P3 do not reproduce; shaft lag 10.683 s."""
    mass = CALDAS_MASS
    propeller = Propeller()
    share = 0.0373039 * mass / propeller.gain
    fitted = Propeller(efficiency=propeller.efficiency * share)
    return Surge(mass, 0.0, 0.0040839 * mass, fitted, Actuator("shaft speed", 0.0, 17.5, lag=10.683))


_ADVANCE = 0.6
"""Typical advance ratio of boats in steady motion, for the thrust that a controller assumes."""
_SPEED_BANDWIDTH = 0.2
"""Bandwidth d_m of the speed loop, rad/s. P3 requires settling to 2 % within 40 s, for which d_m has to be at least
0.12. With 0.12 the disturbance observer takes 40 to 50 s from rest, because its guess of the thrust holds at one
advance ratio only. With 0.2 it takes 24 to 27 s."""


def speed_gains(
    mass: float, linear_drag: float, quadratic_drag: float, propeller: Propeller, shaft: Actuator
) -> tuple[float, SpeedPIGains]:
    """(thrust in N per (rev/s)², gains of a speed loop) for a boat with one shaft speed."""
    thrust_gain = propeller.gain * thrust_coefficient(_ADVANCE, propeller.curve(1.0))
    gains = SpeedPIGains(
        mass,
        linear_drag,
        quadratic_drag,
        bandwidth=_SPEED_BANDWIDTH,
        limit=thrust_gain * shaft.high**2,
        limit_astern=thrust_gain * shaft.low**2,
    )
    return thrust_gain, gains


class ShaftKeys(VesselTable):
    """The keys of a vessel with one shaft speed."""

    shaft_limit: Annotated[Positive, "rev/s"] = 17.5
    """Largest shaft speed."""
    shaft_lag: Annotated[NotNegative, "s"] = 0.5
    """Time constant of the shaft speed."""
    shaft_rate: Annotated[NotNegative, "rev/s²"] = 0.0
    """Largest change of the shaft speed per second; 0: no limit."""
    reverse: Flag = False
    """Whether the shaft can turn astern."""
    diameter: Annotated[Positive, "m"] = 0.8
    """Diameter of the propellers."""
    guessed_drag: Annotated[float, Field(strict=True, ge=0.1, le=10.0), "1"] = 1.0
    """Drag that the controllers assume, as a factor of the true drag."""
    guessed_thrust: Annotated[float, Field(strict=True, ge=0.1, le=10.0), "1"] = 1.0
    """Thrust that the controllers assume, as a factor of the true thrust."""

    def shaft(self) -> Actuator:
        """The shaft as an actuator."""
        low = -self.shaft_limit if self.reverse else 0.0
        return Actuator("shaft speed", low, self.shaft_limit, self.shaft_rate or math.inf, self.shaft_lag)

    def guessed(self, mass: float, linear_drag: float, quadratic_drag: float) -> tuple[float, SpeedPIGains]:
        """`speed_gains` for the guessed drag and thrust."""
        drags = self.guessed_drag * linear_drag, self.guessed_drag * quadratic_drag
        propeller = Propeller(self.diameter, efficiency=0.8 * self.guessed_thrust)
        return speed_gains(mass, *drags, propeller, self.shaft())


class SurgeTable(ShaftKeys):
    """A boat that moves only ahead and astern; the defaults are those of P3's USV."""

    kind: Literal["surge"] = "surge"
    mass: Annotated[Positive, "kg"] = CALDAS_MASS
    """Mass including added mass."""
    linear_drag: Annotated[NotNegative, "N s/m"] = CALDAS_LINEAR_DRAG
    """Coefficient of linear drag."""
    quadratic_drag: Annotated[NotNegative, "N s²/m²"] = CALDAS_QUADRATIC_DRAG
    """Coefficient of quadratic drag."""

    def build(self) -> Surge:
        propeller = Propeller(self.diameter)
        return Surge(self.mass, self.linear_drag, self.quadratic_drag, propeller, self.shaft())

    def boat(self) -> Boat:
        thrust_gain, gains = self.guessed(self.mass, self.linear_drag, self.quadratic_drag)
        shaft = self.shaft()
        top_speed = top_speed_of(self.build())
        return Boat(
            nomoto_gain=1.0,
            nomoto_time=1.0,
            yaw_limit=1.0,
            bandwidth=1.0,
            propulsion=ShaftSpeed(thrust_gain, shaft.high, shaft.low),
            lookahead=100.0,
            acceptance=10.0,
            cruise=0.5 * top_speed,
            top_speed=top_speed,
            profile="mariner-usv",
            speed=gains,
            full_shaft=shaft.high,
            steers=False,
        )


def top_speed_of(boat: Surge) -> float:
    """Speed (m/s) at full throttle, by bisection."""
    low, high = 0.0, 100.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if boat.acceleration(middle, boat.actuators[0].high) > 0.0 else (low, middle)
    return low
