"""All instruments aboard: from true motion to measurements."""

import math
from typing import Any

import numpy as np

from steerway.core.checks import one_of
from steerway.core.estimate import NO_MEASUREMENTS, Measurements
from steerway.core.kinematics import GroundMotion, WaveMotion
from steerway.core.noise import Seed
from steerway.sensors.gnss import Gnss
from steerway.sensors.kinds import INSTRUMENTS


class Suite:
    """A receiver and further instruments, by name or in the order of `kinds.INSTRUMENTS`; None: not aboard. Attributes:
    `gnss`; `aboard`, the further instruments by name; each of them by its name, None if not aboard. Raises InputError
    for an unknown name.
    """

    def __init__(self, gnss: Gnss, *in_order: Any, **named: Any):
        for name in named:
            one_of("instrument", name, tuple(INSTRUMENTS))
        given = dict(zip(INSTRUMENTS, in_order, strict=False)) | named
        self.gnss = gnss
        self.aboard = {name: given[name] for name in INSTRUMENTS if given.get(name) is not None}

    def __getattr__(self, name: str) -> Any:
        if name not in INSTRUMENTS:
            raise AttributeError(f"a suite has no attribute {name!r}")
        return self.aboard.get(name)

    def start(self, seed: Seed) -> "SuiteStream":
        """Start all instruments; each has a random stream of its own."""
        return SuiteStream(self, seed)


class SuiteStream:
    """Running instruments; `step` returns the new measurements."""

    def __init__(self, suite: Suite, seed: Seed) -> None:
        first, *seeds = np.random.default_rng(seed).spawn(1 + len(INSTRUMENTS))
        self._gnss = suite.gnss.start(first)
        self._further = [
            (table.measures, table.read, suite.aboard[name].start(each))
            for (name, table), each in zip(INSTRUMENTS.items(), seeds, strict=True)
            if name in suite.aboard
        ]

    def step(self, time: float, motion: GroundMotion, waves: WaveMotion) -> Measurements:
        """The measurements for a vessel's motion; waves move the antenna in addition."""
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
        measured = {}
        for quantity, read, stream in self._further:
            value = read(stream, time, motion)
            if value is not None:
                measured[quantity] = value
        if fix is None and not measured:
            return NO_MEASUREMENTS
        epoch, north, east, sog, cog = fix or (time, *(math.nan,) * 4)
        return Measurements(north, east, sog, cog, **measured, age=max(time - epoch, 0.0))


class Truth:
    """Instruments without errors, read at every step: for control on true states."""

    def start(self, seed: Seed) -> "Truth":
        """The object itself; it uses no random numbers."""
        return self

    def step(self, time: float, motion: GroundMotion, waves: WaveMotion) -> Measurements:
        """The true motion over ground and through the water, as measurements."""
        return Measurements(
            motion.north,
            motion.east,
            motion.sog,
            motion.cog,
            motion.course_rate,
            motion.heading,
            motion.yaw_rate,
            motion.surge,
            motion.along,
            math.nan,
            motion.shaft,
        )
