"""A magnetic compass: true heading, with deviation that depends on the heading, bias and noise."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.kinematics import GroundMotion
from steerway.core.noise import Seed
from steerway.core.settings import NotNegative, Number, Rate
from steerway.sensors.instrument import Instrument, InstrumentTable

if TYPE_CHECKING:
    from steerway.sensors.tcm2 import TickingCompass

HALF_A_DEGREE = Instrument(white=math.radians(0.5))


@dataclass(frozen=True)
class Compass:
    """A compass that has been corrected for variation. All rad.

    `deviation` are the coefficients A to E of a deviation card: A + B sin ψ + C cos ψ + D sin 2ψ + E cos 2ψ is added to
    the heading ψ. `instrument` adds rate, bias and noise.
    """

    instrument: Instrument = HALF_A_DEGREE
    deviation: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def start(self, seed: Seed) -> "CompassStream":
        """The compass switched on."""
        return CompassStream(self, seed)

    def measured(self, time: ArrayLike, heading: ArrayLike, seed: Seed) -> tuple[np.ndarray, np.ndarray]:
        """Times and headings in [−π, π) of a whole record of true headings (n,)."""
        heading = np.asarray(heading, dtype=np.float64)
        read = heading + deviation(heading, *self.deviation)
        time, reading = self.instrument.measured(time, read, seed)
        return time, _wrapped(reading)


class CompassStream:
    """A compass that is switched on: a heading in [−π, π) when one is due, else None."""

    def __init__(self, compass: Compass, seed: Seed) -> None:
        self._deviation = compass.deviation
        self._readings = compass.instrument.start(seed)

    def step(self, time: float, heading: float) -> float | None:
        reading = self._readings.step(time, heading + deviation(heading, *self._deviation))
        return None if reading is None else wrap(reading)


@kernel
def deviation(heading: Any, a: float, b: float, c: float, d: float, e: float) -> Any:
    """The deviation for a heading, or an array of them, by a deviation card; rad."""
    return a + b * np.sin(heading) + c * np.cos(heading) + d * np.sin(2.0 * heading) + e * np.cos(2.0 * heading)


@kernel
def _wrapped(angles: Floats) -> Floats:
    for k in range(len(angles)):
        angles[k] = wrap(angles[k])
    return angles


class CompassTable(InstrumentTable):
    """The keys of a compass in a scenario; `deviation_deg` are the coefficients A to E of its deviation card.

    `dynamics`: a1, a2, b and k of a compass as P4's, ticking at 40 Hz with the noise of (6)–(7) in place of `std_deg`
    and `bias_deg`; the TCM2 has 0.2796, 0.6971, 0.4364, 0.05339.
    """

    measures: ClassVar[str] = "heading"
    rate: Annotated[Rate, "Hz"] = 10.0
    std_deg: NotNegative = 0.5
    bias_deg: Number = 0.0
    deviation_deg: tuple[Number, Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0, 0.0)
    dynamics: Annotated[tuple[Number, Number, Number, Number] | None, "1"] = None

    def build(self) -> "Compass | TickingCompass":
        a, b, c, d, e = map(math.radians, self.deviation_deg)
        if self.dynamics is not None:
            from steerway.estimation.heading.models import CompassModel
            from steerway.sensors.tcm2 import DynamicCompass, TickingCompass

            return TickingCompass(DynamicCompass(CompassModel(*self.dynamics), (a, b, c, d, e)), self.rate)
        instrument = Instrument(self.rate, white=math.radians(self.std_deg), bias=math.radians(self.bias_deg))
        return Compass(instrument, (a, b, c, d, e))

    @staticmethod
    def read(stream: CompassStream, time: float, motion: GroundMotion) -> float | None:
        return stream.step(time, motion.heading)
