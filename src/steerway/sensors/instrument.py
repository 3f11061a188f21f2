"""A scalar instrument: rate, scale, Gauss–Markov bias, white noise. Other instruments are built on it.

As with the GNSS receiver, a whole record (`measured`) and single steps in a loop (`start`) draw the same numbers in the
same order.
"""

import math
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive, positive_or_unlimited
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.kinematics import GroundMotion
from steerway.core.noise import Seed, markov_decay, markov_step
from steerway.core.settings import Rate, Table

_BLOCK = 128  # readings drawn at once in a loop; the numbers do not depend on it


@dataclass(frozen=True)
class Instrument:
    """Error model of an instrument: the true value times `scale`, plus constant and Gauss–Markov bias and white noise.

    `rate` Hz; `turn_on_std` 1σ of a bias drawn once; `wander` (1σ, time constant s) of a Gauss–Markov bias; `white` 1σ
    of one reading. Units are the value's. Raises InputError for a rate that is not positive and for negative
    deviations.
    """

    rate: float = 10.0
    white: float = 0.0
    bias: float = 0.0
    turn_on_std: float = 0.0
    wander: tuple[float, float] = (0.0, 1.0)
    scale: float = 1.0

    def __post_init__(self) -> None:
        positive("instrument.rate", self.rate)
        for name, value in (("white", self.white), ("turn_on_std", self.turn_on_std), ("wander", self.wander[0])):
            not_negative(f"instrument.{name}", value)
        positive_or_unlimited("time constant in instrument.wander", self.wander[1])

    def start(self, seed: Seed) -> "InstrumentStream":
        """Start a stream of readings."""
        return InstrumentStream(self, seed)

    def measured(self, time: ArrayLike, value: ArrayLike, seed: Seed) -> tuple[np.ndarray, np.ndarray]:
        """(times, readings) of a record of true values (n,), each at the first sample at or after its due time."""
        time = np.asarray(time, dtype=np.float64)
        value = np.broadcast_to(np.asarray(value, dtype=np.float64), time.shape)
        chosen = epochs(time, self.rate)
        return time[chosen], self.scale * value[chosen] + _Errors(self, seed).draw(len(chosen))


class InstrumentStream:
    """A running instrument: pass the true value at every step; the result is a reading when one is due, else None."""

    def __init__(self, instrument: Instrument, seed: Seed) -> None:
        self._scale = instrument.scale
        self._clock = Clock(instrument.rate)
        self._errors = _Errors(instrument, seed).each()

    def step(self, time: float, value: float) -> float | None:
        return self._scale * value + next(self._errors) if self._clock.due(time) else None


class _Errors:
    """The error sequence, continued from block to block."""

    def __init__(self, instrument: Instrument, seed: Seed) -> None:
        self._draws = np.random.default_rng(seed)
        turn_on, wander = self._draws.standard_normal(2)
        std, time_constant = instrument.wander
        self._bias = instrument.bias + instrument.turn_on_std * turn_on
        self._wander = std * wander
        self._model = (instrument.white, std, markov_decay(time_constant, 1.0 / instrument.rate))

    def draw(self, n: int) -> np.ndarray:
        errors, self._wander = _draw(self._draws.standard_normal((n, 2)), self._bias, self._wander, *self._model)
        return errors

    def each(self) -> Iterator[float]:
        while True:
            yield from self.draw(_BLOCK).tolist()


@kernel
def _draw(normals: Floats, bias: float, wander: float, white: float, std: float, decay: float) -> tuple[Floats, float]:
    errors = np.empty(len(normals))
    for k in range(len(normals)):
        errors[k] = bias + wander + white * normals[k, 0]
        wander = markov_step(wander, decay, std, normals[k, 1])
    return errors, wander


class InstrumentTable(Table):
    """Table of an instrument in a scenario, under its name in `kinds.INSTRUMENTS`.

    `measures` is the field of `core.estimate.Measurements` that the instrument fills, and the name of the aid.
    """

    measures: ClassVar[str]
    rate: Annotated[Rate, "Hz"] = 10.0
    """Readings per second."""

    @abstractmethod
    def build(self) -> Any:
        """The instrument: an object whose `start(seed)` gives a stream."""

    @staticmethod
    @abstractmethod
    def read(stream: Any, time: float, motion: GroundMotion) -> float | None:
        """The stream's measurement for a vessel's motion; None when none is due."""


SLACK = 1e-3  # tolerance, in periods: sums of time steps have rounding errors


class Clock:
    """Decides at every step whether a reading is due; periods are counted from the first."""

    def __init__(self, rate: float):
        self._rate = rate
        self._began: float | None = None
        self._next = -math.inf

    def due(self, time: float) -> bool:
        if time < self._next:
            return False
        if self._began is None:
            self._began = time
        count = math.floor((time - self._began) * self._rate + SLACK)
        self._next = self._began + (count + 1.0 - SLACK) / self._rate
        return True


def epochs(time: np.ndarray, rate: float) -> np.ndarray:
    """Indices of the samples (n,) at which a `Clock` is due.

    Raises InputError when the time does not rise or the samples are further apart than the readings.
    """
    if len(time) == 0:
        return np.zeros(0, dtype=np.int64)
    steps = np.diff(time)
    if len(steps) and not steps.min() > 0.0:
        raise InputError("the time of the true motion does not rise, expected rising seconds")
    if len(steps) and steps.max() * rate > 1.0 + SLACK:
        raise InputError(f"the true motion has steps of {steps.max():g} s, expected at least every {1.0 / rate:g} s")
    count = np.floor((time - time[0]) * rate + SLACK)
    return np.flatnonzero(np.diff(count, prepend=-1.0) > 0.0)
