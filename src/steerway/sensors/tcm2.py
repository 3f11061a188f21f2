"""The TCM2 compass as identified: x(k+1) = A x(k) + B ψ(k) + ω, z = C x + υ at 40 Hz, angles in degrees; P4 (5)–(8).

Its second state is the first, a tick late. A gain on an angle depends on how many turns were made, so the paper's
compass reads unwrapped headings; the `deviation` card is what a real installation does instead.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.noise import Seed
from steerway.sensors.compass import deviation

TICK = 0.025
TICKS = 40
"""Ticks in a second."""
READING_VARIANCE_DEG2 = 2.0
STATE_VARIANCE = 1.0
"""P4 (7): 2° as a variance, and one of each state's own noise."""


class CompassModel(NamedTuple):
    """Coefficients of P4 (7)."""

    a1: float
    a2: float
    b: float
    k: float
    shift: float = 1.0  # the "1" of A

    def scaled(self, factor: float, shift_too: bool = False) -> "CompassModel":
        """All coefficients times a factor; the shift entry stays exact by default."""
        shift = self.shift * factor if shift_too else self.shift
        return CompassModel(*(factor * each for each in self[:4]), shift)

    @property
    def gain(self) -> float:
        """What the compass reads for a standing heading of 1."""
        return self.k * self.b / (1.0 - self.a1 - self.shift * self.a2)

    @property
    def stable(self) -> bool:
        """Whether both poles of z² − a1 z − s a2 lie inside the unit circle."""
        product = self.shift * self.a2
        return abs(product) < 1.0 and abs(self.a1) < 1.0 - product

    @property
    def lag(self) -> float:
        """Seconds by which the reading of a steadily turning heading is late."""
        delayed = self.shift * self.a2
        return TICK * (self.a1 + 2.0 * delayed) / (1.0 - self.a1 - delayed)


TCM2 = CompassModel(0.2796, 0.6971, 0.4364, 0.05339)
"""P4 (7)."""
TRUE_TCM2 = TCM2.scaled(1.005, shift_too=True)
"""P4 (8), the compass that is really there: every coefficient half a per cent larger, the shift entry too."""


def stability_limit(shift_too: bool = False) -> float:
    """The factor on all coefficients at which the TCM2's slow pole reaches 1.

    With the shift entry exact f (a1 + a2) = 1, else f a1 + f² a2 = 1.
    """
    if not shift_too:
        return 1.0 / (TCM2.a1 + TCM2.a2)
    return (math.sqrt(TCM2.a1**2 + 4.0 * TCM2.a2) - TCM2.a1) / (2.0 * TCM2.a2)


def random_compass(rng: np.random.Generator, tolerance: float = 0.01) -> CompassModel:
    """A compass whose four coefficients lie anywhere within ± tolerance of the TCM2's."""
    return CompassModel(*(value * (1.0 + tolerance * rng.uniform(-1.0, 1.0)) for value in TCM2[:4]))


@dataclass(frozen=True)
class DynamicCompass:
    """A TCM2 for the loop.

    model: its dynamics. card: deviation coefficients A to E, rad. wrapped: readings in [−π, π) and dynamics that act on
    the turn made since switching on; the paper's reads on beyond a turn.
    """

    model: CompassModel = TCM2
    card: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    wrapped: bool = False
    _constants: np.ndarray = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        if not self.model.stable:
            raise InputError(f"compass.model {tuple(self.model)} is unstable, expected poles inside the unit circle")
        object.__setattr__(self, "_constants", np.array(self.model, dtype=np.float64))

    def start(self, heading: float, seed: Seed) -> "DynamicCompassStream":
        """The compass switched on, at rest at a heading (rad). `seed`: an int or a numpy Generator."""
        return DynamicCompassStream(self, heading, seed)


class DynamicCompassStream:
    """A compass that is switched on: `readings(heading, ticks)` gives its readings (rad) at 40 Hz at one heading."""

    def __init__(self, compass: DynamicCompass, heading: float, seed):
        self._compass = compass
        self._rng = np.random.default_rng(seed)
        model = compass.model
        settled = model.b * self._seen(heading) / (1.0 - model.a1 - model.shift * model.a2)
        self._state = np.array([settled, model.shift * settled])

    def second(self, heading: float) -> np.ndarray:
        """(40,) readings, rad; the heading is held through the second, as in P4."""
        return self.readings(heading, TICKS)

    def readings(self, heading: float, ticks: int) -> np.ndarray:
        """(ticks,) readings, rad, of a heading that is held."""
        readings = np.empty(ticks)
        noise = self._rng.standard_normal((ticks, 3))
        _ticks(self._compass._constants, self._state, self._seen(heading), noise, readings)
        readings = np.radians(readings)
        return np.array([wrap(each) for each in readings]) if self._compass.wrapped else readings

    def _seen(self, heading):
        return math.degrees(heading + deviation(heading, *self._compass.card))


@kernel
def _ticks(model, state, heading_deg, noise, readings):
    for k in range(len(readings)):
        first = model[0] * state[0] + model[1] * state[1] + model[2] * heading_deg + noise[k, 0]
        state[1] = model[4] * state[0] + noise[k, 1]
        state[0] = first
        readings[k] = model[3] * first + math.sqrt(READING_VARIANCE_DEG2) * noise[k, 2]
