"""Correct all modes by a fix: good, poor, the first after a step of the receiver's error, or an outlier."""

import math
from typing import NamedTuple

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.filter.cells import REGULAR, Cell, step_density, written
from steerway.estimation.filter.fix import Seen, correct, see
from steerway.estimation.filter.model import EAST, NORTH, Bank, Model, Receiver, Run
from steerway.estimation.filter.vectors import (
    Sym2,
    Vec2,
    density,
    dot,
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

LEAST_OUTLIER, DECADES = 10.0, 10.0
"""Least error a of an outlier, in σ of a fix; and L = ln (km / a), about 10 for any receiver. The error ρ is equally
probable in every decade up to kilometres: its density is 1/(2π (ρ² + a²) L)."""
LEAST_PROBABILITY = 1e-6
"""Least probability of a hypothesis in the correction: a less probable one changes no state by 0.001 σ."""
NORMAL = math.inf
"""Degrees of freedom with which Student's t distribution is the normal distribution."""
FREEDOM = 4.0
"""Degrees of freedom of Student's t distribution for steps and for the noise of poor fixes, both of which are seldom
large (K. L. Lange, R. J. A. Little and J. M. G. Taylor, J. American Statistical Association 84(408), 1989)."""
STUDENT_VARIANCE = FREEDOM / (FREEDOM - 2.0)
"""Variance of Student's t distribution with FREEDOM, at unit scale."""
DIFFUSE, RARE = 1e6, 1e-3
"""If the variance of a predicted fix is above DIFFUSE times that of its white noise, a fix with an outlier probability
below RARE counts as no outlier at all. Otherwise the remaining share of the vague prediction would outweigh the fix."""
OUTLIERS_LAST = 0.5
"""Probability that the fix after an outlier is an outlier too: even odds, as in `SAME_OFFSET` and `RETURNS`."""
SAME_OFFSET = 0.5
"""Probability that the second of two outliers has the same error as the first."""
RUN_FOLLOWED = 4
"""Number of successive outliers that agree (4 s at 1 Hz) after which they count as a step of the receiver. The position
follows them once they have lasted for the receiver's `followed_after`."""
NONE = Sym2(0.0, 0.0, 0.0)
RETURNS = 0.5
"""Probability that the receiver undoes the step that was followed last, as a multiple of the share of outliers."""


class Expected(NamedTuple):
    """Prior probabilities of the hypotheses for a fix, and the noise of a poor one."""

    good: float
    poor: float
    step: float
    wrong: float  # an outlier
    noise: float  # ratio of the further variance of a poor fix to its usual value
    freedom: float  # degrees of freedom of `noise`
    learnt: float  # degrees of freedom that stem from earlier fixes


@lean_kernel
def expect(run: Run, receiver: Receiver) -> Expected:
    """Prior of the next fix.

    Under an obstructed sky a poor fix is mostly followed by another. Their noise is estimated from the fixes before (S.
    Särkkä and A. Nummenmaa, IEEE Trans. Automatic Control 54(3), 2009).
    """
    wrong = receiver.outlier_rate * (1.0 - run.was_outlier) + OUTLIERS_LAST * run.was_outlier
    stays = learnt = 0.0
    level, freedom = 1.0, NORMAL
    if receiver.poor_time > 0.0:
        left = math.exp(-run.since / receiver.poor_time)
        stays, learnt = left * run.was_poor, left * run.learnt
        freedom = FREEDOM + learnt
        level = (FREEDOM + learnt * run.level) / freedom
    poor = (1.0 - wrong) * (stays + (1.0 - stays) * receiver.poor_rate)
    step = (1.0 - wrong - poor) * (1.0 - math.exp(-receiver.step_rate * run.since))
    return Expected(1.0 - wrong - poor - step, poor, step, wrong, level, freedom, learnt)


class Weighed(NamedTuple):
    """Prior probability times density (1/m²) of a fix under every hypothesis, and the further noise of a poor fix."""

    good: float
    poor: float
    step: float
    wrong: float
    poor_noise: Sym2  # m²


class Share(NamedTuple):
    """Contribution of hypotheses of probability β to a correction, with s = S⁻¹ ν: Σ β (S⁻¹ − s sᵀ) and Σ β s."""

    information: Sym2
    s: Vec2


@called_kernel
def take_fix(bank: Bank, model: Model, north: float, east: float, excess: float) -> tuple[float, float, float]:
    """Correct all modes by a fix. Returns its NIS for the mean of all modes, log density and outlier probability.

    A fix is good, poor (with several times the usual noise), the first after a step of the receiver, which moves the
    position but not the motion, or an outlier. The correction of a mode is the mean over these hypotheses, see
    `take_shares`. The variance of a rounded fix includes that of its last digit, except where it counts as a cell, see
    `cells`. excess: factor on the usual variance of the white noise.
    """
    run, receiver, probability, density_of = bank.run[0], model.receiver[0], bank.probability, bank.shares[0]
    fix, width = Vec2(north, east), Vec2(receiver.quantum_north, receiver.quantum_east)
    rounding = Sym2(width.n * width.n / 12.0, 0.0, width.e * width.e / 12.0)
    white = excess * receiver.fix_variance
    variance = white + 0.5 * trace(rounding)
    prior, other = return_step(bank, model, fix, variance)
    expected = expect(run, receiver)
    run.apart, run.since = run.since, 0.0
    mean, spread = Vec2(0.0, 0.0), Sym2(0.0, 0.0, 0.0)
    total = wrong = poor = learned = 0.0
    least = math.inf
    for k in range(len(probability)):
        x, p, weight = bank.x[k], bank.p[k], probability[k]
        seen = see(x, p, model.processes, receiver.time_variance, fix, variance, bank.rows)
        cell = written(seen.off, plus(widened(seen.s, white - variance), scaled(REGULAR, rounding)), width)
        weighed = weigh(seen, cell, expected, run, receiver, variance)
        density_of[k] = weight * (weighed.good + weighed.poor + weighed.step + weighed.wrong)
        total += density_of[k]
        wrong += weight * weighed.wrong
        poor += weight * weighed.poor
        if expected.freedom < NORMAL:
            learned += weight * weighed.poor * noise_seen(seen, expected, receiver, variance)
        mean = Vec2(mean.n + weight * seen.off.n, mean.e + weight * seen.off.e)
        spread = plus(spread, scaled(weight, plus(usual_spread(seen, expected, receiver, variance), outer(seen.off))))
        least = min(least, trace(seen.s))
        whole = whole_of(seen, weighed, variance)
        good = share(weighed.good / whole, cell.mean, cell.spread, cell.s)
        take_shares(bank, k, seen, weighed, whole, receiver, good)
    for k in range(len(probability)):
        probability[k] = density_of[k] / total
    learn_noise(run, expected, poor / total, learned / total)
    follow_run(bank, mean, wrong / total, least, receiver.followed_after)
    return nis(mean, plus(spread, scaled(-1.0, outer(mean)))), math.log(prior * total + other), wrong / total


@lean_kernel
def weigh(seen: Seen, cell: Cell, expected: Expected, run: Run, receiver: Receiver, variance: float) -> Weighed:
    """Weigh a fix under all hypotheses, in one mode."""
    off, s = seen.off, seen.s
    wrong = outlier_density(off, trace(s), variance)
    if run.outliers > 0.0:
        again = Vec2(off.n - run.outlier_north, off.e - run.outlier_east)
        wrong = (1.0 - SAME_OFFSET) * wrong + SAME_OFFSET * density(again, widened(s, variance), NORMAL)
    noise = poor_noise(seen, expected, receiver, variance)
    poor = step = 0.0
    if expected.poor > 0.0:
        poor = expected.poor * density(off, plus(s, noise), expected.freedom)
    if expected.step > 0.0:
        width, scale = Vec2(receiver.quantum_north, receiver.quantum_east), widened(cell.s, receiver.step_variance)
        step = expected.step * (step_density(off, scale, width) if width.n > 0.0 else density(off, scale, FREEDOM))
    return Weighed(
        expected.good * cell.density, poor, step, expected.wrong * wrong, noise_shown(seen, noise, expected.freedom)
    )


@lean_kernel
def whole_of(seen: Seen, weighed: Weighed, variance: float) -> float:
    """Sum (1/m²) over the hypotheses of a fix, without the outlier hypothesis where DIFFUSE excludes it."""
    known = weighed.good + weighed.poor + weighed.step
    whole = known + weighed.wrong
    return known if trace(seen.s) > DIFFUSE * variance and weighed.wrong < RARE * whole else whole


@lean_kernel
def take_shares(
    bank: Bank, k: int, seen: Seen, weighed: Weighed, whole: float, receiver: Receiver, mean: Share
) -> None:
    """Correct mode k by the mean over all hypotheses h. On entry `mean` is the contribution of a good fix.

    Probabilistic data association (Y. Bar-Shalom and X. R. Li, Multitarget-Multisensor Tracking, 1995, §3.4):
    x ← x + C Σ β_h s_h and P ← P − C (Σ β_h (S_h⁻¹ − s_h s_hᵀ) + s̄ s̄ᵀ) Cᵀ with C = P Hᵀ in `rows`, s_h = S_h⁻¹ ν and
    s̄ = Σ β_h s_h; for a step see `step_position`.
    """
    off, s, x, p, rows = seen.off, seen.s, bank.x[k], bank.p[k], bank.rows
    if weighed.poor > LEAST_PROBABILITY * whole:
        mean = joined(mean, share(weighed.poor / whole, off, NONE, plus(s, weighed.poor_noise)))
    if weighed.step > LEAST_PROBABILITY * whole:
        # size of the step: the excess of the innovation over its expected variance
        size = max(receiver.step_variance, 0.5 * (dot(off, off) - trace(s)))
        own = share(weighed.step / whole, off, NONE, widened(s, size))
        mean = joined(mean, own)
        step_position(x, p, size, weighed.step / whole, own, mean.s, rows)
    correct(x, p, rows, plus(mean.information, outer(mean.s)), mean.s, len(bank.x) == 1)


@lean_kernel
def share(probability: float, mean: Vec2, spread: Sym2, s: Sym2) -> Share:
    """Contribution of a hypothesis of probability β: β (S⁻¹ − S⁻¹ V S⁻¹ − s sᵀ) and β s with s = S⁻¹ a.

    Under the hypothesis the innovation before rounding has mean a (m) and covariance V (m²). Its prior covariance is S.
    """
    information = inverse(s)
    pull = times(information, mean)
    information = plus(information, scaled(-1.0, plus(sandwich(information, spread), outer(pull))))
    return Share(scaled(probability, information), Vec2(probability * pull.n, probability * pull.e))


@lean_kernel
def joined(a: Share, b: Share) -> Share:
    """Sum of two contributions."""
    return Share(plus(a.information, b.information), Vec2(a.s.n + b.s.n, a.s.e + b.s.e))


@lean_kernel
def outlier_density(off: Vec2, spread: float, variance: float) -> float:
    """Density (1/m²) of an outlier of innovation `off` (m), where the predicted fix has the variance `spread` (m²)."""
    return 1.0 / (2.0 * math.pi * DECADES * (dot(off, off) + spread + LEAST_OUTLIER**2 * variance))


@lean_kernel
def poor_noise(seen: Seen, expected: Expected, receiver: Receiver, variance: float) -> Sym2:
    """Further covariance (m²) of a poor fix: in every direction, and along the velocity."""
    added = expected.noise * (receiver.poor_noise**2 - 1.0) * variance
    return widened(scaled(receiver.late_variance, outer(seen.velocity)), added)


@lean_kernel
def noise_shown(seen: Seen, noise: Sym2, freedom: float) -> Sym2:
    """The covariance `noise` (m²) of a poor fix, given its innovation."""
    if math.isinf(freedom):
        return noise
    return scaled((freedom + nis(seen.off, plus(seen.s, noise))) / (freedom + 2.0), noise)


@lean_kernel
def usual_spread(seen: Seen, expected: Expected, receiver: Receiver, variance: float) -> Sym2:
    """Covariance (m²) of the innovation of a fix that is not an outlier."""
    loose = expected.poor * expected.noise * (receiver.poor_noise**2 - 1.0) * variance
    if expected.freedom < NORMAL:
        loose *= expected.freedom / (expected.freedom - 2.0)
    return widened(seen.s, loose + expected.step * STUDENT_VARIANCE * receiver.step_variance)


@called_kernel
def step_position(x: Floats, p: Floats, size: float, probability: float, own: Share, mean: Vec2, rows: Floats) -> None:
    """Move the position of a mode, E of x, by a step of variance d = `size` (m²) and probability β.

    x ← x + d E b and P ← P − d (C (J + s̄ bᵀ) Eᵀ + its transpose) + E (β d I − d² (J + b bᵀ)) Eᵀ. J and b are the
    step's `own` contribution, and s̄ is the sum over all hypotheses. `correct` does the rest.
    """
    j, b = own.information, own.s
    x[NORTH] += size * b.n
    x[EAST] += size * b.e
    to_north = Vec2(size * (j.nn + mean.n * b.n), size * (j.ne + mean.e * b.n))
    to_east = Vec2(size * (j.ne + mean.n * b.e), size * (j.ee + mean.e * b.e))
    for i in range(len(x)):
        known = Vec2(rows[0, i], rows[1, i])
        a, c = dot(known, to_north), dot(known, to_east)
        p[i, NORTH] -= a
        p[NORTH, i] -= a
        p[i, EAST] -= c
        p[EAST, i] -= c
    left = widened(scaled(-size * size, plus(j, outer(b))), probability * size)
    p[NORTH, NORTH] += left.nn
    p[EAST, EAST] += left.ee
    p[NORTH, EAST] += left.ne
    p[EAST, NORTH] += left.ne


@lean_kernel
def noise_seen(seen: Seen, expected: Expected, receiver: Receiver, variance: float) -> float:
    """Ratio of the mean square of the further noise of a poor fix, given the innovation, to its usual variance."""
    noise = poor_noise(seen, expected, receiver, variance)
    added = 2.0 * expected.noise * (receiver.poor_noise**2 - 1.0) * variance
    spread = trace(plus(seen.s, noise))
    part = added / spread
    return expected.noise * (part * dot(seen.off, seen.off) / spread + 1.0 - part)


@lean_kernel
def learn_noise(run: Run, expected: Expected, poor: float, seen: float) -> None:
    """Update the expected noise of poor fixes by a fix that is poor with probability `poor`; seen: see `noise_seen`."""
    run.was_poor, run.learnt = poor, expected.learnt
    if expected.freedom < NORMAL and poor > 0.0:
        told = 2.0 * poor  # a fix has two coordinates
        run.learnt = expected.learnt + told
        run.level += told / run.learnt * (seen / poor - run.level)


@called_kernel
def follow_run(bank: Bank, off: Vec2, wrong: float, spread: float, after: float) -> None:
    """Count outliers in a row that agree, and follow them as a step of the receiver (see RUN_FOLLOWED).

    off: mean innovation, m. wrong: probability of an outlier. spread: trace of S, m². after: `followed_after`, s.
    """
    run = bank.run[0]
    run.was_outlier = wrong
    if wrong < 0.5:
        run.outliers = 0.0
        return
    further = Vec2(off.n - run.outlier_north, off.e - run.outlier_east)
    if run.outliers > 0.0 and dot(further, further) < 9.0 * spread:
        run.outliers += 1.0
        run.lasted += run.apart
        run.outlier_north += further.n / run.outliers
        run.outlier_east += further.e / run.outliers
    else:
        run.outliers, run.lasted, run.outlier_north, run.outlier_east = 1.0, 0.0, off.n, off.e
    if run.outliers >= RUN_FOLLOWED and run.lasted >= after:
        shift(bank, run.outlier_north, run.outlier_east, spread / RUN_FOLLOWED)


@called_kernel
def shift(bank: Bank, north: float, east: float, variance: float) -> None:
    """Move the position of all modes by a step of the receiver (m) of this variance (m²); the motion stays."""
    run, x, p = bank.run[0], bank.x, bank.p
    for k in range(len(x)):
        x[k, NORTH] += north
        x[k, EAST] += east
        p[k, 0, 0] += variance
        p[k, 1, 1] += variance
    run.outliers = run.was_outlier = 0.0
    run.step_north += north
    run.step_east += east


@called_kernel
def return_step(bank: Bank, model: Model, fix: Vec2, variance: float) -> tuple[float, float]:
    """Undo the receiver's step that the filter followed last, if the fix is more probable without it.

    Returns the prior probability of the choice (to return or not), and prior times density (1/m²) of the other choice.
    """
    run, processes, outlier_rate = bank.run[0], model.processes, model.receiver[0].outlier_rate
    if run.step_north == 0.0 and run.step_east == 0.0:
        return 1.0, 0.0
    stays = returns = 0.0
    for k in range(len(bank.x)):
        seen = see(bank.x[k], bank.p[k], processes, 0.0, fix, variance, bank.rows)
        back = Vec2(seen.off.n + run.step_north, seen.off.e + run.step_east)
        usual = (1.0 - outlier_rate) * density(seen.off, seen.s, NORMAL)
        stays += bank.probability[k] * (usual + outlier_rate * outlier_density(seen.off, trace(seen.s), variance))
        returns += bank.probability[k] * density(back, widened(seen.s, variance), NORMAL)
    prior = RETURNS * outlier_rate
    stays, returns = (1.0 - prior) * stays, prior * returns
    if returns > stays:
        shift(bank, -run.step_north, -run.step_east, variance)
        run.step_north = run.step_east = 0.0
        return prior, stays
    return 1.0 - prior, returns
