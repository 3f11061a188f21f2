"""Springer: a 4.2 m catamaran USV steered by the difference of two propeller speeds, identified on the water; P4 §2.1.

Yaw is a discrete model, x(k+1) = A x(k) + B n_d(k), ψ(k) = C x(k), at 1 s, with n_d = (n1 − n2)/2 in rpm and ψ in rad;
surge is a constant speed at n_c = (n1 + n2)/2 = 900 rpm. For any other time step the poles are converted exactly, for a
constant n_d.

There are two plants. The printed one has a pole at 1.002: its yaw rate depends on the heading itself, and a straight
course at 57° needs −8 rpm. The physical one has this pole at 1: heading is the integral of the yaw rate.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from steerway.control.allocation import Rudder
from steerway.control.boats import Boat
from steerway.control.heading_plant import HeadingResponse
from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, one_of
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.kinematics import GroundMotion, over_ground
from steerway.core.settings import Positive
from steerway.estimation.heading.models import PAPER_YAW, PHYSICAL_YAW, RPM, SPEED, HeadingModel, held
from steerway.vessels.vessel import (
    CURRENT_EAST,
    CURRENT_NORTH,
    Actuator,
    CompiledVessel,
    VesselTable,
    check_shapes,
    check_speed,
    turning,
)

LENGTH = 4.2
MAX_DIFFERENCE_RPM = 300.0
MAX_CHANGE_RPM = 20.0
"""Limits of n_d and of its change from second to second; P4 (27)."""
PLANTS = ("paper", "physical")


@kernel
def _step(state: Floats, difference: float, parameters: Floats, conditions: Floats, step: float) -> Floats:
    """P4 (2)–(4) and (28)–(29); the position uses the heading at the beginning of the step, as printed."""
    bias, speed, limit, rate = parameters[6], parameters[7], parameters[8], parameters[9]
    wanted = min(max(difference, -limit), limit)
    given = state[4] + min(max(wanted - state[4], -rate * step), rate * step)
    heading = parameters[4] * state[2] + parameters[5] * state[3]
    north, east = over_ground(speed, 0.0, heading)
    out = np.empty(6)
    out[0] = state[0] + step * (north + conditions[CURRENT_NORTH])
    out[1] = state[1] + step * (east + conditions[CURRENT_EAST])
    for i in range(2):
        kept, entered = held(parameters[i], step)
        out[2 + i] = kept * state[2 + i] + entered * parameters[2 + i] * (given + bias) / RPM
    out[4] = given
    out[5] = (parameters[4] * out[2] + parameters[5] * out[3] - heading) / step
    return out


@kernel
def _motion(state: Floats, parameters: Floats, conditions: Floats) -> GroundMotion:
    heading = parameters[4] * state[2] + parameters[5] * state[3]
    return turning(state[0], state[1], heading, state[5], parameters[7], 0.0, conditions)


class Springer(CompiledVessel):
    """Springer in a closed loop. Command: (n_d,) in rad/s. State (6,): x y (m), two states of yaw, n_d (rad/s), ψ̇.

    plant: "paper" or "physical". effectiveness: factor on B. bias: error of n_d, rad/s. speed: speed through the water,
    m/s. yaw: another boat's response, in place of a plant. Raises InputError for numbers out of range.
    """

    size = 6
    kernels = _step, _motion

    def __init__(
        self,
        plant: str = "physical",
        effectiveness: float = 1.0,
        bias: float = 0.0,
        speed: float = SPEED,
        yaw: HeadingModel | None = None,
    ):
        one_of("springer.plant", plant, PLANTS)
        if not math.isfinite(effectiveness) or not math.isfinite(bias):
            raise InputError(f"springer: effectiveness {effectiveness} and bias {bias}, expected numbers")
        self._speed = not_negative("springer.speed", speed)
        if yaw is not None and not (np.isfinite(yaw).all() and yaw.outputs[0] != 0.0):
            raise InputError(f"springer.yaw is {tuple(yaw)}, expected numbers, and a first output other than 0")
        self.yaw = (yaw or (PAPER_YAW if plant == "paper" else PHYSICAL_YAW)).scaled(effectiveness)
        limit, rate = MAX_DIFFERENCE_RPM * RPM, MAX_CHANGE_RPM * RPM
        self.actuators = (Actuator("propeller difference", -limit, limit, rate),)
        yaw_response = (*self.yaw.poles, *self.yaw.inputs, *self.yaw.outputs)
        self._constants = (np.array([*yaw_response, bias, speed, limit, rate]),)

    def start(
        self, north: float = 0.0, east: float = 0.0, heading: float = 0.0, speed: float | None = None
    ) -> np.ndarray:
        """The state at rest in yaw; a `speed` other than the vessel's own raises InputError."""
        check_speed("springer", speed, self._speed)
        return np.array([north, east, heading / self.yaw.outputs[0], 0.0, 0.0, 0.0])

    def heading(self, state: Floats) -> float:
        """Unwrapped heading, rad."""
        check_shapes(state, 6)
        return self.yaw.outputs[0] * state[2] + self.yaw.outputs[1] * state[3]


_FIRST, _SECOND = (g * c / RPM for g, c in zip(PHYSICAL_YAW.inputs, PHYSICAL_YAW.outputs, strict=True))

BOAT = Boat(
    nomoto_gain=2.07e-3,
    nomoto_time=12.0,
    yaw_limit=MAX_DIFFERENCE_RPM * RPM,
    bandwidth=0.12,
    propulsion=Rudder(MAX_DIFFERENCE_RPM * RPM),
    lookahead=25.0,
    acceptance=4.0,
    cruise=SPEED,
    top_speed=SPEED,
    profile="small-usv",
    response=HeadingResponse(PHYSICAL_YAW.poles, (_FIRST, _SECOND), 1.0),
    yaw_slew=MAX_CHANGE_RPM * RPM,
)
"""Parameters for the controllers; the autopilot's output is n_d in rad/s. K is the gain in a steady turn; T accounts
for the rate limit of n_d, 20 rpm per second."""


class SpringerTable(VesselTable):
    """The USV Springer of P4."""

    kind: Literal["springer"] = "springer"
    length: ClassVar[float] = LENGTH
    plant: Literal["paper", "physical"] = "physical"
    """Yaw model: as printed, with a pole at 1.002, or with this pole at 1."""
    effectiveness: Annotated[Positive, "1"] = 1.0
    """Factor on the yaw response to the propeller difference."""
    bias_rpm: Annotated[float, Field(strict=True, ge=-100.0, le=100.0), "rev/min"] = 0.0
    """Error of n_d, half the difference of the propeller speeds."""
    speed: Annotated[Positive, "m/s"] = SPEED
    """Constant speed through the water."""

    def build(self) -> Springer:
        return Springer(self.plant, self.effectiveness, self.bias_rpm * RPM, self.speed)

    def boat(self) -> Boat:
        return BOAT.but(cruise=self.speed, top_speed=self.speed)
