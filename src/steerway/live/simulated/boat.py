"""A scenario's vessel, environment and receiver, one step at a time: no pilot, no clock, no I/O."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from steerway.control.boats import Boat
from steerway.control.speed_pi import SpeedPI
from steerway.core.earth import displaced
from steerway.core.errors import InputError
from steerway.core.kinematics import GroundMotion
from steerway.sensors.suite import Suite
from steerway.simulation import assembly
from steerway.simulation.scenario import EstimatorTable, Scenario


class ReceiverFix(NamedTuple):
    """A fix of the receiver: its epoch and its delivery in s since the start; rad, m/s; NaN for unreported values."""

    epoch: float
    delivered: float
    latitude: float
    longitude: float
    sog: float
    cog: float


class SimulatedBoat:
    """Carries out commands, one per actuator.

    `time`: s since the start; `motion`: the true motion; `heading`: last reading of the compass, NaN without a compass;
    `seed`: replaces the seed of the scenario.
    """

    def __init__(self, scenario: Scenario, seed: int | None = None):
        aboard = scenario.model_copy(update={"estimator": EstimatorTable()})
        self.vessel, self.known = aboard.vessel.build(), assembly.boat(aboard)
        self.origin: tuple[float, float] = aboard.origin.place
        self.step_length = aboard.step
        random = np.random.default_rng(scenario.seed if seed is None else seed)
        self._sea = aboard.environment.start(random.spawn(1)[0], aboard.step)
        suite = assembly.instruments(aboard)
        if not isinstance(suite, Suite):
            raise InputError(f"{scenario.name}: a manoeuvre needs the true motion, expected a scenario with a route")
        self._instruments = suite.start(random)
        self._state = self.vessel.start(*(each for each in assembly.start(aboard) if each is not None))
        self._steps = 0
        self.heading = math.nan
        self.motion: GroundMotion = self.vessel.motion(self._state, self._sea.conditions)

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self._steps * self.step_length

    def position(self) -> tuple[float, float]:
        """True latitude and longitude, rad."""
        return displaced(*self.origin, self.motion.north, self.motion.east)

    def step(self, command: Sequence[float]) -> ReceiverFix | None:
        """Step under a command; return the fix that the receiver delivers at the end of the step, or None.

        Raises InputError if the state is no longer finite.
        """
        self._state = self.vessel.step(self._state, command, self._sea.conditions, self.step_length)
        self._sea.advance(self.motion)
        self._steps += 1
        if not math.isfinite(self._state[0]):
            raise InputError(
                f"the vessel's state is no number after {self.time:g} s, "
                f"expected a smaller step than {self.step_length:g} s"
            )
        self.motion = self.vessel.motion(self._state, self._sea.conditions)
        return self._look()

    def _look(self) -> ReceiverFix | None:
        seen = self._instruments.step(self.time, self.motion, self._sea.waves)
        self.heading = self.heading if math.isnan(seen.heading) else seen.heading
        if math.isnan(seen.north):
            return None
        place = displaced(*self.origin, seen.north, seen.east)
        return ReceiverFix(self.time - seen.age, self.time, *place, seen.sog, seen.cog)


class InnerLoops:
    """Inner loops of a boat: PI with feedforward for the yaw rate, PI for the speed.

    Both poles of the yaw-rate loop are at 2/T, with T of the boat's Nomoto model. `throttle` is the fraction of full
    thrust. For a boat without a speed loop the thrust is 0 and `throttle` 1: its engine is not commanded.
    """

    def __init__(self, boat: Boat):
        self._propulsion, self._limit = boat.propulsion, boat.yaw_limit
        self._feedforward = 1.0 / boat.nomoto_gain
        self._proportional = 3.0 / boat.nomoto_gain
        self._integral_gain = 4.0 / (boat.nomoto_gain * boat.nomoto_time)
        self._speed = None if boat.speed is None else SpeedPI(replace(boat.speed, bandwidth=1.0, acceleration=0.5))
        self._integral = self.throttle = 0.0

    def step(self, yaw_rate: float, speed: float, motion: GroundMotion, dt: float) -> tuple[float, ...]:
        """Actuator commands for a yaw rate (rad/s) and a speed over ground along the hull (m/s)."""
        force = 0.0 if self._speed is None else self._speed.step(speed, motion.along, dt)
        error = yaw_rate - motion.yaw_rate
        wanted = self._feedforward * yaw_rate + self._proportional * error + self._integral
        *command, given_force, given = self._propulsion.step(force, max(-self._limit, min(self._limit, wanted)))
        if (wanted - given) * error <= 0.0 or abs(wanted - given) < 1e-9 * self._limit:
            self._integral += self._integral_gain * error * dt
        if self._speed is not None:
            self._speed.limited_to(given_force)
        self.throttle = 1.0 if self._speed is None else abs(given_force) / self._speed.gains.limit
        return tuple(command)

    def rest(self) -> tuple[float, ...]:
        """Neutral commands; resets the integrals."""
        self._integral = self.throttle = 0.0
        if self._speed is not None:
            self._speed.restart()
        return tuple(self._propulsion.step(0.0, 0.0)[:-2])
