"""Fixed-interval smoothing of interacting modes by two filters, one from either end of the record.

D. C. Fraser and J. E. Potter, IEEE Trans. Automatic Control 14(4), 1969; for modes R. E. Helmick, W. D. Blair and S. A.
Hoffman, IEEE Trans. Information Theory 41(6), 1995. At every row, each mode of the forward filter is combined with each
mode of the backward filter. The prediction of the backward filter is divided by the prior of the states, which would
count twice otherwise. Each filter is linearised about its own estimate: the forward filter provides the course before a
manoeuvre, the backward filter the course after it.
"""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.filter.aids import take_aids
from steerway.estimation.filter.algebra import factor, inverse, invert_factor, whitened_square
from steerway.estimation.filter.bank import advance, start
from steerway.estimation.filter.fuse import fuse
from steerway.estimation.filter.model import COURSE, EAST, NORTH, RATE, SPEED, Bank, Kept, Model
from steerway.estimation.filter.motion import spin_share
from steerway.estimation.filter.relative import difference, is_steady, shifted, turned, widen
from steerway.estimation.filter.reversal import Reversal
from steerway.estimation.filter.row import Rows
from steerway.estimation.filter.vectors import Sym2, Vec2, density, dot, plus, trace, widened
from steerway.estimation.filter.weigh import FREEDOM, NORMAL, outlier_density, take_fix

_NEGLIGIBLE = 3e-3
"""Probability of a pair of modes, over that of the likeliest pair, below which it is left out, both before and after
their states are compared. With 0.001, smoothed scenes are no better and take a fifth more time."""
_NEAR = 0.45
"""Largest difference, rad, of two courses that are compared as courses although one of them is uncertain. The distance
across, which is linear in the course, is then a tenth too long."""
_LEAST_SPEED = 1e-6  # m/s: least divisor for a speed


class Room(NamedTuple):
    """Workspace for pairs of modes at a row. Pair i + m j is forward mode i (before) and backward mode j (after)."""

    x: Floats  # (m², n) mean of a pair
    p: Floats  # (m², n, n) its covariance
    weight: Floats  # (m²,) its probability
    ahead: Floats  # (m, n) states of the backward modes, as those of a vessel forwards
    before: Floats  # (m, n, n) information matrices of the forward modes
    after: Floats  # (m, n, n) information matrices of the backward modes
    known: Floats  # (m, n) prior information on each state
    log_before: Floats  # (m,) log determinant of the covariance of a forward mode, NaN for a mode in no pair
    log_after: Floats  # (m,) log determinant for a backward mode, less that of the prior
    matrices: Floats  # (2, n, n)
    vectors: Floats  # (2, n)


def room_to_meet(model: Model) -> Room:
    """Workspace for a model."""
    m, n = len(model.modes), model.states
    pairs = m * m
    of_pairs, information = ((pairs, n), (pairs, n, n), (pairs,)), ((m, n, n), (m, n, n), (m, n), (m,), (m,))
    shapes = *of_pairs, (m, n), *information, (2, n, n), (2, n)
    return Room(*map(np.zeros, shapes))


@called_kernel
def smooth_kept(rows: Rows, reversal: Reversal, bank: Bank, kept: Kept, room: Room, out: Floats) -> None:
    """Fill the first FUSED columns of `out` (n, ≥ FUSED) with the smoothed `fuse` of every row.

    rows: the record with `reversed_aids`. bank: for the backward filter. kept: modes of the forward filter.
    """
    model, run, time = reversal.model, bank.run[0], rows.time
    run.started = 0
    r = len(rows.restarts) - 1
    for k in range(len(time) - 1, -1, -1):
        if r >= 0 and rows.restarts[r] == k + 1:
            r -= 1
            run.started = 0
        known = run.started == 1
        if known and time[k + 1] > time[k]:
            advance(bank, model, time[k + 1] - time[k])
        if math.isnan(kept.probability[k, 0]):
            for i in range(out.shape[1]):
                out[k, i] = math.nan
        elif known and meet(kept, k, reversal, bank, room):
            fuse(room.x, room.p, room.weight, model, bank.rows[0], out[k])
        else:
            fuse(kept.x[k], kept.p[k], kept.probability[k], model, bank.rows[0], out[k])
        if math.isfinite(rows.north[k]) and math.isfinite(rows.east[k]):
            if known:
                take_fix(bank, model, rows.north[k], rows.east[k], rows.excess[k] if len(rows.excess) else 1.0)
            else:
                start(bank, model, rows.north[k], rows.east[k])
                for j in range(len(bank.p)):
                    bank.p[j, RATE, RATE] = reversal.variance[j, RATE]
        if known and len(rows.aids):
            take_aids(bank, model, rows.aids[k])


@called_kernel
def meet(kept: Kept, k: int, reversal: Reversal, bank: Bank, room: Room) -> bool:
    """Fill the pairs of row k: every forward mode with every backward mode. Returns whether any pair is left."""
    weight, m = room.weight, len(bank.x)
    highest = 0.0
    for q in range(len(weight)):
        i, j = q % m, q // m
        change = share = 0.0  # sums over the modes that differ from i by their age alone: each filter has its own ages
        for other in range(m):
            if reversal.kind[other] == reversal.kind[i]:
                change += bank.change[j, other]
                share += reversal.share[other]
        weight[q] = kept.probability[k, i] * change * bank.probability[j] / share
        highest = max(highest, weight[q])
    for q in range(len(weight)):
        if not weight[q] > _NEGLIGIBLE * highest:
            weight[q] = 0.0
    forwards(reversal, bank.x, room.ahead)
    inform(kept.p[k], step_between(kept.x[k], kept.p[k], reversal, bank, room), reversal, bank, room)
    return compare(kept.x[k], kept.p[k], bank, room)


@called_kernel
def inform(filtered_p: Floats, loose: float, reversal: Reversal, bank: Bank, room: Room) -> None:
    """Fill `before`, `after`, `known` and the log determinants for the modes of pairs that have a weight.

    The prior variance of a state is at least that of the backward mode, since mixing widens a mode. Where the held rate
    is not normally distributed about 0, its prior information is subtracted and its mean is kept. Far from 0, dividing
    by a normal prior would favour the modes that seldom turn so fast. loose: see `step_between`.
    """
    m, n = bank.x.shape
    scratch, covariance = room.matrices[0], room.matrices[1]
    for i in range(m):
        room.log_before[i] = room.log_after[i] = math.nan
        met = met_back = False
        for j in range(m):
            met, met_back = met or room.weight[j * m + i] > 0.0, met_back or room.weight[i * m + j] > 0.0
        if met:
            room.log_before[i] = inverse(filtered_p[i], room.before[i], scratch)
        if met_back:
            for u in range(n):
                for v in range(n):
                    covariance[u, v] = reversal.sign[u] * reversal.sign[v] * bank.p[i, u, v]
            covariance[NORTH, NORTH] += loose
            covariance[EAST, EAST] += loose
            log_determinant = inverse(covariance, room.after[i], scratch)
            for u in range(SPEED, n):
                room.known[i, u] = 0.0
                if math.isinf(reversal.variance[i, u]):
                    continue
                share = spin_share(bank.steps[i], bank.x[i, SPEED]) if u == RATE else 1.0
                variance = max(share * reversal.variance[i, u], covariance[u, u])
                room.known[i, u] = 1.0 / variance
                log_determinant -= math.log(variance)
            room.log_after[i] = log_determinant
            if m > 1 and not (reversal.is_normal and room.known[i, RATE] * reversal.variance[i, RATE] >= 1.0):
                room.after[i, RATE, RATE] -= room.known[i, RATE]
                room.known[i, RATE] = 0.0


@called_kernel
def compare(filtered_x: Floats, filtered_p: Floats, bank: Bank, room: Room) -> bool:
    """Fill mean, covariance and probability of all pairs. On entry `room.weight` holds prior probabilities.

    Returns whether any pair is left.
    """
    weight, m = room.weight, len(bank.x)
    highest = -math.inf
    for q in range(len(weight)):
        i, j = q % m, q // m
        prior, weight[q] = weight[q], -math.inf
        if prior == 0.0 or math.isnan(room.log_before[i]) or math.isnan(room.log_after[j]):
            continue
        steady = are_steady(filtered_x[i], filtered_p[i], room.ahead[j], bank.p[j])
        weight[q] = math.log(prior) + agreement(filtered_x[i], room.ahead[j], steady, room, q)
        if math.isnan(weight[q]):
            weight[q] = -math.inf
        highest = max(highest, weight[q])
    if highest == -math.inf:
        return False
    total = 0.0
    for q in range(len(weight)):
        weight[q] = math.exp(weight[q] - highest)
        if weight[q] < _NEGLIGIBLE:
            weight[q] = 0.0
        total += weight[q]
    for q in range(len(weight)):
        weight[q] /= total
        if weight[q] > 0.0:
            i, j = q % m, q // m
            steady = are_steady(filtered_x[i], filtered_p[i], room.ahead[j], bank.p[j])
            join(filtered_x[i], steady, room, q)
    return True


@called_kernel
def agreement(before: Floats, after: Floats, steady: bool, room: Room, q: int) -> float:
    """Log density of the difference of the states (n,) of a pair; NaN if its information is not positive definite.

    For `join`, p and x of the pair receive the Cholesky factor and the information vector of the error at `before`.
    """
    n, m = len(before), len(room.before)
    i, j = q % m, q // m
    information, error, white, x = room.matrices[0], room.vectors[0], room.vectors[1], room.x[q]
    angle = difference(after, before, steady, error)
    for u in range(n):
        for v in range(n):
            information[u, v] = room.after[j, u, v]
    turned(information, angle)
    if m == 1 and steady:
        widen(information, after[SPEED] / max(before[SPEED], _LEAST_SPEED))
    square = 0.0
    for u in range(n):
        x[u] = 0.0
        for v in range(n):
            x[u] += information[u, v] * error[v]
            information[u, v] += room.before[i, u, v]
        square += error[u] * x[u]
    for u in range(SPEED, n):
        known = room.known[j, u]
        information[u, u] -= known
        x[u] += known * before[u]
        square -= known * before[u] ** 2
    log_information = factor(information, room.p[q])
    if math.isnan(log_information):
        return math.nan
    square -= whitened_square(room.p[q], x, white)
    return -0.5 * (room.log_before[i] + room.log_after[j] + log_information + square)


@called_kernel
def join(before: Floats, steady: bool, room: Room, q: int) -> None:
    """x and p of a pair ← its state and covariance, from the results of `agreement`."""
    covariance, error, x, p = room.matrices[0], room.vectors[0], room.x[q], room.p[q]
    invert_factor(p, covariance)
    for u in range(len(x)):
        error[u] = 0.0
        for v in range(len(x)):
            error[u] += covariance[u, v] * x[v]
            p[u, v] = covariance[u, v]
    shifted(before, error, steady, x, p)
    if len(room.before) == 1 and steady:
        widen(p, x[SPEED] / max(before[SPEED], _LEAST_SPEED))


@lean_kernel
def are_steady(x: Floats, p: Floats, other_x: Floats, other_p: Floats) -> bool:
    """Whether the modes of a pair, with these states (n,) and covariances, are compared as speeds and courses."""
    one = is_steady(x[SPEED], p[2, 2], p[3, 3])
    other = is_steady(other_x[SPEED], other_p[2, 2], other_p[3, 3])
    return (one and other) or ((one or other) and abs(wrap(other_x[COURSE] - x[COURSE])) < _NEAR)


@called_kernel
def forwards(reversal: Reversal, x: Floats, out: Floats) -> None:
    """out ← states x (m, n) of the backward filter, as those of a vessel forwards."""
    m, n = x.shape
    for j in range(m):
        for u in range(n):
            out[j, u] = reversal.sign[u] * x[j, u]
        out[j, COURSE] = wrap(x[j, COURSE] + math.pi)


@called_kernel
def step_between(x: Floats, p: Floats, reversal: Reversal, bank: Bank, room: Room) -> float:
    """Variance (m²) that a possible step of the receiver adds between the positions of the two filters at a row.

    Either the receiver's error steps at this row, or only one of the filters has followed an earlier or later step. The
    size of the step is the excess of the distance between both positions over the expected distance. The result is a
    harmonic mean between no step and a step.
    """
    m, weight, receiver = len(bank.x), room.weight, reversal.model.receiver[0]
    happens, size = 1.0 - math.exp(-receiver.step_rate * bank.run[0].since), receiver.step_variance
    stays = steps = total = variance = spread = 0.0
    for q in range(len(weight)):
        if weight[q] == 0.0:
            continue
        i, j = q % m, q // m
        off = Vec2(room.ahead[j, NORTH] - x[i, NORTH], room.ahead[j, EAST] - x[i, EAST])
        both = plus(place_of(bank.p[j]), place_of(p[i]))
        stays += weight[q] * density(off, both, NORMAL)
        steps += weight[q] * receiver.outlier_rate * outlier_density(off, trace(both), receiver.fix_variance)
        if happens > 0.0:
            steps += weight[q] * happens * density(off, widened(both, size), FREEDOM)
        total += weight[q]
        spread += weight[q] * 0.5 * trace(both)
        variance += weight[q] * max(size, 0.5 * (dot(off, off) - trace(both)))
    if not stays + steps > 0.0:
        return 0.0
    spread, variance, probability = spread / total, variance / total, steps / (stays + steps)
    return probability * variance * spread / (spread + (1.0 - probability) * variance)


@lean_kernel
def place_of(p: Floats) -> Sym2:
    """Covariance (m²) of the position of a mode."""
    return Sym2(p[0, 0], p[0, 1], p[1, 1])
