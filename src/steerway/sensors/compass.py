"""Magnetic compasses: true heading with deviation, bias and noise.

`DynamicCompass` is the TCM2 as identified: x(k+1) = A x(k) + B ψ(k) + ω, z = C x + υ at 40 Hz, angles in degrees; P4
(5)–(8). The second state is the first, one tick late. The gain multiplies the angle, so readings depend on the number
of full turns: the paper's compass reads unwrapped headings. A real compass has a `deviation` card instead.
"""

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap, wrap_array
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.kinematics import GroundMotion
from steerway.core.noise import Seed
from steerway.core.settings import NotNegative, Number
from steerway.estimation.heading.models import READING_VARIANCE_DEG2, TCM2, TICKS, CompassModel
from steerway.sensors.instrument import SLACK, Clock, Instrument, InstrumentTable

HALF_A_DEGREE = Instrument(white=math.radians(0.5))


@dataclass(frozen=True)
class Compass:
    """A compass corrected for magnetic variation. All angles in rad.

    `deviation` are the coefficients A to E of a deviation card: A + B sin ψ + C cos ψ + D sin 2ψ + E cos 2ψ is added to
    the heading ψ. `instrument` adds rate, bias and noise.
    """

    instrument: Instrument = HALF_A_DEGREE
    deviation: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def start(self, seed: Seed) -> "CompassStream":
        """Start a stream of readings."""
        return CompassStream(self, seed)

    def measured(self, time: ArrayLike, heading: ArrayLike, seed: Seed) -> tuple[np.ndarray, np.ndarray]:
        """(times, headings in [−π, π)) measured from a record of true headings (n,)."""
        heading = np.asarray(heading, dtype=np.float64)
        read = heading + deviation(heading, *self.deviation)
        time, reading = self.instrument.measured(time, read, seed)
        return time, wrap_array(reading)


class CompassStream:
    """A running compass: a heading in [−π, π) when a reading is due, else None."""

    def __init__(self, compass: Compass, seed: Seed) -> None:
        self._deviation = compass.deviation
        self._readings = compass.instrument.start(seed)

    def step(self, time: float, heading: float) -> float | None:
        reading = self._readings.step(time, heading + deviation(heading, *self._deviation))
        return None if reading is None else wrap(reading)


@kernel
def deviation(heading: Any, a: float, b: float, c: float, d: float, e: float) -> Any:
    """Deviation (rad) at a heading, or an array of headings, from the coefficients of a deviation card."""
    return a + b * np.sin(heading) + c * np.cos(heading) + d * np.sin(2.0 * heading) + e * np.cos(2.0 * heading)


@dataclass(frozen=True)
class DynamicCompass:
    """A TCM2 compass for closed-loop simulation.

    model: its dynamics. card: deviation coefficients A to E, rad. wrapped: whether readings lie in [−π, π); the paper's
    are unwrapped.
    """

    model: CompassModel = TCM2
    card: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    wrapped: bool = False
    _constants: np.ndarray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.model.stable:
            raise InputError(f"compass.model {tuple(self.model)} is unstable, expected poles inside the unit circle")
        object.__setattr__(self, "_constants", np.array(self.model, dtype=np.float64))

    def start(self, heading: float, seed: Seed) -> "DynamicCompassStream":
        """Start a stream of readings, at rest at a heading (rad)."""
        return DynamicCompassStream(self, heading, seed)


class DynamicCompassStream:
    """A running compass: `readings` returns its readings (rad) at 40 Hz for a constant heading."""

    def __init__(self, compass: DynamicCompass, heading: float, seed: Seed) -> None:
        self._compass = compass
        self._rng = np.random.default_rng(seed)
        model = compass.model
        settled = model.b * self._seen(heading) / (1.0 - model.a1 - model.shift * model.a2)
        self._state = np.array([settled, model.shift * settled])

    def second(self, heading: float) -> np.ndarray:
        """(40,) readings, rad; the heading is constant during the second, as in P4."""
        return self.readings(heading, TICKS)

    def readings(self, heading: float, ticks: int) -> np.ndarray:
        """(ticks,) readings, rad, at a constant heading."""
        readings = np.empty(ticks)
        noise = self._rng.standard_normal((ticks, 3))
        _ticks(self._compass._constants, self._state, self._seen(heading), noise, readings)
        readings = np.radians(readings)
        return np.array([wrap(each) for each in readings]) if self._compass.wrapped else readings

    def _seen(self, heading: float) -> float:
        return math.degrees(heading + deviation(heading, *self._compass.card))


@dataclass(frozen=True)
class TickingCompass:
    """A dynamic compass as a scenario's instrument, which gives its latest reading in [−π, π) `rate` times a second."""

    compass: DynamicCompass
    rate: float

    def start(self, seed: Seed) -> "TickingCompassStream":
        """Start a stream of readings, at rest at the heading of its first step."""
        return TickingCompassStream(self, seed)


class TickingCompassStream:
    """A running compass: a heading in [−π, π) when a reading is due, else None."""

    def __init__(self, compass: TickingCompass, seed: Seed):
        self._compass, self._seed = compass.compass, seed
        self._clock = Clock(compass.rate)
        self._stream: DynamicCompassStream | None = None
        self._began = self._turned = self._reading = 0.0
        self._ticks = 0

    def step(self, time: float, heading: float) -> float | None:
        """The reading in [−π, π) at a time (s) for a true heading (rad); None when none is due."""
        if self._stream is None:
            self._stream, self._began, self._turned = self._compass.start(heading, self._seed), time, heading
            self._ticks = -1
        self._turned += wrap(heading - self._turned)
        due = math.floor((time - self._began) * TICKS + SLACK)
        if due > self._ticks:
            self._reading = self._stream.readings(self._turned, due - self._ticks).item(-1)
            self._ticks = due
        return wrap(self._reading) if self._clock.due(time) else None


@kernel
def _ticks(model: Floats, state: Floats, heading_deg: float, noise: Floats, readings: Floats) -> None:
    for k in range(len(readings)):
        first = model[0] * state[0] + model[1] * state[1] + model[2] * heading_deg + noise[k, 0]
        state[1] = model[4] * state[0] + noise[k, 1]
        state[0] = first
        readings[k] = model[3] * first + math.sqrt(READING_VARIANCE_DEG2) * noise[k, 2]


class CompassTable(InstrumentTable):
    """A compass. With `dynamics` it runs at 40 Hz with the noise of P4 (6)–(7); a1, a2, b and k of the TCM2 are 0.2796,
    0.6971, 0.4364 and 0.05339.
    """

    measures: ClassVar[str] = "heading"
    std_deg: NotNegative = 0.5
    """1σ of the white noise of a reading."""
    bias_deg: Number = 0.0
    """Constant error of a reading."""
    deviation_deg: tuple[Number, Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Coefficients A to E of the deviation card: A + B sin ψ + C cos ψ + D sin 2ψ + E cos 2ψ."""
    dynamics: Annotated[tuple[Number, Number, Number, Number] | None, "1"] = None
    """Parameters a1, a2, b and k of the compass model of P4, in place of `std_deg` and `bias_deg`."""

    def build(self) -> Compass | TickingCompass:
        a, b, c, d, e = map(math.radians, self.deviation_deg)
        if self.dynamics is not None:
            return TickingCompass(DynamicCompass(CompassModel(*self.dynamics), (a, b, c, d, e)), self.rate)
        instrument = Instrument(self.rate, white=math.radians(self.std_deg), bias=math.radians(self.bias_deg))
        return Compass(instrument, (a, b, c, d, e))

    @staticmethod
    def read(stream: CompassStream, time: float, motion: GroundMotion) -> float | None:
        return stream.step(time, motion.heading)
