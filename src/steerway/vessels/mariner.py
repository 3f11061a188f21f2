"""A Mariner-class cargo ship: 160.93 m, three degrees of freedom, one rudder.

M. S. Chislett and J. Strøm-Tejsen (1965), Planar Motion Mechanism Tests and Full-Scale Steering and Manoeuvring
Predictions for a Mariner Class Vessel, report Hy-5, Hydro- and Aerodynamics Laboratory, Lyngby: an Abkowitz expansion
about the cruise speed in lengths and speeds of the ship (prime system). The coefficients below are theirs times 10⁵.

State u v r x y ψ δ: u, v, r are perturbations about the cruise speed (m/s, m/s, rad/s), position in m, heading and
rudder in rad. A positive rudder command turns to starboard; the state δ carries the opposite sign. With the rudder
amidships the ship turns slowly, as single-screw ships do.
"""

import math
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from steerway.control.allocation import Rudder
from steerway.control.boats import Boat
from steerway.control.course import YawResponse
from steerway.core.arrays import Floats
from steerway.core.checks import positive
from steerway.core.compiled import kernel
from steerway.core.kinematics import GroundMotion, over_ground
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
    moving,
    stepped,
)

LENGTH = 160.93
CRUISE_SPEED = 7.7175  # 15 knots
WATER_DENSITY = 1025.0
RUDDER = Actuator("rudder", math.radians(-40.0), math.radians(40.0), rate=math.radians(5.0), lag=1.0)

# Mass, inertia and centre of gravity, minus the acceleration coefficients.
_PER_MASS = 1e-5
_SURGE_MASS = 798.0 + 42.0
_SWAY_MASS = 798.0 + 748.0
_SWAY_BY_YAW = 798.0 * -0.023 + 9.354
_YAW_BY_SWAY = 798.0 * -0.023 - 4.646
_YAW_INERTIA = 39.2 + 43.8
_DETERMINANT = _SWAY_MASS * _YAW_INERTIA - _SWAY_BY_YAW * _YAW_BY_SWAY

_LOW, _HIGH, _FASTEST, _LAG = RUDDER.low, RUDDER.high, RUDDER.rate, RUDDER.lag


def derivatives(state: ArrayLike, rudder: float, cruise_speed: float = CRUISE_SPEED) -> np.ndarray:
    """Time derivative (7,) of the state (7,) for a commanded rudder (rad, + turns to starboard).

    The steering gear has a lag of 1 s and limits of 5 °/s and 40°. Source: Chislett and Strøm-Tejsen (1965).
    """
    return _rates(np.asarray(state, dtype=np.float64), float(rudder), float(cruise_speed), _CALM)


_CALM = np.zeros(5)


@kernel
def _forces(u: float, v: float, r: float, d: float) -> tuple[float, float, float]:
    """X, Y and N times 10⁵ from surge, sway, yaw rate and rudder, all nondimensional (prime system)."""
    x = u * (-184.0 + u * (-110.0 - 215.0 * u)) - 899.0 * v * v + 18.0 * r * r + 798.0 * r * v
    x += d * d * (-95.0 - 190.0 * u) + v * d * (93.0 + 93.0 * u)
    y = v * (-1160.0 * (1.0 + u) - 8078.0 * v * v + 15356.0 * v * r) - 499.0 * r * (1.0 + u)
    y += d * (278.0 + 556.0 * u + 278.0 * u * u - 90.0 * d * d - 4.0 * v * d + 1190.0 * v * v)
    y -= 4.0 + 8.0 * u + 4.0 * u * u
    n = v * (-264.0 * (1.0 + u) + 1636.0 * v * v - 5483.0 * v * r) - 166.0 * r * (1.0 + u)
    n += d * (-139.0 - 278.0 * u - 139.0 * u * u + 45.0 * d * d + 13.0 * v * d - 489.0 * v * v)
    n += 3.0 + 6.0 * u + 3.0 * u * u
    return x, y, n


@kernel
def _rudder_rate(rudder: float, delta: float) -> float:
    """Rate (rad/s) of the state δ by the steering gear; the command has the opposite sign."""
    wanted = -min(max(rudder, _LOW), _HIGH)
    return min(max((wanted - delta) / _LAG, -_FASTEST), _FASTEST)


@kernel
def _rates(state: Floats, rudder: float, cruise_speed: float, conditions: Floats) -> Floats:
    surge, sway, yaw_rate, heading, delta = state[0], state[1], state[2], state[5], state[6]
    speed = math.hypot(cruise_speed + surge, sway)
    x, y, n = _forces(surge / speed, sway / speed, yaw_rate * LENGTH / speed, delta)
    pressure = _PER_MASS * 0.5 * WATER_DENSITY * (speed * LENGTH) ** 2
    c, s = math.cos(heading), math.sin(heading)
    x += (conditions[FORCE_NORTH] * c + conditions[FORCE_EAST] * s) / pressure
    y += (conditions[FORCE_EAST] * c - conditions[FORCE_NORTH] * s) / pressure
    n += conditions[MOMENT] / (pressure * LENGTH)
    acceleration = speed * speed / LENGTH
    out = np.empty(7)
    out[0] = x * acceleration / _SURGE_MASS
    out[1] = (_YAW_INERTIA * y - _SWAY_BY_YAW * n) * acceleration / _DETERMINANT
    out[2] = (_SWAY_MASS * n - _YAW_BY_SWAY * y) * acceleration / (LENGTH * _DETERMINANT)
    north, east = over_ground(cruise_speed + surge, sway, heading)
    out[3] = north + conditions[CURRENT_NORTH]
    out[4] = east + conditions[CURRENT_EAST]
    out[5] = yaw_rate
    out[6] = _rudder_rate(rudder, delta)
    return out


@kernel
def _step(
    state: Floats, rudder: float, cruise_speed: float, conditions: Floats, step: float, by_runge_kutta: bool
) -> Floats:
    return stepped(_rates, state, step, (rudder, cruise_speed, conditions), by_runge_kutta)


@kernel
def _motion(state: Floats, cruise_speed: float, conditions: Floats) -> GroundMotion:
    return moving(_rates, state, (0.0, cruise_speed, conditions), 3, 5, (cruise_speed + state[0], state[1]))


class Mariner(CompiledVessel):
    """A Mariner-class ship for closed-loop simulation. Command: the rudder, rad. State (7,): see `derivatives`.

    Velocities are through the water; a current adds to them over ground. Raises InputError for a cruise speed that is
    not positive and an unknown method.
    """

    actuators = (RUDDER,)
    size = 7
    kernels = _step, _motion

    def __init__(self, cruise_speed: float = CRUISE_SPEED, method: str = "rk4"):
        self.cruise_speed = positive("mariner.cruise_speed", cruise_speed)
        self._constants, self._options = (self.cruise_speed,), (checked_method(method),)

    def start(
        self, north: float = 0.0, east: float = 0.0, heading: float = 0.0, speed: float | None = None
    ) -> np.ndarray:
        """The state on a straight course, by default at the cruise speed."""
        surge = 0.0 if speed is None else speed - self.cruise_speed
        return np.array([surge, 0.0, 0.0, north, east, heading, 0.0])


BOAT = Boat(
    nomoto_gain=0.185,
    nomoto_time=107.3,
    yaw_limit=RUDDER.high,
    bandwidth=0.05,
    propulsion=Rudder(RUDDER.high),
    lookahead=800.0,
    acceptance=50.0,
    cruise=CRUISE_SPEED,
    top_speed=10.0,
    turn_rate=math.radians(0.45),
    profile="ship",
)
"""Parameters for the controllers: K in 1/s and T in s of P1 §4, a mid-range fit."""


BOAT_IN_CURRENT = BOAT.but(
    yaw=YawResponse(0.104, 40.0, 0.3, 0.0, 120.0),
    bandwidth=0.04,
    turn_rate=math.radians(0.55),
    pivot=74.0,
    yaw_wander=math.radians(0.055),
    speed_doubt=0.3,
    turn_loss=0.15,
)
"""The yaw response fits the initial yaw acceleration, and the yaw rates after one minute with rudders of 5° to 20°,
before the turn has slowed the ship. A rudder of 15° sustains `turn_rate`, which is 0.9 of the largest sustained yaw
rate. `yaw_wander` is a tenth of `turn_rate`: with a fiftieth, one run in ten of `steerway study at-sea` had a false
estimate of the current after its first turn, and the ship was up to two lengths off its leg. The engine runs at one
setting: in steady turns the model loses 0.04 to 0.23 of its speed, in proportion to the square of the yaw rate. With
the `speed_doubt` of a guessed boat, the filter took a current along the course for a speed of 1.3 times the ship's own,
and the ship was up to three lengths off its leg."""


class MarinerTable(VesselTable):
    """A Mariner-class ship."""

    kind: Literal["mariner"] = "mariner"
    length: ClassVar[float] = LENGTH
    cruise_speed: Annotated[Positive, "m/s"] = CRUISE_SPEED
    """Cruise speed, at which the hydrodynamic coefficients hold."""

    def build(self) -> Mariner:
        return Mariner(self.cruise_speed, self.method)

    def boat(self) -> Boat:
        return BOAT.but(cruise=self.cruise_speed)

    def boat_in_current(self) -> Boat:
        return BOAT_IN_CURRENT.but(cruise=self.cruise_speed)
