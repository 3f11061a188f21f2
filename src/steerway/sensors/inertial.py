"""Gyro and accelerometer by the terms of data sheets: noise density, turn-on bias, in-run bias."""

import math
from typing import ClassVar

from steerway.core.schema import NotNegative, Rate
from steerway.sensors.instrument import Instrument
from steerway.sensors.table import InstrumentTable

STANDARD_GRAVITY = 9.80665


def gyro(
    rate: float = 50.0,
    noise_density_deg: float = 0.005,
    turn_on_deg: float = 0.5,
    in_run_deg_hour: float = 10.0,
    in_run_time: float = 300.0,
) -> Instrument:
    """A yaw-rate gyro in rad/s: °/s/√Hz, °/s, °/h and the time constant (s) of its Gauss–Markov bias."""
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
    """An accelerometer in m/s²: µg/√Hz, mg, µg and the time constant (s) of its Gauss–Markov bias.

    Its input is the specific force, which contains gravity where the hull pitches or rolls.
    """
    return Instrument(
        rate=rate,
        white=noise_density_micro_g * 1e-6 * STANDARD_GRAVITY * math.sqrt(rate),
        turn_on_std=turn_on_milli_g * 1e-3 * STANDARD_GRAVITY,
        wander=(in_run_micro_g * 1e-6 * STANDARD_GRAVITY, in_run_time),
    )


class GyroTable(InstrumentTable):
    """The keys of a yaw-rate gyro in a scenario."""

    measures: ClassVar[str] = "yaw_rate"
    rate: Rate = 50.0
    noise_density_deg: NotNegative = 0.005
    turn_on_deg: NotNegative = 0.5
    in_run_deg_hour: NotNegative = 10.0

    def build(self) -> Instrument:
        return gyro(**self.model_dump())

    @staticmethod
    def read(stream, time, motion) -> float | None:
        return stream.step(time, motion.yaw_rate)
