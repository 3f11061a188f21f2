"""The forward bank: Kalman filters of deviations, one for each hypothesis."""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.kalman import correct, correct_scalar, normalised_square, scalar_innovation
from steerway.core.statistics import AID_GATE
from steerway.estimation.course.motion.layout import COURSE, DT, ERROR_PAIRS, ERROR_STATE, GATE, STARTS_IN, STEP_ROWS
from steerway.estimation.course.motion.models import predict as predict_mode
from steerway.estimation.course.motion.models import set_step
from steerway.estimation.course.smoothing.hypotheses import (
    LOG_WEIGHT,
    MODES,
    copy,
    normalise,
    set_change_probabilities,
    spawn,
)
from steerway.estimation.course.smoothing.linearised import (
    FIX,
    POSITION_RESET,
    fix_innovation,
    fix_of,
    forget_position,
    linearise,
    was_reset,
)
from steerway.estimation.course.steerageway import reset_manoeuvre
from steerway.estimation.course.update.aids import measured
from steerway.estimation.course.update.outliers import fix_nll


@called_kernel
def start_forward(bank, filtered, trajectory, modes):
    """All hypotheses equal: the filter state `filtered` (n + 2, n) at the first row with a course."""
    n = bank.shape[3]
    for m in range(MODES):
        for h in range(bank.shape[1] - 1):
            copy(filtered, bank[m, h])
            d, flags = bank[m, h, n], bank[m, h, n + 1]
            reset_manoeuvre(d, bank[m, h, :n], modes[m])
            for i in range(n):
                d[i] -= trajectory[n, i]
            d[COURSE] = wrap(d[COURSE])
            flags[LOG_WEIGHT] = math.log(modes[m, STARTS_IN] / (bank.shape[1] - 1))


@kernel
def run_forward(record, kept, modes, bank, accepted, first, last, stored):
    """Take the bank from row `first` to row `last`, and copy it into `stored` (rows or 0, …) after every row.

    Args:
        accepted: (rows, ROW_FLAGS) bool, of the whole record: set where at least one hypothesis accepts.
    """
    n = kept.shape[2]
    time, aids, geodetic = record[0], record[4], record[5]
    steps, change = np.zeros((MODES, STEP_ROWS, n)), np.empty(MODES)
    both, offset, work = np.empty((n, 2 * n)), np.empty(n), np.empty((4, n))
    f, q = np.empty((n, n)), np.empty((n, n))
    if len(stored):
        stored[0] = bank[:, :-1]
    for k in range(first + 1, last + 1):
        dt = time[k] - time[k - 1]
        if k == first + 1 or dt != steps[0][DT]:
            set_change_probabilities(change, dt, modes)
            for m in range(MODES):
                set_step(steps[m], dt, modes[m])
        for m in range(MODES):
            linearise(kept, k - 1, geodetic, steps[m], modes[m], both, f, offset, q)
            for h in range(bank.shape[1] - 1):
                predict_hypothesis(bank[m, h], kept, k - 1, steps[m], modes[m], f, offset, work)
        take_fix(bank, fix_of(record, k, kept, modes[0]), was_reset(kept, k), accepted[k], modes[0], work)
        if len(aids):
            take_aids(bank, aids[k], kept[k, n], accepted[k], modes[0], work)
        normalise(bank)
        if dt > 0.0:
            spawn(bank, change, False)
        if len(stored):
            stored[k - first] = bank[:, :-1]


@called_kernel
def predict_hypothesis(one, kept, k, step, parameters, f, offset, work):
    """Predict a hypothesis from row k to the next."""
    n = one.shape[1]
    p, d, x, turned = one[:n], one[n], work[0], work[1]
    for i in range(n):
        x[i] = kept[k, n, i]
        turned[i] = offset[i]
        for j in range(n):
            turned[i] += f[i, j] * d[j]
    predict_mode(x, p, step, parameters)
    for i in range(n):
        d[i] = turned[i]


@called_kernel
def take_fix(bank, fix, anew, accepted, parameters, work):
    """Correct every hypothesis and its weight by a fix of `fix_of` within the gate of at least one of them.

    Where the filter reset its position to the fix (`anew`) and no hypothesis accepts it either, their positions are
    reset too.
    """
    accepted[FIX] = accepted[POSITION_RESET] = False
    if fix[2] == math.inf:
        return
    n = bank.shape[3]
    accepted[FIX] = least_square(bank, fix, parameters) <= parameters[GATE]
    if anew and not accepted[FIX]:
        accepted[FIX] = accepted[POSITION_RESET] = True
        for m in range(MODES):
            for h in range(bank.shape[1] - 1):
                forget_position(bank[m, h])
    if not accepted[FIX]:
        return
    g, pairs = int(parameters[ERROR_STATE]), int(parameters[ERROR_PAIRS])
    for m in range(MODES):
        for h in range(bank.shape[1] - 1):
            p, d = bank[m, h, :n], bank[m, h, n]
            nu_n, nu_e, s_nn, s_ne, s_ee = fix_innovation(d, p, fix, g, pairs)
            nis = normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee)
            bank[m, h, n + 1, LOG_WEIGHT] -= fix_nll(nis, s_nn * s_ee - s_ne * s_ne)
            correct(d, p, work, nu_n, nu_e, s_nn, s_ne, s_ee, g, pairs)


@lean_kernel
def least_square(bank, fix, parameters):
    """Least NIS that a hypothesis gives a fix."""
    n = bank.shape[3]
    g, pairs = int(parameters[ERROR_STATE]), int(parameters[ERROR_PAIRS])
    least = math.inf
    for m in range(MODES):
        for h in range(bank.shape[1] - 1):
            nu_n, nu_e, s_nn, s_ne, s_ee = fix_innovation(bank[m, h, n], bank[m, h, :n], fix, g, pairs)
            least = min(least, normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee))
    return least


@called_kernel
def take_aids(bank, aids, trajectory, accepted, parameters, work):
    """Correct every hypothesis and its weight by every aid within the gate of at least one of them."""
    n = bank.shape[3]
    for which in range(len(aids)):
        accepted[which] = False
        if not math.isfinite(aids[which]):
            continue
        i, companion, sign, seen, variance = measured(which, aids[which], trajectory, parameters)
        for m in range(MODES):
            for h in range(bank.shape[1] - 1):
                nu = seen - bank[m, h, n, i] - sign * bank[m, h, n, companion]
                s = scalar_innovation(bank[m, h, :n], work, i, companion, sign, variance)
                accepted[which] |= nu * nu <= AID_GATE * s
        if not accepted[which]:
            continue
        for m in range(MODES):
            for h in range(bank.shape[1] - 1):
                nu = seen - bank[m, h, n, i] - sign * bank[m, h, n, companion]
                s = scalar_innovation(bank[m, h, :n], work, i, companion, sign, variance)
                bank[m, h, n + 1, LOG_WEIGHT] -= 0.5 * (nu * nu / s + math.log(s))
                correct_scalar(bank[m, h, n], bank[m, h, :n], work, i, companion, sign, nu, variance, math.inf)
