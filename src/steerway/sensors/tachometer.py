"""A sensor of the shaft's speed."""

from typing import Annotated, ClassVar

from steerway.core.kinematics import GroundMotion
from steerway.core.settings import NotNegative, Rate
from steerway.sensors.instrument import Instrument, InstrumentStream, InstrumentTable


class TachometerTable(InstrumentTable):
    """The keys of a tachometer in a scenario; `std` in rev/s. Only vessels whose model has a shaft can have one."""

    measures: ClassVar[str] = "shaft"
    rate: Annotated[Rate, "Hz"] = 10.0
    std: Annotated[NotNegative, "rev/s"] = 0.02

    def build(self) -> Instrument:
        return Instrument(self.rate, white=self.std)

    @staticmethod
    def read(stream: InstrumentStream, time: float, motion: GroundMotion) -> float | None:
        return stream.step(time, motion.shaft)
