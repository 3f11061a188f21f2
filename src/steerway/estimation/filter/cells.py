"""Rounded fixes: a position of few digits stands for a cell, a rectangle as wide as its last digit north and east.

The density of a cell is an integral of the normal distribution. Where the noise is small beside the digit q, the usual
added variance of q²/12 would be far too wide, and no added variance far too narrow. The moments of the position within
a cell are those of a truncated normal distribution (N. L. Johnson, S. Kotz and N. Balakrishnan, Continuous Univariate
Distributions, vol. 1, 1994, §10.1), north first, then east given north. Cells are used for good fixes, and for the
density of a step. Outliers, poor fixes, the correction by a step and the NIS use the added variance.
"""

import math
from typing import NamedTuple

from steerway.core.compiled import lean_kernel
from steerway.estimation.filter.vectors import Sym2, Vec2, density

_NARROW, _FAR = 0.2, 25.0
"""Least width of a cell, and largest distance of its near end, in σ of the predicted fix. For other cells the added
variance is used. The density hardly changes within a narrow cell, and is below 10⁻¹³⁰ in a far one."""
REGULAR = 0.03
"""Variance added to a predicted fix, as a share of q²/12 (σ of 0.05 q). Without noise, it keeps the covariance
regular."""


class Interval(NamedTuple):
    """A normal variable within an interval: its mean density in the interval, its conditional mean and variance."""

    density: float
    mean: float
    variance: float


class Cell(NamedTuple):
    """Innovation of a fix before it was rounded: density (1/m²) of its cell, mean (m) and covariance (m²) within it."""

    density: float
    mean: Vec2
    spread: Sym2
    s: Sym2  # expected covariance of the innovation, m²


@lean_kernel
def interval_of(middle: float, variance: float, width: float) -> Interval:
    """A normal variable of mean 0 and this variance, given an interval of this width about `middle`."""
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
    """The cell of this width (m) about an innovation `off` (m), whose covariance before rounding is s (m²)."""
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
    """The cell of a fix; for a fix that is not rounded (width 0) the point itself."""
    if width.n > 0.0:
        return cell_of(off, s, width)
    return Cell(density(off, s, math.inf), off, Sym2(0.0, 0.0, 0.0), s)


@lean_kernel
def step_density(off: Vec2, scale: Sym2, width: Vec2) -> float:
    """Density (1/m²) of a cell after a step: Student's t distribution of this scale (m²) in either coordinate.

    With the added variance, a small step would be more probable than no step of a vessel that stays in its cell.
    """
    return student_density(off.n, scale.nn, width.n) * student_density(off.e, scale.ee, width.e)


@lean_kernel
def student_density(middle: float, scale: float, width: float) -> float:
    """Density (1/m) of an interval about `middle` under Student's t distribution of four degrees of freedom."""
    std = math.sqrt(scale)
    low, high = (abs(middle) - 0.5 * width) / std, (abs(middle) + 0.5 * width) / std
    within = student_tail(low) if low > 0.0 else 1.0 - student_tail(-low)
    return (within - student_tail(high)) / width


@lean_kernel
def student_tail(t: float) -> float:
    """Probability that a variable of Student's t distribution of four degrees of freedom exceeds t ≥ 0."""
    root = (t * t + 4.0) ** 1.5
    return (6.0 * t * t + 32.0) / (root * (root + t * (t * t + 6.0)))
