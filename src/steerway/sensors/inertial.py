"""Gyro and accelerometer models in the terms of data sheets: noise density, turn-on bias, in-run bias."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from steerway.core.earth import STANDARD_GRAVITY
from steerway.core.kinematics import GroundMotion
from steerway.core.noise import Seed
from steerway.core.settings import NotNegative, Positive, Rate
from steerway.sensors.instrument import Instrument, InstrumentStream, InstrumentTable


def gyro(
    rate: float = 50.0,
    noise_density_deg: float = 0.005,
    turn_on_deg: float = 0.5,
    in_run_deg_hour: float = 10.0,
    in_run_time: float = 300.0,
) -> Instrument:
    """A yaw-rate gyro, rad/s. Noise in °/s/√Hz, turn-on bias in °/s, Gauss–Markov in-run bias in °/h and s."""
    return Instrument(
        rate=rate,
        white=math.radians(noise_density_deg) * math.sqrt(rate),
        turn_on_std=math.radians(turn_on_deg),
        wander=(math.radians(in_run_deg_hour) / 3600.0, in_run_time),
    )


def accelerometer(
    rate: float = 50.0,
    noise_density_micro_g: float = 60.0,
    turn_on_milli_g: float = 5.0,
    in_run_micro_g: float = 5.0,
    in_run_time: float = 300.0,
) -> Instrument:
    """An accelerometer, m/s². Noise in µg/√Hz, turn-on bias in mg, Gauss–Markov in-run bias in µg and s.

    Its input is the specific force, which contains gravity if the hull pitches or rolls.
    """
    return Instrument(
        rate=rate,
        white=noise_density_micro_g * 1e-6 * STANDARD_GRAVITY * math.sqrt(rate),
        turn_on_std=turn_on_milli_g * 1e-3 * STANDARD_GRAVITY,
        wander=(in_run_micro_g * 1e-6 * STANDARD_GRAVITY, in_run_time),
    )


class GyroTable(InstrumentTable):
    """A yaw-rate gyro: white noise, a constant bias and a slowly varying one."""

    measures: ClassVar[str] = "yaw_rate"
    rate: Annotated[Rate, "Hz"] = 50.0
    noise_density_deg: Annotated[NotNegative, "°/√s"] = 0.005
    """Noise density."""
    turn_on_deg: Annotated[NotNegative, "°/s"] = 0.5
    """1σ of the turn-on bias."""
    in_run_deg_hour: NotNegative = 10.0
    """1σ of the in-run bias, a Gauss–Markov process."""

    def build(self) -> Instrument:
        return gyro(**self.model_dump())

    @staticmethod
    def read(stream: InstrumentStream, time: float, motion: GroundMotion) -> float | None:
        return stream.step(time, motion.yaw_rate)


@dataclass(frozen=True)
class Accelerometer:
    """A surge accelerometer. `leak` is the Gauss–Markov error from gravity while the hull pitches."""

    instrument: Instrument
    leak: Instrument

    def start(self, seed: Seed) -> "AccelerometerStream":
        """Start a stream of readings."""
        return AccelerometerStream(self, seed)


class AccelerometerStream:
    """A running accelerometer: the mean acceleration since its last reading when one is due, else None."""

    def __init__(self, accelerometer: Accelerometer, seed: Seed) -> None:
        own, leak = np.random.default_rng(seed).spawn(2)
        self._own, self._leak = accelerometer.instrument.start(own), accelerometer.leak.start(leak)
        self._last = (math.nan, math.nan)

    def step(self, time: float, speed: float) -> float | None:
        before, then = self._last
        mean = (speed - then) / (time - before) if time > before else 0.0
        error = self._leak.step(time, 0.0)
        reading = self._own.step(time, mean)
        if reading is None or error is None:
            return None
        self._last = (time, speed)
        return reading + error


class AccelerometerTable(InstrumentTable):
    """An accelerometer along the hull."""

    measures: ClassVar[str] = "acceleration"
    rate: Annotated[Rate, "Hz"] = 50.0
    noise_density_micro_g: Annotated[NotNegative, "µg/√Hz"] = 60.0
    """Noise density."""
    turn_on_milli_g: Annotated[NotNegative, "mg"] = 5.0
    """1σ of the turn-on bias."""
    in_run_micro_g: Annotated[NotNegative, "µg"] = 5.0
    """1σ of the in-run bias, a Gauss–Markov process."""
    leak_std: Annotated[NotNegative, "m/s²"] = 0.0034
    """1σ of the gravity component along the pitching hull."""
    leak_time: Annotated[Positive, "s"] = 5.0
    """Time constant of the gravity component."""

    def build(self) -> Accelerometer:
        keys = self.model_dump(exclude={"leak_std", "leak_time"})
        leak = Instrument(rate=self.rate, wander=(self.leak_std, self.leak_time))
        return Accelerometer(accelerometer(**keys), leak)

    @staticmethod
    def read(stream: AccelerometerStream, time: float, motion: GroundMotion) -> float | None:
        return stream.step(time, motion.along)
