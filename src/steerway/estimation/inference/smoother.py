"""Fixed-interval smoothing of interacting modes by two filters, one from either end of the record.

D. C. Fraser and J. E. Potter, IEEE Trans. Automatic Control 14(4), 1969; of modes: R. E. Helmick, W. D. Blair and S. A.
Hoffman, IEEE Trans. Information Theory 41(6), 1995. At every row each mode before it meets each mode after it. What the
backward filter predicts is divided by what is known without any fix, so that this is not taken twice. Each filter is
linear about its own estimates: before a manoeuvre's middle the one from ahead knows the course, after it the other.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.inference.aids import take_aids
from steerway.estimation.inference.algebra import factor, inverse, invert_factor, whitened_square
from steerway.estimation.inference.bank import advance, start
from steerway.estimation.inference.fuse import fuse
from steerway.estimation.inference.model import (
    COURSE,
    EAST,
    FIX_VARIANCE,
    MODES,
    NORTH,
    OUTLIER_RATE,
    RATE,
    SINCE,
    SPEED,
    STARTED,
    STEP_RATE,
)
from steerway.estimation.inference.motion import spin_share
from steerway.estimation.inference.relative import difference, is_steady, shifted, turned
from steerway.estimation.inference.weigh import FREEDOM, gaussian, outlier_density, step_variance, student, take_fix

_NEGLIGIBLE = 3e-3
"""Probability of a pair of modes below which it is left out, against that of the likeliest pair: before their states
are compared, and after it. Chosen: with 0.001 smoothed scenes are no better, and take a fifth more time."""
_NEAR = 0.45
"""rad; courses so near one another are compared as courses where one of them is known well. Chosen: linear in the
course, the way is then too long by a tenth."""
PAIRS = MODES * MODES
_BEFORE, _AFTER, _FACTOR, _INVERSE, _STATES, _VECTORS = (PAIRS + k for k in (0, 5, 10, 11, 12, 17))
ROOM, _KNOWN = PAIRS + 19, 4
"""Matrices of workspace, and where they are: of all pairs; information of the modes before and after; one factor and
one inverse; states of pairs; vectors. _KNOWN: the first of MODES rows of `bank.work`."""


@called_kernel
def smooth_kept(time, north, east, excess, aids, restarts, reversal, bank, motion_states, kept, room, out):
    """Smoothed `fuse` of every row that a filter kept.

    time, north, east, excess, aids, restarts: see `track.run_record`; aids of the opposite course. bank: empty, of the
    backward filter. room: (ROOM, n, n), n states. out: (rows, ≥ FUSED), of which the first FUSED columns are filled.
    """
    model, run, n = reversal.model, bank.run, bank.x.shape[1]
    x, p = room[_STATES : _STATES + MODES].reshape((MODES * n, n))[:PAIRS], room[:PAIRS]
    weight = room[_VECTORS].reshape(n * n)[:PAIRS]
    run[STARTED] = 0.0
    r = len(restarts) - 1
    for k in range(len(time) - 1, -1, -1):
        if r >= 0 and restarts[r] == k + 1:
            r -= 1
            run[STARTED] = 0.0
        known = run[STARTED] != 0.0
        if known and time[k + 1] > time[k]:
            advance(bank, model, time[k + 1] - time[k], motion_states)
        if math.isnan(kept.probability[k, 0]):
            for i in range(out.shape[1]):
                out[k, i] = math.nan
        elif known and meet(kept, k, reversal, bank, x, p, weight, room):
            fuse(x, p, weight, model.filters, bank.work[0], out[k])
        else:
            fuse(kept.x[k], kept.p[k], kept.probability[k], model.filters, bank.work[0], out[k])
        if math.isfinite(north[k]) and math.isfinite(east[k]):
            if run[STARTED] == 0.0:
                start(bank, model, north[k], east[k])
                for j in range(MODES):
                    bank.probability[j], bank.p[j, RATE, RATE] = reversal.share[j], reversal.variance[j, RATE]
            else:
                take_fix(bank, model, north[k], east[k], excess[k] if len(excess) else 1.0)
        if known and len(aids):
            take_aids(bank, model, aids[k])


@called_kernel
def meet(kept, k, reversal, bank, x, p, weight, room):
    """Every mode that a filter kept of row k with every mode that the backward filter predicts for it.

    Fills x (PAIRS, n), p (PAIRS, n, n) and weight (PAIRS,); a pair's number is MODES times that of the mode after the
    row and that of the mode before it. Returns whether there is any pair.
    """
    m = bank.x.shape[0]
    highest = 0.0
    for q in range(len(weight)):
        i, j = q % m, q // m
        weight[q] = kept.probability[k, i] * bank.change[j, i] * bank.probability[j] / reversal.share[i]
        highest = max(highest, weight[q])
    for q in range(len(weight)):
        if not weight[q] > _NEGLIGIBLE * highest:
            weight[q] = 0.0
    forwards(reversal, bank)
    inform(kept.p[k], step_between(kept, k, reversal, bank, weight), reversal, bank, weight, room)
    return compare(kept.x[k], kept.p[k], reversal, bank, x, p, weight, room)


@called_kernel
def inform(filtered_p, loose, reversal, bank, weight, room):
    """Information of the modes of pairs that have a weight, and log determinants into rows of `bank.work`.

    Of the backward filter's modes also what is known without any fix, from row _KNOWN on, and the log determinants are
    those of the quotient of both. What is known so is never more than what the filter knows: mixing widens a mode.
    Of the held rate only the information is taken out, and its mean stays: it is not normally distributed, and far from
    0 a quotient of normal distributions would prefer the modes that seldom turn so fast.
    loose: see `step_between`.
    """
    m, n = bank.x.shape
    log_before, log_after = bank.work[0], bank.work[1]
    scratch, covariance = room[_FACTOR], room[_INVERSE]
    for i in range(m):
        log_before[i] = log_after[i] = math.nan
        met = met_back = False
        for j in range(m):
            met, met_back = met or weight[j * m + i] > 0.0, met_back or weight[i * m + j] > 0.0
        if met:
            log_before[i] = inverse(filtered_p[i], room[_BEFORE + i], scratch)
        if met_back:
            for u in range(n):
                for v in range(n):
                    covariance[u, v] = reversal.sign[u] * reversal.sign[v] * bank.p[i, u, v]
            covariance[NORTH, NORTH] += loose
            covariance[EAST, EAST] += loose
            log_after[i] = inverse(covariance, room[_AFTER + i], scratch)
            for u in range(RATE, n):
                share = spin_share(bank.steps[i], bank.x[i, SPEED]) if u == RATE else 1.0
                variance = max(share * reversal.variance[i, u], covariance[u, u])
                bank.work[_KNOWN + i, u] = 1.0 / variance
                log_after[i] -= math.log(variance)
            room[_AFTER + i, RATE, RATE] -= bank.work[_KNOWN + i, RATE]


@called_kernel
def compare(filtered_x, filtered_p, reversal, bank, x, p, weight, room):
    """Mean, covariance and probability of all pairs (see `meet`), of which `weight` are the prior probabilities.

    Returns whether there is any.
    """
    m, n = bank.x.shape
    predicted, log_before, log_after, d, white = bank.mixed_x, bank.work[0], bank.work[1], bank.work[2], bank.work[3]
    c = room[_FACTOR]
    highest = -math.inf
    for q in range(len(weight)):
        i, j = q % m, q // m
        prior, weight[q] = weight[q], -math.inf
        if prior == 0.0 or math.isnan(log_before[i]) or math.isnan(log_after[j]):
            continue
        angle = difference(
            predicted, j, filtered_x[i], are_steady(filtered_x[i], filtered_p[i], predicted[j], bank.p[j]), d
        )
        for u in range(n):
            for v in range(n):
                c[u, v] = room[_AFTER + j, u, v]
        turned(room, _FACTOR, angle)
        square = 0.0
        for u in range(n):
            x[q, u] = 0.0
            for v in range(n):
                x[q, u] += c[u, v] * d[v]
                c[u, v] += room[_BEFORE + i, u, v]
            square += d[u] * x[q, u]
        for u in range(RATE + 1, n):
            known = bank.work[_KNOWN + j, u]
            c[u, u] -= known
            x[q, u] += known * filtered_x[i, u]
            square -= known * filtered_x[i, u] ** 2
        log_c = factor(c, p[q])
        if math.isnan(log_c):
            continue
        square -= whitened_square(p[q], x[q], white)
        weight[q] = math.log(prior) - 0.5 * (log_before[i] + log_after[j] + log_c + square)
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
        i, j = q % m, q // m
        weight[q] /= total
        if weight[q] == 0.0:
            continue
        invert_factor(p[q], c)
        for u in range(n):
            d[u] = 0.0
            for v in range(n):
                d[u] += c[u, v] * x[q, v]
                p[q, u, v] = c[u, v]
        shifted(filtered_x[i], d, are_steady(filtered_x[i], filtered_p[i], predicted[j], bank.p[j]), x, p, q)
    return True


@lean_kernel
def are_steady(x, p, other_x, other_p):
    """Whether a mode and one met there (states (n,), covariances) are compared as speeds and courses."""
    one = is_steady(x[SPEED], p[2, 2], p[3, 3])
    other = is_steady(other_x[SPEED], other_p[2, 2], other_p[3, 3])
    return (one and other) or ((one or other) and abs(wrap(other_x[COURSE] - x[COURSE])) < _NEAR)


@called_kernel
def forwards(reversal, bank):
    """States of the backward filter as those of a vessel forwards, into `bank.mixed_x`."""
    m, n = bank.x.shape
    for j in range(m):
        for u in range(n):
            bank.mixed_x[j, u] = reversal.sign[u] * bank.x[j, u]
        bank.mixed_x[j, COURSE] = wrap(bank.x[j, COURSE] + math.pi)


@called_kernel
def step_between(kept, k, reversal, bank, weight):
    """Variance (m²) by which a step of the receiver loosens the place behind row k from that before it.

    The step may be one of its error, or one that only one filter follows yet. It went as far as both places are farther
    apart than they should be; between no step and one the harmonic mean is taken.
    """
    m, receiver = bank.x.shape[0], reversal.model.receiver
    happens = 1.0 - math.exp(-receiver[STEP_RATE] * bank.run[SINCE])
    stays = steps = total = variance = spread = 0.0
    for q in range(len(weight)):
        if weight[q] == 0.0:
            continue
        i, j = q % m, q // m
        a, b = bank.mixed_x[j, NORTH] - kept.x[k, i, NORTH], bank.mixed_x[j, EAST] - kept.x[k, i, EAST]
        nn, ne = bank.p[j, 0, 0] + kept.p[k, i, 0, 0], bank.p[j, 0, 1] + kept.p[k, i, 0, 1]
        ee = bank.p[j, 1, 1] + kept.p[k, i, 1, 1]
        speed, course = kept.x[k, i, SPEED], kept.x[k, i, COURSE]
        d_nn, d_ne, d_ee = step_variance(receiver, speed * math.cos(course), speed * math.sin(course))
        stays += weight[q] * gaussian(a, b, nn, ne, ee)
        steps += weight[q] * receiver[OUTLIER_RATE] * outlier_density(a, b, nn + ee, receiver[FIX_VARIANCE])
        if happens > 0.0:
            steps += weight[q] * happens * student(a, b, nn + d_nn, ne + d_ne, ee + d_ee, FREEDOM)
        total += weight[q]
        spread += weight[q] * 0.5 * (nn + ee)
        variance += weight[q] * 0.5 * max(d_nn + d_ee, a * a + b * b - nn - ee)
    if not stays + steps > 0.0:
        return 0.0
    spread, variance, probability = spread / total, variance / total, steps / (stays + steps)
    return probability * variance * spread / (spread + (1.0 - probability) * variance)
