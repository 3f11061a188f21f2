"""Speed sensors: Doppler logs along and across the hull, through the water or over ground, and the tachometer."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.kinematics import GroundMotion
from steerway.core.noise import Seed
from steerway.core.settings import NotNegative, Number, Positive, Rate
from steerway.sensors.instrument import Instrument, InstrumentStream, InstrumentTable

FIVE_CENTIMETRES = Instrument(rate=5.0, white=0.05)


@dataclass(frozen=True)
class DopplerLog:
    """A Doppler log of surge and sway, m/s, with independent errors of equal size on both axes.

    Pass the velocity through the water (`GroundMotion.surge`, `.sway`), or for a log with bottom lock the velocity over
    ground in the body frame (`kinematics.in_body`).
    """

    instrument: Instrument = FIVE_CENTIMETRES

    def start(self, seed: Seed) -> "DopplerStream":
        """Start a stream of readings."""
        return DopplerStream(self, seed)

    def measured(
        self, time: ArrayLike, surge: ArrayLike, sway: ArrayLike, seed: Seed
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(times, surge, sway) measured from a record of true velocities (n,)."""
        along, across = np.random.default_rng(seed).spawn(2)
        time_read, surge = self.instrument.measured(time, surge, along)
        return time_read, surge, self.instrument.measured(time, sway, across)[1]


class DopplerStream:
    """A running log: (surge, sway) when a reading is due, else None."""

    def __init__(self, log: DopplerLog, seed: Seed) -> None:
        along, across = np.random.default_rng(seed).spawn(2)
        self._along, self._across = log.instrument.start(along), log.instrument.start(across)

    def step(self, time: float, surge: float, sway: float) -> tuple[float, float] | None:
        along, across = self._along.step(time, surge), self._across.step(time, sway)
        return None if along is None or across is None else (along, across)


class LogTable(InstrumentTable):
    """A log of the speed through the water: the true speed times `scale`, plus bias and white noise."""

    measures: ClassVar[str] = "water_speed"
    rate: Annotated[Rate, "Hz"] = 5.0
    std: Annotated[NotNegative, "m/s"] = 0.05
    """1σ of the white noise of a reading."""
    bias: Annotated[Number, "m/s"] = 0.0
    """Constant error of a reading."""
    scale: Annotated[Positive, "1"] = 1.0
    """Scale factor of a reading."""

    def build(self) -> DopplerLog:
        return DopplerLog(Instrument(self.rate, white=self.std, bias=self.bias, scale=self.scale))

    @staticmethod
    def read(stream: DopplerStream, time: float, motion: GroundMotion) -> float | None:
        velocity = stream.step(time, motion.surge, motion.sway)
        return None if velocity is None else velocity[0]


class BottomLogTable(LogTable):
    """A Doppler log with bottom lock, which measures the speed over ground along the hull."""

    measures: ClassVar[str] = "bottom_speed"
    rate: Annotated[Rate, "Hz"] = 10.0
    std: Annotated[NotNegative, "m/s"] = 0.002

    @staticmethod
    def read(stream: DopplerStream, time: float, motion: GroundMotion) -> float | None:
        velocity = stream.step(time, motion.along, 0.0)
        return None if velocity is None else velocity[0]


class TachometerTable(InstrumentTable):
    """A tachometer on the propeller shaft, only for vessels whose model has a shaft."""

    measures: ClassVar[str] = "shaft"
    std: Annotated[NotNegative, "rev/s"] = 0.02
    """1σ of the white noise of a reading."""

    def build(self) -> Instrument:
        return Instrument(self.rate, white=self.std)

    @staticmethod
    def read(stream: InstrumentStream, time: float, motion: GroundMotion) -> float | None:
        return stream.step(time, motion.shaft)
