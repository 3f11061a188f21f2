"""The declaration of an instrument for scenarios: its keys, how it is built, and what it measures."""

from abc import abstractmethod
from typing import Any, ClassVar

from steerway.core.kinematics import GroundMotion
from steerway.core.schema import Rate, Table


class InstrumentTable(Table):
    """A scenario's table of an instrument, under its name in `kinds.INSTRUMENTS`.

    `measures` is the field of `core.estimate.Measurements` that it gives, which is also the name of the aid.
    """

    measures: ClassVar[str]
    rate: Rate

    @abstractmethod
    def build(self) -> Any:
        """The instrument: an object whose `start(seed)` gives a stream."""

    @staticmethod
    @abstractmethod
    def read(stream: Any, time: float, motion: GroundMotion) -> float | None:
        """The stream's measurement of a vessel that moves so; None when none is due."""
