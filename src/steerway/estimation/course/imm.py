"""Interacting multiple models: several motion models at once, mixed, predicted, corrected and combined.

H. A. P. Blom and Y. Bar-Shalom, IEEE Trans. Automatic Control 33(8), 1988. Each mode is an extended Kalman filter on
the kernels of the plain one, with the same states. The combined estimate is the moment-matched mixture of all modes.

Modes change in continuous time, so that neither the filter's rate nor a gap changes the tuning: a mode is left for the
other kind of motion, or it ages into the next. The filter of a course just taken up is uncertain of it; as one mode
with that of a course long held, as in the textbook's form, it would keep widening that.

With one mode nothing is mixed; all else is the same code.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.course.motion.five_state import predict as predict_five_states
from steerway.estimation.course.motion.layout import (
    AGEING,
    AGES_TO,
    CHANGES,
    COURSE,
    LEAVING,
    LOST_COURSE_VARIANCE,
    MOTION,
    NLL,
    NLLS,
    STARTS_IN,
    STEP,
    SWITCHES_TO,
    first_mode,
    mode_count,
)
from steerway.estimation.course.motion.models import FIVE_STATE, predict, set_step
from steerway.estimation.course.steerageway import fold, reset_manoeuvre

_LEAST_PROBABILITY = 1e-6
"""No mode is ever excluded: one of these takes two fixes of NIS 14 to come back."""
_NEGLIGIBLE = 1e-7
"""Weight below which a mode is left out of a mixture; well below `_LEAST_PROBABILITY` times a rate of change of 0.1."""
_SERIES_ORDER = 8
"""Terms of e^{G dt}: with rates of up to 1 1/s and steps of up to 1 s the rest is below 1e-5."""


@called_kernel
def set_steps(bank, dt, parameters):
    """Fill the step of every mode, and their transition probabilities in dt seconds: e^{G dt} of the rates G."""
    n, m = bank.shape[2], mode_count(bank)
    for k in range(len(parameters)):
        set_step(bank[k, n + STEP : n + NLLS], dt, parameters[k])
    if m == 1:
        return
    change, power, product = bank[0, n + CHANGES :], bank[1, n + CHANGES :], bank[2, n + CHANGES :]
    for i in range(m):
        for j in range(m):
            power[i, j] = change[i, j] = 1.0 if i == j else 0.0
    for order in range(1, _SERIES_ORDER + 1):
        for i in range(m):
            for j in range(m):
                product[i, j] = 0.0
        for i in range(m):
            leaving, ageing = parameters[1 + i, LEAVING], parameters[1 + i, AGEING]
            other, older = int(parameters[1 + i, SWITCHES_TO]) - 1, int(parameters[1 + i, AGES_TO]) - 1
            for j in range(m):
                product[j, i] -= power[j, i] * (leaving + ageing)
                product[j, other] += power[j, i] * leaving
                if ageing > 0.0:
                    product[j, older] += power[j, i] * ageing
        for i in range(m):
            for j in range(m):
                power[i, j] = product[i, j] * dt / order
                change[i, j] += power[i, j]


@called_kernel
def split(bank, parameters):
    """Start every mode from the combined estimate, with its own course rate."""
    n, m = bank.shape[2], mode_count(bank)
    if m == 1:
        return
    for k in range(1, 1 + m):
        for i in range(n + 1):
            for j in range(n):
                bank[k, i, j] = bank[0, i, j]
        reset_manoeuvre(bank[k, n], bank[k, :n], parameters[k])
        bank[0, n + NLLS, k - 1] = parameters[k, STARTS_IN]
    combine(bank)


@lean_kernel
def combine(bank):
    """The combined estimate: mean and covariance of the mixture of all modes."""
    n, m = bank.shape[2], mode_count(bank)
    if m > 1:
        match_moments(bank, bank[0, n + NLLS], first_mode(bank), m, bank[0])
        fold(bank[0, n], bank[0, :n])


@called_kernel
def match_moments(bank, weights, first, m, out):
    """Mean and covariance of a mixture of the filters bank[first : first + m] into `out`, another block.

    weights: (m,) or longer, of sum 1. Around the most probable of them, so that courses are averaged on the circle.
    """
    n = bank.shape[2]
    p, x, d, mean = out[:n], out[n], out[n + 2], out[n + 3]
    origin = 0
    for k in range(1, m):
        if weights[k] > weights[origin]:
            origin = k
    reference = bank[first + origin, n]
    for i in range(n):
        mean[i] = 0.0
        for j in range(i, n):
            p[i, j] = weights[origin] * bank[first + origin, i, j]
    for k in range(m):
        weight = weights[k]
        if k == origin or weight < _NEGLIGIBLE:
            continue
        state = bank[first + k, n]
        for i in range(n):
            d[i] = state[i] - reference[i]
        d[COURSE] = wrap(d[COURSE])
        for i in range(n):
            mean[i] += weight * d[i]
            for j in range(i, n):
                p[i, j] += weight * (bank[first + k, i, j] + d[i] * d[j])
    for i in range(n):
        x[i] = reference[i] + mean[i]
        for j in range(i, n):
            p[i, j] -= mean[i] * mean[j]


@called_kernel
def mix(bank):
    """The initial condition of each mode for a step: the mixture of all, by the probability of a change to it."""
    n, m = bank.shape[2], mode_count(bank)
    probability, change = bank[0, n + NLLS], bank[0, n + CHANGES :]
    for k in range(1, 1 + m):
        for i in range(n):
            bank[m + k, n, i] = bank[k, n, i]
            for j in range(i, n):
                bank[m + k, i, j] = bank[k, i, j]
    after = bank[1 + m, n + 2]
    for j in range(m):
        weights = bank[1 + m, n + 3]
        after[j] = 0.0
        for i in range(m):
            weights[i] = probability[i] * change[i, j]
            after[j] += weights[i]
        for i in range(m):
            weights[i] /= after[j]
        match_moments(bank, weights, 1 + m, m, bank[1 + j])
    total = 0.0
    for j in range(m):
        total += after[j]
    for j in range(m):
        probability[j] = after[j] / total


@lean_kernel
def predict_modes(bank, parameters):
    """One step of every mode. The five-state model is inlined here: a fifth of the time of the plain filter."""
    if mode_count(bank) > 1:
        mix(bank)
    n, first = bank.shape[2], first_mode(bank)
    for k in range(first, first + mode_count(bank)):
        p, x, step = bank[k, :n], bank[k, n], bank[k, n + STEP : n + NLLS]
        if parameters[k, MOTION] == FIVE_STATE:
            predict_five_states(x, p, step, parameters[k])
        else:
            predict(x, p, step, parameters[k])


@lean_kernel
def course_is_lost(bank):
    """Whether the combined course is no longer defined; modes are combined only where one of them has lost it."""
    first = first_mode(bank)
    for k in range(first, first + mode_count(bank)):
        if bank[k, COURSE, COURSE] > LOST_COURSE_VARIANCE:
            combine(bank)
            return bank[0, COURSE, COURSE] > LOST_COURSE_VARIANCE
    return False


@lean_kernel
def mixture_nll(bank):
    """Negative log likelihood of the last measurement under all modes together."""
    n, m, first = bank.shape[2], mode_count(bank), first_mode(bank)
    if m == 1:
        return bank[first, n + NLLS, NLL]
    least = math.inf
    for k in range(m):
        least = min(least, bank[first + k, n + NLLS, NLL])
    density = 0.0
    for k in range(m):
        density += bank[0, n + NLLS, k] * math.exp(least - bank[first + k, n + NLLS, NLL])
    return least - math.log(density)


@lean_kernel
def update_probabilities(bank):
    """Bayes' rule for the probabilities of the modes."""
    n, m = bank.shape[2], mode_count(bank)
    if m == 1:
        return
    probability = bank[0, n + NLLS]
    least = math.inf
    for k in range(m):
        least = min(least, bank[1 + k, n + NLLS, NLL])
    total = 0.0
    for k in range(m):
        probability[k] *= math.exp(least - bank[1 + k, n + NLLS, NLL])
        total += probability[k]
    for k in range(m):
        probability[k] = probability[k] / total * (1.0 - m * _LEAST_PROBABILITY) + _LEAST_PROBABILITY


@lean_kernel
def fold_modes(bank):
    """U ≥ 0 and χ in [−π, π) in every mode."""
    n, first = bank.shape[2], first_mode(bank)
    for k in range(first, first + mode_count(bank)):
        fold(bank[k, n], bank[k, :n])
