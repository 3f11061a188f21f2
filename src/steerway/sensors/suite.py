"""The instruments aboard, asked together: true motion in, readings out."""

import math
from dataclasses import dataclass

import numpy as np

from steerway.core.estimate import NO_MEASUREMENTS, Measurements
from steerway.sensors.compass import Compass
from steerway.sensors.doppler import DopplerLog
from steerway.sensors.gnss import Gnss
from steerway.sensors.instrument import Instrument
from steerway.vessels.environment import WaveMotion
from steerway.vessels.kinematics import GroundMotion


@dataclass(frozen=True)
class Suite:
    """Instruments aboard; None is not aboard. `gyro` reads the yaw rate, `log` the speed through the water."""

    gnss: Gnss
    compass: Compass | None = None
    gyro: Instrument | None = None
    log: DopplerLog | None = None

    def start(self, seed) -> "SuiteStream":
        """Everything switched on. `seed`: an int or a numpy Generator; each instrument draws numbers of its own."""
        return SuiteStream(self, seed)


class SuiteStream:
    """Instruments that are switched on; `step` gives what is new."""

    def __init__(self, suite: Suite, seed):
        seeds = np.random.default_rng(seed).spawn(4)
        self._gnss = suite.gnss.start(seeds[0])
        self._compass = suite.compass and suite.compass.start(seeds[1])
        self._gyro = suite.gyro and suite.gyro.start(seeds[2])
        self._log = suite.log and suite.log.start(seeds[3])

    def step(self, time: float, motion: GroundMotion, waves: WaveMotion) -> Measurements:
        """Measurements of a vessel that moves so; the antenna swings with the waves."""
        fix = self._gnss.step(
            time,
            motion.north + waves.north,
            motion.east + waves.east,
            motion.roll + waves.roll,
            motion.pitch + waves.pitch,
            motion.heading,
            motion.north_velocity,
            motion.east_velocity,
        )
        heading = self._compass and self._compass.step(time, motion.heading)
        yaw_rate = self._gyro and self._gyro.step(time, motion.yaw_rate)
        along = self._log and self._log.step(time, motion.surge, motion.sway)
        if fix is None and heading is None and yaw_rate is None and along is None:
            return NO_MEASUREMENTS
        _, north, east, sog, cog = fix or (math.nan,) * 5
        return Measurements(
            north,
            east,
            sog,
            cog,
            heading=math.nan if heading is None else heading,
            yaw_rate=math.nan if yaw_rate is None else yaw_rate,
            water_speed=along[0] if along else math.nan,
        )


class Truth:
    """Instruments that show the true motion at every step: for control on true states."""

    def start(self, seed) -> "Truth":
        """Nothing is drawn."""
        return self

    def step(self, time: float, motion: GroundMotion, waves: WaveMotion) -> Measurements:
        """The truth, over ground and through the water."""
        return Measurements(
            motion.north,
            motion.east,
            motion.sog,
            motion.cog,
            motion.course_rate,
            motion.heading,
            motion.yaw_rate,
            motion.surge,
        )
