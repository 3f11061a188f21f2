"""From the course to steer to orders: yaw rate and thrust, and what two propellers make of them.

Yaw rate is the reference's own plus the course error times a gain, the gain no quicker than the course estimate is
(`control.bandwidth`). Course over ground needs no crab angle. Whether a vessel's own loop follows the yaw rate or two
propellers do, the order is the same.
"""

import math
from typing import NamedTuple

from steerway.control.allocation import TwoPropellers
from steerway.control.bandwidth import carried_bandwidth, yaw_rate_gain
from steerway.control.speed_pi import SpeedPI, SpeedPIGains
from steerway.core.angles import wrap
from steerway.estimation.profiles import Profile
from steerway.formats.nmea0183.writing import Leg
from steerway.guidance.reference import Reference, ReferenceModel
from steerway.live.autopilot.mission import Boat
from steerway.live.heard import Row

QUICKEST = 0.5
"""1/s, the largest gain from course error to yaw rate, however good the estimate."""
SPEED_BANDWIDTH = 0.3
"""rad/s of the speed loop; the estimate of the speed carries about that."""
ACCELERATION = 0.15
"""m/s² at which another speed is approached."""
_TURN_TIME = 1.0
"""s in which the reference reaches its largest yaw rate."""
_SLOWEST_TURN = 0.5
"""Share of the asked speed that is kept in a sharp turn."""
_DAMPING, _TRIMMING = 0.2, 0.1
"""Of the propellers' yaw rate loop: P against feedforward, and the integral's rate against the course gain."""


class Command(NamedTuple):
    """What is asked of the vessel; see `live.autopilot.Order`."""

    yaw_rate: float
    thrust: float
    port: float
    starboard: float
    course: float
    speed: float


class Steering:
    """The control law of one boat. Thrust is a fraction of full thrust, propeller commands are of full speed: T = n|n|.

    profile: what the estimator was told of boat and receiver, to which the loop submits.
    """

    def __init__(self, boat: Boat, profile: Profile):
        self._profile = profile
        self._most = math.radians(boat.max_yaw_rate_dps)
        self._answer = math.radians(boat.full_yaw_rate_dps)
        self._yaw_time = boat.yaw_time
        self._slowest = 1.5 * profile.steerageway
        self._speed = SpeedPI(
            SpeedPIGains(
                mass=boat.surge_time / boat.top_speed_mps,
                linear_drag=1.0 / boat.top_speed_mps,
                bandwidth=SPEED_BANDWIDTH,
                limit=1.0,
                limit_astern=1.0 if boat.reverse else 0.0,
                acceleration=ACCELERATION,
            )
        )
        self._propellers = TwoPropellers(0.5, 1.0, 1.0, 1.0, -1.0 if boat.reverse else 0.0)
        self._shaper = ReferenceModel(1.0, max_rate=self._most, max_acceleration=self._most / _TURN_TIME)
        self._trim = 0.0

    def start(self, row: Row) -> None:
        """Go on from what the boat does by herself."""
        rate = max(-self._most, min(self._most, row.course_rate))
        self._shaper.start(row.cog, rate if math.isfinite(rate) else 0.0)
        self._speed.restart()
        self._trim = 0.0

    def step(self, row: Row, leg: Leg, fix_interval: float, dt: float) -> Command:
        """The command for a row; an unknown course is steered by the reference alone."""
        reference = self._shaper.step(Reference(leg.course_to_steer, 0.0, 0.0), dt)
        gain = self.gain(row.sog, fix_interval)
        error = _known(wrap(row.cog - reference.angle))
        yaw_rate = max(-self._most, min(self._most, reference.rate - gain * error))
        speed = max(self._slowest, leg.speed * _slowing(wrap(leg.course_to_steer - reference.angle)))
        force = self._speed.step(speed, row.sog, dt)
        moment = self._moment(yaw_rate, reference.acceleration, row.course_rate, gain, dt)
        driven = self._propellers.step(2.0 * force, moment)
        self._speed.limited_to(0.5 * driven.surge_force)
        return Command(yaw_rate, force, driven.port, driven.starboard, leg.course_to_steer, speed)

    def gain(self, speed: float, fix_interval: float) -> float:
        """Yaw rate for a course error, 1/s, as the estimate at a speed from fixes of an interval (s) allows."""
        profile = self._profile
        if not (speed > 0.0 and fix_interval > 0.0):
            return 0.0
        noise = profile.agility
        carried = carried_bandwidth(speed, noise, profile.position_std, fix_interval)
        return min(QUICKEST, yaw_rate_gain(carried))

    def _moment(self, yaw_rate, acceleration, course_rate, gain, dt):
        """Share of the full moment that gives a yaw rate: what it takes by itself, and PI on what is seen of it."""
        error = _known(yaw_rate - course_rate) / self._answer
        wanted = (yaw_rate + self._yaw_time * acceleration) / self._answer + self._trim + _DAMPING * error
        push = _TRIMMING * gain * error * dt
        if abs(wanted) < self._propellers.max_moment or push * wanted <= 0.0:
            self._trim += push
        return wanted


def _known(value):
    return value if math.isfinite(value) else 0.0


def _slowing(turn):
    """Share of the asked speed with a turn of so much ahead."""
    return max(_SLOWEST_TURN, math.cos(turn))
