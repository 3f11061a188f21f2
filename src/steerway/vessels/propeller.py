"""Propeller thrust by an open-water curve: T = K_t(J) ρ n|n| D⁴ with J = (1 − w) u/(n D); P3 (9)–(11), Table II.

K_t is linear between the points of the curve. Below the first point it is constant; beyond the last (windmilling) it is
extrapolated along the last segment to J = 3. A shaft at rest gives no thrust.
"""

from dataclasses import dataclass

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError

FARTHEST_ADVANCE = 3.0
_GAIN, _REACH, _CURVE = range(3)


@dataclass(frozen=True)
class Propeller:
    """Equal propellers at one speed: diameter D m, `count`, thrust `efficiency` η, `wake_fraction` w, water density.

    The curve: advance ratios J, rising, and thrust coefficients K_t. The default is P3's; it does not print D, η and ρ.
    Raises InputError for a curve that does not rise in J and for numbers out of range.
    """

    diameter: float = 0.8
    count: int = 2
    efficiency: float = 0.8
    wake_fraction: float = 0.0
    density: float = 1025.0
    advance: tuple[float, ...] = (-1.0, -0.5, 0.0, 0.7, 1.0)
    coefficient: tuple[float, ...] = (0.2, 0.34, 0.32, 0.12, 0.0)

    def __post_init__(self) -> None:
        for name in ("diameter", "count", "efficiency", "density"):
            positive(f"propeller.{name}", getattr(self, name))
        if not_negative("propeller.wake_fraction", self.wake_fraction) >= 1.0:
            raise InputError(f"propeller.wake_fraction is {self.wake_fraction:g}, expected less than 1")
        if len(self.advance) < 2 or len(self.advance) != len(self.coefficient) or np.diff(self.advance).min() <= 0.0:
            raise InputError(f"propeller.advance is {self.advance}, expected rising ratios, one per coefficient")

    @property
    def gain(self) -> float:
        """Thrust (N) for K_t = 1 at 1 rev/s, all propellers together; P3 (12)."""
        return self.count * self.efficiency * self.density * self.diameter**4

    def curve(self, gain: float | None = None) -> np.ndarray:
        """Parameters (2 + 2k,) of `thrust`. `gain` replaces the propeller's own, for example by gain/mass."""
        reach = (1.0 - self.wake_fraction) / self.diameter
        return np.array([self.gain if gain is None else gain, reach, *self.advance, *self.coefficient])


@kernel
def thrust_coefficient(advance: float, curve: Floats) -> float:
    """K_t at an advance ratio J."""
    k = (len(curve) - _CURVE) // 2
    if advance <= curve[_CURVE]:
        return curve[_CURVE + k]
    advance = min(advance, FARTHEST_ADVANCE)
    j = _CURVE + 1
    while j < _CURVE + k - 1 and advance > curve[j]:
        j += 1
    slope = (curve[j + k] - curve[j + k - 1]) / (curve[j] - curve[j - 1])
    return curve[j + k] + slope * (advance - curve[j])


@kernel
def thrust(speed: float, shaft: float, curve: Floats) -> float:
    """Thrust (N, or in the unit of the curve's gain) at a speed through the water (m/s) and a shaft speed (rev/s)."""
    if curve.ndim != 1 or len(curve) < _CURVE + 4:
        raise ValueError("curve is too short, expected that of a Propeller")
    if shaft == 0.0:
        return 0.0
    return curve[_GAIN] * thrust_coefficient(curve[_REACH] * speed / shaft, curve) * shaft * abs(shaft)
