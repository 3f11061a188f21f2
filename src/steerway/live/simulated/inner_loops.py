"""A vehicle's own control of yaw rate and speed; it measures the truth, as a good gyro and filter would."""

import math
from dataclasses import replace

from steerway.control.boats import Boat
from steerway.control.speed_pi import SpeedPI
from steerway.core.kinematics import GroundMotion


class InnerLoops:
    """PI with feedforward on the yaw rate, PI on the speed.

    Both poles of the yaw-rate loop lie at 2/T of the boat's Nomoto model. Without a speed loop the thrust is 0.
    """

    def __init__(self, boat: Boat):
        self._propulsion, self._limit = boat.propulsion, boat.yaw_limit
        self._feedforward = 1.0 / boat.nomoto_gain
        self._proportional = 3.0 / boat.nomoto_gain
        self._integral_gain = 4.0 / (boat.nomoto_gain * boat.nomoto_time)
        self._speed = None if boat.speed is None else SpeedPI(replace(boat.speed, bandwidth=1.0, acceleration=0.5))
        self._integral = 0.0

    def step(self, yaw_rate: float, speed: float, motion: GroundMotion, dt: float) -> tuple[float, ...]:
        """Commands for a yaw rate (rad/s) and a speed over ground along the hull (m/s)."""
        force = 0.0 if self._speed is None else self._speed.step(speed, _ahead(motion), dt)
        error = yaw_rate - motion.yaw_rate
        wanted = self._feedforward * yaw_rate + self._proportional * error + self._integral
        *command, given_force, given = self._propulsion.step(force, max(-self._limit, min(self._limit, wanted)))
        if (wanted - given) * error <= 0.0 or abs(wanted - given) < 1e-9 * self._limit:
            self._integral += self._integral_gain * error * dt
        if self._speed is not None:
            self._speed.limited_to(given_force)
        return tuple(command)

    def rest(self) -> tuple[float, ...]:
        """Commands that do nothing; the integrals are reset."""
        self._integral = 0.0
        if self._speed is not None:
            self._speed.restart()
        return tuple(self._propulsion.step(0.0, 0.0)[:-2])


def _ahead(motion):
    """Speed over ground along the hull, m/s."""
    return motion.north_velocity * math.cos(motion.heading) + motion.east_velocity * math.sin(motion.heading)
