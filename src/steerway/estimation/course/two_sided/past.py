"""The bank that comes from the past: Kalman filters of deviations, one for each hypothesis."""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.course.aiding import SCALAR_GATE, aided, correct_scalar, scalar_innovation
from steerway.estimation.course.five_state import set_step
from steerway.estimation.course.model import COURSE, DT, ERROR_PAIRS, ERROR_STATE, GATE, STARTS_IN
from steerway.estimation.course.position_update import correct, innovation, normalised_square
from steerway.estimation.course.two_sided.deviations import FIX, PLACE_LOST, fix_of, linearise, lose_place, taken_anew
from steerway.estimation.course.two_sided.hypotheses import (
    LOG_WEIGHT,
    MANNERS,
    copy,
    normalise,
    part,
    set_chances,
)
from steerway.estimation.course.way import forget_manoeuvre
from steerway.estimation.course.yawing import predict_underway


@lean_kernel
def begin(bank, began, trajectory, manners):
    """All hypotheses alike: what the filter knew, `began` (n + 2, n), when the vessel had gathered way."""
    n = bank.shape[3]
    for m in range(MANNERS):
        for h in range(bank.shape[1] - 1):
            copy(began, bank[m, h])
            d, book = bank[m, h, n], bank[m, h, n + 1]
            forget_manoeuvre(d, bank[m, h, :n], manners[m])
            for i in range(n):
                d[i] -= trajectory[n, i]
            d[COURSE] = wrap(d[COURSE])
            book[LOG_WEIGHT] = math.log(manners[m, STARTS_IN] / (bank.shape[1] - 1))


@kernel
def go_on(record, kept, manners, bank, believed, first, last, stored):
    """Take the bank from row `first` to row `last`, and copy it into `stored` (rows or 0, …) after every row.

    Args:
        believed: (rows, BELIEFS) bool, of the whole record: receives what at least one hypothesis believed.
    """
    n = kept.shape[2]
    time, aids, geodetic = record[0], record[4], record[5]
    steps, chances = np.zeros((MANNERS, 3, n)), np.empty(MANNERS)
    f, q, offset, work = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty((4, n))
    if len(stored):
        stored[0] = bank[:, :-1]
    for k in range(first + 1, last + 1):
        dt = time[k] - time[k - 1]
        if k == first + 1 or dt != steps[0][DT]:
            set_chances(chances, dt, manners)
            for m in range(MANNERS):
                set_step(steps[m], dt, manners[m])
        for m in range(MANNERS):
            linearise(kept, k - 1, geodetic, steps[m], manners[m], f, offset, q)
            for h in range(bank.shape[1] - 1):
                predict(bank[m, h], kept, k - 1, steps[m], manners[m], f, offset, work)
        take_fix(bank, fix_of(record, k, kept, manners[0]), taken_anew(kept, k), believed[k], manners[0], work)
        if len(aids):
            take_aids(bank, aids[k], kept[k, n], believed[k], manners[0], work)
        normalise(bank)
        if dt > 0.0:
            part(bank, chances, False)
        if len(stored):
            stored[k - first] = bank[:, :-1]


@lean_kernel
def predict(one, kept, k, step, model, f, offset, work):
    """Predict a hypothesis from row k to the next."""
    n = one.shape[1]
    p, d, x, turned = one[:n], one[n], work[0], work[1]
    for i in range(n):
        x[i] = kept[k, n, i]
        turned[i] = offset[i]
        for j in range(n):
            turned[i] += f[i, j] * d[j]
    predict_underway(x, p, step, model)
    for i in range(n):
        d[i] = turned[i]


@lean_kernel
def take_fix(bank, fix, anew, believed, model, work):
    """Correct every hypothesis and its weight by a fix (north, east, variance) that at least one of them can believe.

    The filter believes with the mean of all, which an unlikely turn hardly widens. Where it took its position anew
    (`anew`) and none of these believes the fix either, they lose theirs too.
    """
    believed[FIX] = believed[PLACE_LOST] = False
    if fix[2] == math.inf:
        return
    n = bank.shape[3]
    believed[FIX] = least_square(bank, fix, model) <= model[GATE]
    if anew and not believed[FIX]:
        believed[FIX] = believed[PLACE_LOST] = True
        for m in range(MANNERS):
            for h in range(bank.shape[1] - 1):
                lose_place(bank[m, h])
    if not believed[FIX]:
        return
    g, pairs = int(model[ERROR_STATE]), int(model[ERROR_PAIRS])
    for m in range(MANNERS):
        for h in range(bank.shape[1] - 1):
            p, d = bank[m, h, :n], bank[m, h, n]
            nu_n, nu_e, s_nn, s_ne, s_ee = innovation(d, p, fix[0], fix[1], fix[2], fix[2], g, pairs)
            surprise = normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee) + math.log(s_nn * s_ee - s_ne * s_ne)
            bank[m, h, n + 1, LOG_WEIGHT] -= 0.5 * surprise
            correct(d, p, work, nu_n, nu_e, s_nn, s_ne, s_ee, g, pairs)


@lean_kernel
def least_square(bank, fix, model):
    """Least NIS that a hypothesis gives a fix."""
    n = bank.shape[3]
    g, pairs = int(model[ERROR_STATE]), int(model[ERROR_PAIRS])
    least = math.inf
    for m in range(MANNERS):
        for h in range(bank.shape[1] - 1):
            nu_n, nu_e, s_nn, s_ne, s_ee = innovation(
                bank[m, h, n], bank[m, h, :n], fix[0], fix[1], fix[2], fix[2], g, pairs
            )
            least = min(least, normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee))
    return least


@lean_kernel
def take_aids(bank, aids, trajectory, believed, model, work):
    """Correct every hypothesis and its weight by every aid that at least one of them can believe."""
    n = bank.shape[3]
    for which in range(len(aids)):
        believed[which] = False
        if not math.isfinite(aids[which]):
            continue
        i, companion, sign, seen, variance = aided(which, aids[which], trajectory, model)
        for m in range(MANNERS):
            for h in range(bank.shape[1] - 1):
                nu = seen - bank[m, h, n, i] - sign * bank[m, h, n, companion]
                s = scalar_innovation(bank[m, h, :n], work, i, companion, sign, variance)
                believed[which] |= nu * nu <= SCALAR_GATE * s
        if not believed[which]:
            continue
        for m in range(MANNERS):
            for h in range(bank.shape[1] - 1):
                nu = seen - bank[m, h, n, i] - sign * bank[m, h, n, companion]
                s = scalar_innovation(bank[m, h, :n], work, i, companion, sign, variance)
                bank[m, h, n + 1, LOG_WEIGHT] -= 0.5 * (nu * nu / s + math.log(s))
                correct_scalar(bank[m, h, n], bank[m, h, :n], work, i, companion, sign, nu, variance, math.inf)
