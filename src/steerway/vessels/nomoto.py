"""Nomoto's first-order vessel: T ṙ + r = K (δ + b), at one speed through the water; P1 (27), P0 (53).

State x y ψ r δ (m, m, rad, rad/s, the actuator's unit). δ is a rudder angle or a yaw moment, b its bias.
"""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from steerway.control.allocation import Rudder
from steerway.control.boats import Boat
from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.kinematics import GroundMotion, over_ground
from steerway.core.settings import Positive
from steerway.vessels.vessel import (
    CURRENT_EAST,
    CURRENT_NORTH,
    Actuator,
    CompiledVessel,
    VesselTable,
    check_speed,
    checked_method,
    stepped,
    turning,
)

IDEAL = Actuator("rudder", -math.inf, math.inf)


@kernel
def _rates(state: Floats, rudder: float, parameters: Floats, conditions: Floats) -> Floats:
    gain, time_constant, speed, bias = parameters[0], parameters[1], parameters[2], parameters[3]
    low, high, fastest, lag = parameters[4], parameters[5], parameters[6], parameters[7]
    heading, yaw_rate, delta = state[2], state[3], state[4]
    wanted = min(max(rudder, low), high)
    if lag == 0.0:
        delta = wanted
    north, east = over_ground(speed, 0.0, heading)
    out = np.empty(5)
    out[0] = north + conditions[CURRENT_NORTH]
    out[1] = east + conditions[CURRENT_EAST]
    out[2] = yaw_rate
    out[3] = (gain * (delta + bias) - yaw_rate) / time_constant
    out[4] = 0.0 if lag == 0.0 else min(max((wanted - delta) / lag, -fastest), fastest)
    return out


@kernel
def _step(
    state: Floats, rudder: float, parameters: Floats, conditions: Floats, step: float, by_runge_kutta: bool
) -> Floats:
    if parameters[7] == 0.0:
        state = state.copy()
        state[4] = min(max(rudder, parameters[4]), parameters[5])
    return stepped(_rates, state, step, (rudder, parameters, conditions), by_runge_kutta)


@kernel
def _motion(state: Floats, parameters: Floats, conditions: Floats) -> GroundMotion:
    return turning(state[0], state[1], state[2], state[3], parameters[2], 0.0, conditions)


class Nomoto(CompiledVessel):
    """A Nomoto vessel for closed-loop simulation. Command: the rudder, or moment. State (5,): see the module.

    `actuator` holds the rudder's limits, rate and lag; without a lag the rudder equals its command. Raises
    InputError when gain, time constant, speed, bias or method cannot be used.
    """

    size = 5
    kernels = _step, _motion

    def __init__(
        self,
        gain: float,
        time_constant: float,
        speed: float,
        bias: float = 0.0,
        actuator: Actuator = IDEAL,
        method: str = "rk4",
    ):
        if not (math.isfinite(gain) and gain != 0.0):
            raise InputError(f"nomoto.gain is {gain}, expected a number other than 0")
        if not math.isfinite(bias):
            raise InputError(f"nomoto.bias is {bias}, expected a number")
        positive("nomoto.time_constant", time_constant)
        self._speed = not_negative("nomoto.speed", speed)
        self.actuators = (actuator,)
        machine = (actuator.low, actuator.high, actuator.rate, actuator.lag)
        self._constants = (np.array([gain, time_constant, speed, bias, *machine], dtype=np.float64),)
        self._options = (checked_method(method),)

    def start(
        self, north: float = 0.0, east: float = 0.0, heading: float = 0.0, speed: float | None = None
    ) -> np.ndarray:
        """The state at rest in yaw; a `speed` other than the vessel's own raises InputError."""
        check_speed("nomoto", speed, self._speed)
        return np.array([north, east, heading, 0.0, 0.0])


class NomotoTable(VesselTable):
    """A vessel that turns by Nomoto's model, at a constant speed."""

    kind: Literal["nomoto"] = "nomoto"
    gain: Annotated[Positive, "1/s for a rad of rudder"] = 0.2
    """Gain K of Nomoto's model: steady yaw rate per rudder angle."""
    time_constant: Annotated[Positive, "s"] = 20.0
    """Time constant T of Nomoto's model."""
    speed: Annotated[Positive, "m/s"] = 2.0
    """Constant speed through the water."""
    rudder_limit_deg: Annotated[float, Field(strict=True, gt=0.0, le=90.0)] = 35.0
    """Largest rudder angle."""

    def build(self) -> Nomoto:
        limit = math.radians(self.rudder_limit_deg)
        rudder = Actuator("rudder", -limit, limit)
        return Nomoto(self.gain, self.time_constant, self.speed, actuator=rudder, method=self.method)

    def boat(self) -> Boat:
        """Bandwidth 2/T; lengths in proportion to the distance run in T."""
        limit = math.radians(self.rudder_limit_deg)
        return Boat(
            nomoto_gain=self.gain,
            nomoto_time=self.time_constant,
            yaw_limit=limit,
            bandwidth=2.0 / self.time_constant,
            propulsion=Rudder(limit),
            lookahead=5.0 * self.speed * self.time_constant,
            acceptance=self.speed * self.time_constant,
            cruise=self.speed,
            top_speed=self.speed,
            profile="small-usv",
        )
