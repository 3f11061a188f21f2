"""The identified models that the heading filters predict by: a vessel's yaw, and a compass's dynamics.

Springer's yaw is a discrete model, x(k+1) = A x(k) + B n_d(k), ψ(k) = C x(k), at 1 s, with n_d = (n1 − n2)/2 in rpm and
ψ in rad. The TCM2 compass is x(k+1) = A x(k) + B ψ(k) + ω, z = C x + υ at 40 Hz, angles in degrees; its second state is
the first, a tick late. P4 (2)–(8).
"""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel

RPM = 2.0 * math.pi / 60.0
"""One revolution a minute, rad/s."""
SPEED = 3.0 * 1852.0 / 3600.0
"""Three knots through the water at 900 rpm."""


class HeadingModel(NamedTuple):
    """ψ from n_d in steps of 1 s: two poles, each with its input and its output."""

    poles: tuple[float, float]
    inputs: tuple[float, float]  # rad per rpm, as printed
    outputs: tuple[float, float]

    def matrices(self, step: float = 1.0) -> tuple[Floats, Floats, Floats]:
        """A (2, 2), B (2,) per rad/s of n_d, C (2,) to rad; for steps of `step` s."""
        kept, entered = np.array([held(pole, step) for pole in self.poles]).T
        return np.diag(kept), entered * np.array(self.inputs) / RPM, np.array(self.outputs)

    def scaled(self, effectiveness: float) -> "HeadingModel":
        """The same vessel with `effectiveness` times the yaw moment of its propellers."""
        first, second = self.inputs
        return self._replace(inputs=(effectiveness * first, effectiveness * second))


PAPER_YAW = HeadingModel((1.002, 0.9945), (6.354e-6, -4.699e-6), (34.13, 15.11))
"""P4 (4), its scrambled matrices decoded: with any other order of the digits the mission fails."""
PHYSICAL_YAW = PAPER_YAW._replace(poles=(1.0, 0.9945))


@kernel
def held(pole: float, step: float) -> tuple[float, float]:
    """(pole^h, effect of an input held for h s relative to 1 s): exact for poles of steps of 1 s, 1 included."""
    kept = pole**step
    return kept, step if pole == 1.0 else (kept - 1.0) / (pole - 1.0)


TICK = 0.025
TICKS = 40
"""Ticks in a second."""
READING_VARIANCE_DEG2 = 2.0
STATE_VARIANCE = 1.0
"""P4 (7), deg²: variance of a reading, and of each compass state's noise a tick."""


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
        return CompassModel(factor * self.a1, factor * self.a2, factor * self.b, factor * self.k, shift)

    @property
    def gain(self) -> float:
        """Ratio of the steady reading of the compass to a constant heading."""
        return self.k * self.b / (1.0 - self.a1 - self.shift * self.a2)

    @property
    def stable(self) -> bool:
        """Whether both poles of z² − a1 z − s a2 lie inside the unit circle."""
        product = self.shift * self.a2
        return abs(product) < 1.0 and abs(self.a1) < 1.0 - product

    @property
    def lag(self) -> float:
        """Time (s) by which the reading lags a steadily turning heading."""
        delayed = self.shift * self.a2
        return TICK * (self.a1 + 2.0 * delayed) / (1.0 - self.a1 - delayed)


TCM2 = CompassModel(0.2796, 0.6971, 0.4364, 0.05339)
"""P4 (7)."""
TRUE_TCM2 = TCM2.scaled(1.005, shift_too=True)
"""P4 (8), the true compass: every coefficient is half a per cent larger, the shift entry too."""


def stability_limit(shift_too: bool = False) -> float:
    """The factor on all coefficients at which the TCM2's slow pole reaches 1.

    With the shift entry exact f (a1 + a2) = 1, else f a1 + f² a2 = 1.
    """
    if not shift_too:
        return 1.0 / (TCM2.a1 + TCM2.a2)
    return (math.sqrt(TCM2.a1**2 + 4.0 * TCM2.a2) - TCM2.a1) / (2.0 * TCM2.a2)


def random_compass(rng: np.random.Generator, tolerance: float = 0.01, compass: CompassModel = TCM2) -> CompassModel:
    """A compass whose four coefficients lie anywhere within ± tolerance of those of another."""
    return CompassModel(*(value * (1.0 + tolerance * rng.uniform(-1.0, 1.0)) for value in compass[:4]))
