"""A simple boat for tests of guidance and control, and records of a weaving Springer with compass and velocities."""

import math

import numpy as np

from steerway.sensors import TRUE_TCM2, DynamicCompass
from steerway.vessels import RPM, Springer, conditions


class Nomoto:
    """T ω̇ + ω = K u + disturbance: course rate ω, and constant speed along the course."""

    def __init__(self, gain, time_constant, speed=0.0, course=0.0, north=0.0, east=0.0, disturbance=0.0):
        self.gain, self.time_constant, self.speed, self.disturbance = gain, time_constant, speed, disturbance
        self.course, self.rate, self.north, self.east = course, 0.0, north, east

    def step(self, control, dt):
        self.north += dt * self.speed * math.cos(self.course)
        self.east += dt * self.speed * math.sin(self.course)
        self.course += dt * self.rate
        self.rate += dt * (self.gain * control + self.disturbance - self.rate) / self.time_constant


def record(
    seconds=60, compass=TRUE_TCM2, plant="paper", current=(0.0, 0.15), seed=0, heading=0.0, card=(0.0,) * 5, **vessel
):
    """(propeller speed differences, compass readings, headings, velocities) of a weaving run, one per second."""
    rng = np.random.default_rng(seed)
    boat, stream = Springer(plant, **vessel), DynamicCompass(compass, card).start(heading, rng)
    state, around, rows = boat.start(heading=heading), conditions(current), []
    for k in range(seconds):
        difference = 60.0 * RPM * math.sin(k / 15.0)
        motion = boat.motion(state, around)
        velocity = (
            motion.north_velocity + 0.1 * rng.standard_normal(),
            motion.east_velocity + 0.1 * rng.standard_normal(),
        )
        rows.append((difference, stream.second(boat.heading(state)), boat.heading(state), velocity))
        state = boat.step(state, (difference,), around, 1.0)
    return tuple(zip(*rows, strict=True))
