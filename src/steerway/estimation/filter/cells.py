"""Rounded fixes: a written position is an interval of its last digit in either direction, a cell.

The density of a cell is an integral of the normal distribution; where its noise is small beside the digit, an added
variance of q²/12 would be far too wide and the fix itself far too narrow. Moments are those of a truncated normal
distribution (N. L. Johnson, S. Kotz and N. Balakrishnan, Continuous Univariate Distributions, vol. 1, 1994, §10.1),
north first, then east given north. Good fixes are taken so, and steps are weighed so; outliers, poor fixes, the
correction by a step and the NIS see the added variance.
"""

import math
from typing import NamedTuple

from steerway.core.compiled import lean_kernel
from steerway.estimation.filter.vectors import Sym2, Vec2, density

_NARROW, _FAR = 0.2, 25.0
"""Width of a cell, and distance of its near end, in deviations of the predicted fix: of a narrower one the density
hardly changes within it, and of one farther off it is below 10⁻¹³⁰. Both are taken with the added variance."""
REGULAR = 0.03
"""Share of q²/12 that a predicted fix has as variance at least, which keeps its covariance regular where there is no
noise. Chosen: a deviation of 0.05 q."""


class Interval(NamedTuple):
    """A normally distributed number known to lie in an interval: the density of the middle, mean and variance."""

    density: float
    mean: float
    variance: float


class Cell(NamedTuple):
    """A fix before it was rounded, as an innovation: density (1/m²) of the written one, mean and covariance."""

    density: float
    mean: Vec2
    spread: Sym2
    s: Sym2  # what is expected of it, m²


@lean_kernel
def interval_of(middle: float, variance: float, width: float) -> Interval:
    """A number of mean 0 and this variance that lies in an interval about `middle`."""
    std = math.sqrt(variance)
    low, high = (abs(middle) - 0.5 * width) / std, (abs(middle) + 0.5 * width) / std
    if high - low < _NARROW or low > _FAR:
        whole = variance + width * width / 12.0
        density = math.exp(-0.5 * middle * middle / whole) / math.sqrt(2.0 * math.pi * whole)
        return Interval(density, middle * variance / whole, variance - variance * variance / whole)
    inside = 0.5 * (math.erfc(low / math.sqrt(2.0)) - math.erfc(high / math.sqrt(2.0)))
    at_low = math.exp(-0.5 * low * low) / math.sqrt(2.0 * math.pi)
    at_high = math.exp(-0.5 * high * high) / math.sqrt(2.0 * math.pi)
    mean = (at_low - at_high) / inside
    left = max(1.0 + (low * at_low - high * at_high) / inside - mean * mean, 0.0)
    return Interval(inside / width, math.copysign(std * mean, middle), variance * left)


@lean_kernel
def cell_of(off: Vec2, s: Sym2, width: Vec2) -> Cell:
    """The cell of this width (Vec2, m) about an innovation, of covariance S before rounding."""
    north = interval_of(off.n, s.nn, width.n)
    slope = s.ne / s.nn
    variance = s.ee - slope * s.ne + slope * slope * north.variance
    east = interval_of(off.e - slope * north.mean, variance, width.e)
    back = slope * north.variance / variance
    mean = Vec2(north.mean + back * east.mean, slope * north.mean + east.mean)
    left = north.variance - back * back * (variance - east.variance)
    return Cell(north.density * east.density, mean, Sym2(left, back * east.variance, east.variance), s)


@lean_kernel
def written(off: Vec2, s: Sym2, width: Vec2) -> Cell:
    """The cell of a fix as it is written: where it is not rounded, of width 0, the point itself."""
    if width.n > 0.0:
        return cell_of(off, s, width)
    return Cell(density(off, s, math.inf), off, Sym2(0.0, 0.0, 0.0), s)


@lean_kernel
def step_density(off: Vec2, scale: Sym2, width: Vec2) -> float:
    """Density (1/m²) of a cell behind a step, either coordinate by Student's t distribution of this scale (Sym2, m²).

    With the added variance small steps would be likelier than a vessel that stays in a cell.
    """
    return student_density(off.n, scale.nn, width.n) * student_density(off.e, scale.ee, width.e)


@lean_kernel
def student_density(middle: float, scale: float, width: float) -> float:
    """Density of an interval about `middle` of Student's t distribution of four degrees of freedom, in closed form."""
    std = math.sqrt(scale)
    low, high = (abs(middle) - 0.5 * width) / std, (abs(middle) + 0.5 * width) / std
    within = student_tail(low) if low > 0.0 else 1.0 - student_tail(-low)
    return (within - student_tail(high)) / width


@lean_kernel
def student_tail(t: float) -> float:
    """Probability that a number of that distribution is above t ≥ 0."""
    root = (t * t + 4.0) ** 1.5
    return (6.0 * t * t + 32.0) / (root * (root + t * (t * t + 6.0)))
