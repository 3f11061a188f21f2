"""Fixed-interval smoothing of interacting modes.

One Gaussian a mode, backwards: through the interval after a row every mode is smoothed by the formula of H. E. Rauch,
F. Tung and C. T. Striebel (AIAA Journal 3(8), 1965) from what it was mixed of. What the future thereby says of the row
is the quotient of that and the mixture; it updates each component of the mixture and its probability by itself, so that
a later manoeuvre is reported from an earlier one (the reduction of GPB2: Y. Bar-Shalom, X. R. Li and T. Kirubarajan,
Estimation with Applications to Tracking and Navigation, 2001, §11.6).
"""

import math

from steerway.core.compiled import called_kernel, inlined_kernel
from steerway.estimation.inference.algebra import inverse, product, product_transposed
from steerway.estimation.inference.bank import SAME_STEP, forget_direction, loses_course, mix
from steerway.estimation.inference.discrete import LEFT, SPUN, set_steps
from steerway.estimation.inference.fuse import fuse
from steerway.estimation.inference.future import future
from steerway.estimation.inference.model import COURSE, DRIFT_SPEED, EAST, MODES, NORTH, RATE, SPEED, STEPPED
from steerway.estimation.inference.motion import predict
from steerway.estimation.inference.relative import difference, from_likeliest, is_steady, shifted, turned
from steerway.estimation.inference.track import recall

_NEGLIGIBLE, _NEGLIGIBLE_PART = 5e-3, 1e-5
"""Probability of a mode, and share of a component in its mixture, below which they are left out. Chosen: modes of
less than half a percent took half of the time."""
_TEMPER = 0.3
"""Exponent of what the future says of a component: Gaussians in which histories are merged share their errors, and with
an exponent of 1 smoothed modes are overconfident (coverage of SOG 82 % where this gives 87, errors a tenth larger)."""
_SPOILT = 50.0
"""Deviations; a component that the future moves farther has a matrix that is singular but for rounding. Chosen:
far beyond `future._FARTHEST`."""
ROOM, _INVERSES = 46, 31
"""Matrices of workspace; where the inverses of the filter's covariances are."""


@called_kernel
def transition(step, work, motion_states, f):
    """The transition matrix (n, n) of the prediction that left its rows in `work` (see `motion.predict`)."""
    n = f.shape[0]
    for i in range(n):
        for j in range(n):
            f[i, j] = 1.0 if i == j else 0.0
    for j in range(SPEED, motion_states):
        for i in range(4):
            f[i, j] += work[i, j]
    for j in range(RATE, n):
        if step[SPUN, j] != 0.0:
            f[j, j], f[j, j + 1] = step[LEFT, j], -step[SPUN, j]
            f[j + 1, j], f[j + 1, j + 1] = step[SPUN, j], step[LEFT, j]
        elif step[SPUN, j - 1] == 0.0:
            f[j, j] = step[LEFT, j]


@inlined_kernel
def back(bank, model, motion_states, smooth_x, smooth_p, smooth_probability, room):
    """One step back: `bank` holds the filter's modes at a row and the step to the next; smooth_* those of the next row,
    and are replaced by those of this one. room: (ROOM, n, n)."""
    x, p, probability, mixed_x, mixed_p = bank.x, bank.p, bank.probability, bank.mixed_x, bank.mixed_p
    steps, change, work = bank.steps, bank.change, bank.work
    m, n = x.shape
    x0, p0, before = room[0, :m], room[1:6], room[6, 0]
    for k in range(m):
        before[k] = probability[k]
        for i in range(n):
            x0[k, i] = x[k, i]
            for j in range(n):
                p0[k, i, j] = p[k, i, j]
    mix(bank)
    d, d_mixed, d_smooth = room[7], room[8], room[9]
    reference, steady = from_likeliest(x0, p0, before, d)
    origin = x0[reference]
    for k in range(m):
        room[_INVERSES + MODES, 0, k] = 0.0
    f, gain, inverted, lower = room[10], room[11], room[12], room[13]
    a, b, c = room[14], room[15], room[16]
    after = room[17]
    new_x, new_p = room[19], room[20:25]
    for i in range(m):
        after[0, i] = 0.0
        for u in range(n):
            new_x[i, u] = 0.0
            for v in range(n):
                new_p[i, u, v] = 0.0
    for j in range(m):
        if smooth_probability[j] < _NEGLIGIBLE:
            continue
        # smoothed through the step: mixed_x[j], mixed_p[j] → a (covariance), d_smooth[j]
        for u in range(n):
            x[j, u] = mixed_x[j, u]
            for v in range(n):
                p[j, u, v] = mixed_p[j, u, v]
        predict(x, p, j, steps[j], motion_states, model.receiver[DRIFT_SPEED], work)
        transition(steps[j], work, motion_states, f)
        p[j, NORTH, NORTH] += bank.run[STEPPED + j]
        p[j, EAST, EAST] += bank.run[STEPPED + j]
        if loses_course(x, p, j):
            # the future says nothing of what was before the course was lost
            forget_direction(x, p, j)
            for u in range(n):
                for v in range(n):
                    f[u, v] = 0.0
        level = is_steady(x[j, SPEED], max(p[j, 3, 3], smooth_p[j, 3, 3]))
        turned(smooth_p, j, difference(smooth_x, j, x[j], level, work[0]))
        if math.isnan(inverse(p[j], inverted, lower)):
            continue
        product_transposed(mixed_p[j], f, a)
        product(a, inverted, gain)
        for u in range(n):
            for v in range(n):
                b[u, v] = smooth_p[j, u, v] - p[j, u, v]
        product(gain, b, c)
        product_transposed(c, gain, a)
        for u in range(n):
            total = 0.0
            for v in range(n):
                total += gain[u, v] * work[0, v]
                a[u, v] += mixed_p[j, u, v]
            work[1, u] = total
        # all at `origin`
        angle = difference(mixed_x, j, origin, steady, d_mixed[j])
        turned(mixed_p, j, angle)
        for u in range(n):
            for v in range(n):
                p[j, u, v] = a[u, v]
        turned(p, j, angle)
        if angle != 0.0:
            cosine, sine = math.cos(angle), math.sin(angle)
            work[1, SPEED], work[1, COURSE] = (
                cosine * work[1, SPEED] - sine * work[1, COURSE],
                sine * work[1, SPEED] + cosine * work[1, COURSE],
            )
        for u in range(n):
            d_smooth[j, u] = d_mixed[j, u] + work[1, u]
        total = 0.0
        for i in range(m):
            total += before[i] * change[i, j]
        share(j, before, change, total, d, p0, d_mixed, mixed_p, d_smooth, p, smooth_probability[j], room)
    total = 0.0
    for i in range(m):
        total += after[0, i]
    for i in range(m):
        smooth_probability[i] = after[0, i] / total if total > 0.0 else before[i]
        if after[0, i] <= 0.0:
            for u in range(n):
                smooth_x[i, u] = x0[i, u]
                for v in range(n):
                    smooth_p[i, u, v] = p0[i, u, v]
            continue
        for u in range(n):
            new_x[i, u] /= after[0, i]
        for u in range(n):
            for v in range(n):
                smooth_p[i, u, v] = new_p[i, u, v] / after[0, i] - new_x[i, u] * new_x[i, v]
        shifted(origin, new_x[i], steady, smooth_x, smooth_p, i)


@called_kernel
def share(j, before, change, normal, d, p0, d_mixed, mixed_p, d_smooth, smoothed_p, weight, room):
    """Give mode j's smoothed row to the components that it was mixed of, by what the future says of each."""
    m, n = p0.shape[0], d.shape[1]
    vectors, after, weights, new_x, new_p = room[11], room[17], room[18], room[19], room[20:25]
    information, vector, shift = room[10], vectors[0], vectors[1]
    for u in range(n):
        shift[u] = d_smooth[j, u] - d_mixed[j, u]
    future(smoothed_p[j], shift, mixed_p[j], information, vector, room)
    lower, c, log_of = room[12], room[14], room[_INVERSES + MODES, 0]
    highest = -math.inf
    for i in range(m):
        part = before[i] * change[i, j] / normal
        weights[0, i] = -math.inf
        if part < _NEGLIGIBLE_PART:
            continue
        a = room[_INVERSES + i]
        if log_of[i] == 0.0:
            log_of[i] = inverse(p0[i], a, lower)
        log_a = log_of[i]
        quadratic = 0.0
        for u in range(n):
            total = 0.0
            for v in range(n):
                total += a[u, v] * (d[i, v] - d_mixed[j, v])
                c[u, v] = a[u, v] + information[u, v]
            quadratic += (d[i, u] - d_mixed[j, u]) * total
            vectors[1, u] = total + vector[u]
        covariance = room[25 + i]
        log_c = inverse(c, covariance, lower)
        if math.isnan(log_a) or math.isnan(log_c):
            continue
        for u in range(n):
            total = 0.0
            for v in range(n):
                total += covariance[u, v] * vectors[1, v]
            quadratic -= vectors[1, u] * total
            room[30, i, u] = total + d_mixed[j, u]
        if not is_near(room[30, i], d[i], p0[i]):
            continue
        weights[0, i] = math.log(part) - 0.5 * _TEMPER * (log_a + log_c + quadratic)
        highest = max(highest, weights[0, i])
    if highest == -math.inf:
        return
    total = 0.0
    for i in range(m):
        if weights[0, i] > -math.inf:
            total += math.exp(weights[0, i] - highest)
    for i in range(m):
        if weights[0, i] > -math.inf:
            portion = weight * math.exp(weights[0, i] - highest) / total
            if portion > 1e-6:
                add(i, portion, room[30, i], room[25 + i], after, new_x, new_p)


@called_kernel
def is_near(mean, before, covariance):
    """Whether a smoothed mean is one that rounding has not spoilt: within so many deviations of what it was before."""
    for u in range(len(mean)):
        if not abs(mean[u] - before[u]) <= _SPOILT * math.sqrt(covariance[u, u]):
            return False
    return True


@called_kernel
def add(i, portion, mean, covariance, after, new_x, new_p):
    """Add a Gaussian of this weight to the moments of mode i."""
    n = len(mean)
    after[0, i] += portion
    for u in range(n):
        new_x[i, u] += portion * mean[u]
        for v in range(n):
            new_p[i, u, v] += portion * (covariance[u, v] + mean[u] * mean[v])


@called_kernel
def smooth_kept(time, model, bank, motion_states, kept, room, out):
    """Smoothed `fuse` of every row that `bank.run_record` kept; intervals of at most LONGEST_STEP.

    room: (ROOM, n, n). out: (rows, FUSED + 2), of which the first FUSED columns are filled.
    """
    rows = len(time)
    x, p, probability = room[ROOM - 9, :MODES], room[ROOM - 8 : ROOM - 3], room[ROOM - 2, 0]
    m = kept.x.shape[1]
    for k in range(rows - 1, -1, -1):
        if math.isnan(kept.probability[k, 0]):
            for i in range(out.shape[1]):
                out[k, i] = math.nan
            continue
        if k == rows - 1 or kept.moved[k + 1, 2] == 1.0:
            recall(kept, k, x, p, probability)
        elif time[k + 1] > time[k]:
            dt = time[k + 1] - time[k]
            if abs(dt - bank.steps[0, 0, 0]) > SAME_STEP * dt:
                set_steps(bank.steps, bank.change, bank.work, dt, model)
            recall(kept, k, bank.x, bank.p, bank.probability)
            for i in range(m):
                bank.run[STEPPED + i] = kept.moved[k + 1, 3 + i]
                x[i, NORTH] -= kept.moved[k + 1, 0]
                x[i, EAST] -= kept.moved[k + 1, 1]
            back(bank, model, motion_states, x, p, probability, room)
        fuse(x, p, probability, model.filters, bank.work[0], out[k])
