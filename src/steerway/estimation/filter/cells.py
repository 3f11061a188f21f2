"""Rounded fixes: a written position is an interval of its last digit in either direction, a cell.

The density of a cell is an integral of the normal distribution; where its noise is small beside the digit, an added
variance of q²/12 would be far too wide and the fix itself far too narrow. Moments are those of a truncated normal
distribution (N. L. Johnson, S. Kotz and N. Balakrishnan, Continuous Univariate Distributions, vol. 1, 1994, §10.1),
north first, then east given north. Good fixes are taken so, and steps are weighed so; outliers, poor fixes, the
correction by a step and the NIS see the added variance.
"""

import math
from typing import NamedTuple

from steerway.core.compiled import called_kernel, inlined_kernel, lean_kernel
from steerway.estimation.filter.fix import see
from steerway.estimation.filter.vectors import (
    Sym2,
    Vec2,
    inverse,
    nis,
    outer,
    plus,
    sandwich,
    scaled,
    times,
    trace,
    widened,
)
from steerway.estimation.filter.weigh import (
    NORMAL,
    Share,
    Weighed,
    expect,
    follow_run,
    learn_noise,
    noise_seen,
    return_step,
    take_fix,
    take_shares,
    usual_spread,
    weigh,
    whole_of,
)

_NARROW, _FAR = 0.2, 25.0
"""Width of a cell, and distance of its near end, in deviations of the predicted fix: of a narrower one the density
hardly changes within it, and of one farther off it is below 10⁻¹³⁰. Both are taken with the added variance."""
_REGULAR = 0.03
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


@lean_kernel
def interval_of(middle, variance, width):
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
def cell_of(off, s, width):
    """The cell of this width (Vec2, m) about an innovation, of covariance S before rounding."""
    north = interval_of(off.n, s.nn, width.n)
    slope = s.ne / s.nn
    variance = s.ee - slope * s.ne + slope * slope * north.variance
    east = interval_of(off.e - slope * north.mean, variance, width.e)
    back = slope * north.variance / variance
    mean = Vec2(north.mean + back * east.mean, slope * north.mean + east.mean)
    left = north.variance - back * back * (variance - east.variance)
    return Cell(north.density * east.density, mean, Sym2(left, back * east.variance, east.variance))


@lean_kernel
def step_density(off, scale, width):
    """Density (1/m²) of a cell behind a step, either coordinate by Student's t distribution of this scale (Sym2, m²).

    With the added variance small steps would be likelier than a vessel that stays in a cell.
    """
    return student_density(off.n, scale.nn, width.n) * student_density(off.e, scale.ee, width.e)


@lean_kernel
def student_density(middle, scale, width):
    """Density of an interval about `middle` of Student's t distribution of four degrees of freedom, in closed form."""
    std = math.sqrt(scale)
    low, high = (abs(middle) - 0.5 * width) / std, (abs(middle) + 0.5 * width) / std
    within = student_tail(low) if low > 0.0 else 1.0 - student_tail(-low)
    return (within - student_tail(high)) / width


@lean_kernel
def student_tail(t):
    """Probability that a number of that distribution is above t ≥ 0."""
    root = (t * t + 4.0) ** 1.5
    return (6.0 * t * t + 32.0) / (root * (root + t * (t * t + 6.0)))


@lean_kernel
def cell_share(probability, cell, s):
    """What a good fix adds to the correction: S⁻¹ − S⁻¹ V S⁻¹ − s sᵀ and s = S⁻¹ a, of the mean a and covariance V."""
    information = inverse(s)
    pull = times(information, cell.mean)
    information = plus(information, scaled(-1.0, plus(sandwich(information, cell.spread), outer(pull))))
    return Share(scaled(probability, information), Vec2(probability * pull.n, probability * pull.e))


@called_kernel
def take_cell(bank, model, north, east, excess):
    """`take_fix` of a rounded fix."""
    run, receiver, probability, density_of = bank.run[0], model.receiver[0], bank.probability, bank.shares[0]
    fix, width = Vec2(north, east), Vec2(receiver.quantum_north, receiver.quantum_east)
    added = Sym2(width.n * width.n / 12.0, 0.0, width.e * width.e / 12.0)
    variance = excess * receiver.fix_variance
    loose = variance + 0.5 * trace(added)
    prior, other = return_step(bank, model, fix, loose)
    expected = expect(run, receiver)
    run.apart, run.since = run.since, 0.0
    mean, spread = Vec2(0.0, 0.0), Sym2(0.0, 0.0, 0.0)
    total = wrong = poor = learned = 0.0
    least = math.inf
    for k in range(len(probability)):
        weight = probability[k]
        seen = see(bank.x[k], bank.p[k], model.processes, receiver.time_variance, fix, loose, bank.rows)
        weighed = weigh(seen, expected, run, receiver, loose)
        s = plus(widened(seen.s, variance - loose), scaled(_REGULAR, added))
        cell = cell_of(seen.off, s, width)
        good, step = expected.good * cell.density, 0.0
        if expected.step > 0.0:
            step = expected.step * step_density(seen.off, widened(s, receiver.step_variance), width)
        weighed = Weighed(good, weighed.poor, step, weighed.wrong, weighed.poor_noise)
        density_of[k] = weight * (good + weighed.poor + step + weighed.wrong)
        total += density_of[k]
        wrong += weight * weighed.wrong
        poor += weight * weighed.poor
        if expected.freedom < NORMAL:
            learned += weight * weighed.poor * noise_seen(seen, expected, receiver, loose)
        mean = Vec2(mean.n + weight * seen.off.n, mean.e + weight * seen.off.e)
        spread = plus(spread, scaled(weight, plus(usual_spread(seen, expected, receiver, loose), outer(seen.off))))
        least = min(least, trace(seen.s))
        whole = whole_of(seen, weighed, loose)
        take_shares(bank, k, seen, weighed, whole, receiver, cell_share(good / whole, cell, s))
    for k in range(len(probability)):
        probability[k] = density_of[k] / total
    learn_noise(run, expected, poor / total, learned / total)
    follow_run(bank, mean, wrong / total, least, receiver.followed_after)
    return nis(mean, plus(spread, scaled(-1.0, outer(mean)))), math.log(prior * total + other), wrong / total


@inlined_kernel
def take_written(bank, model, north, east, excess):
    """A fix as it is written, rounded or not: see `weigh.take_fix`."""
    if model.receiver[0].quantum_north > 0.0:
        return take_cell(bank, model, north, east, excess)
    return take_fix(bank, model, north, east, excess)
