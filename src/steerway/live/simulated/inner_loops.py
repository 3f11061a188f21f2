"""What a vehicle's own controllers make of a yaw rate and a speed: they see the truth, as a good gyro and filter do."""

import math
from dataclasses import replace

from steerway.control.boats import Boat
from steerway.control.speed_pi import SpeedPI
from steerway.core.kinematics import GroundMotion


class InnerLoops:
    """What a vehicle makes of a yaw rate and a speed: PI with feedforward on her yaw rate, PI on her speed.

    Both poles of the yaw rate lie at 2/T of the boat's Nomoto model. A boat whose speed is her own has none to hold.
    """

    def __init__(self, her: Boat):
        self._propulsion, self._limit = her.propulsion, her.yaw_limit
        self._feedforward = 1.0 / her.nomoto_gain
        self._proportional = 3.0 / her.nomoto_gain
        self._integral_gain = 4.0 / (her.nomoto_gain * her.nomoto_time)
        self._speed = None if her.speed is None else SpeedPI(replace(her.speed, bandwidth=1.0, acceleration=0.5))
        self._learned = 0.0

    def step(self, yaw_rate: float, speed: float, motion: GroundMotion, dt: float) -> tuple[float, ...]:
        """Commands for a yaw rate (rad/s) and a speed over ground along the hull (m/s)."""
        force = 0.0 if self._speed is None else self._speed.step(speed, _ahead(motion), dt)
        error = yaw_rate - motion.yaw_rate
        wanted = self._feedforward * yaw_rate + self._proportional * error + self._learned
        *command, given_force, given = self._propulsion.step(force, max(-self._limit, min(self._limit, wanted)))
        if (wanted - given) * error <= 0.0 or abs(wanted - given) < 1e-9 * self._limit:
            self._learned += self._integral_gain * error * dt
        if self._speed is not None:
            self._speed.limited_to(given_force)
        return tuple(command)

    def rest(self) -> tuple[float, ...]:
        """Commands that do nothing; what was learned is forgotten."""
        self._learned = 0.0
        if self._speed is not None:
            self._speed.restart()
        return tuple(self._propulsion.step(0.0, 0.0)[:-2])


def _ahead(motion):
    """Speed over ground along the hull, m/s."""
    return motion.north_velocity * math.cos(motion.heading) + motion.east_velocity * math.sin(motion.heading)
