"""A vessel that holds her course and turns by turns: several five-state filters that interact.

The interacting multiple model filter of H. A. P. Blom and Y. Bar-Shalom, IEEE Trans. Automatic Control 33(8), 1988.
Each mode is an extended Kalman filter on the kernels of the plain one, with the same states: those beyond the five
(errors of the receiver, biases of aids) are mixed with the rest. What the vessel is said to do is the mean of all and
its spread.

Modes change in continuous time, so that neither the filter's rate nor a gap changes the tuning: a mode is left for the
other manner of moving, or it ages into the next. The filter of a course just taken up knows it badly; were it one with
that of a course long held, as in the textbook's form, it would keep spoiling that.

A memory of m modes is (1 + 2m, n + 10 + m, n): the mean, the modes, and a copy of them to mix from, each laid out as a
plain filter's memory. The last 1 + m rows of the mean's are the probabilities of the modes and how they change in a
step.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import lean_kernel
from steerway.estimation.course.aiding import SCALAR_GATE, aided, correct_scalar, scalar_innovation, surprise_at
from steerway.estimation.course.five_state import set_step
from steerway.estimation.course.model import (
    AGEING,
    AGES_TO,
    COURSE,
    ERROR_PAIRS,
    ERROR_STATE,
    LEAVING,
    LOST_COURSE_VARIANCE,
    POSITION_VARIANCE,
    STARTS_IN,
    SWITCHES_TO,
)
from steerway.estimation.course.position_update import correct, innovation, normalised_square
from steerway.estimation.course.way import fold, forget_manoeuvre, take_place
from steerway.estimation.course.yawing import predict_underway

_LEAST_PROBABILITY = 1e-6
"""No mode is ever ruled out."""
_NEGLIGIBLE = 1e-7
"""Part that one mode has in another below which it is left out."""
SURPRISE = 0
"""Bookkeeping of a mode: −2 log of the density it gave the last measurement (less 2 log 2π for a fix)."""


@lean_kernel
def set_steps(memory, dt, models):
    """Fill the step of every mode, and how they change in dt seconds: e^{G dt} of their rates G."""
    n, m = memory.shape[2], len(models) - 1
    change, power, product = memory[0, n + 10 :], memory[1, n + 10 :], memory[2, n + 10 :]
    for i in range(m):
        set_step(memory[1 + i, n + 6 : n + 9], dt, models[1 + i])
        for j in range(m):
            power[i, j] = change[i, j] = 1.0 if i == j else 0.0
    for order in range(1, 9):
        for i in range(m):
            for j in range(m):
                product[i, j] = 0.0
        for i in range(m):
            leaving, ageing = models[1 + i, LEAVING], models[1 + i, AGEING]
            other, older = int(models[1 + i, SWITCHES_TO]) - 1, int(models[1 + i, AGES_TO]) - 1
            for j in range(m):
                product[j, i] -= power[j, i] * (leaving + ageing)
                product[j, other] += power[j, i] * leaving
                if ageing > 0.0:
                    product[j, older] += power[j, i] * ageing
        for i in range(m):
            for j in range(m):
                power[i, j] = product[i, j] * dt / order
                change[i, j] += power[i, j]


@lean_kernel
def part_ways(memory, models):
    """Every mode begins from the mean, with the course rate that is its own."""
    n, m = memory.shape[2], len(models) - 1
    for k in range(1, 1 + m):
        for i in range(n + 1):
            for j in range(n):
                memory[k, i, j] = memory[0, i, j]
        forget_manoeuvre(memory[k, n], memory[k, :n], models[k])
        memory[0, n + 9, k - 1] = models[k, STARTS_IN]
    join(memory)


@lean_kernel
def join(memory):
    """The mean of all modes and its covariance."""
    n, m = memory.shape[2], (len(memory) - 1) // 2
    blend(memory, memory[0, n + 9], 1, m, memory[0])
    fold(memory[0, n], memory[0, :n])


@lean_kernel
def blend(memory, weights, first, m, out):
    """Mean and covariance of a mixture of the filters memory[first : first + m] into `out`, another filter's memory.

    weights: (m,) or longer, of sum 1. Around the likeliest of them, so that courses are averaged on the circle.
    """
    n = memory.shape[2]
    p, x, d, mean = out[:n], out[n], out[n + 2], out[n + 3]
    origin = 0
    for k in range(1, m):
        if weights[k] > weights[origin]:
            origin = k
    reference = memory[first + origin, n]
    for i in range(n):
        mean[i] = 0.0
        for j in range(i, n):
            p[i, j] = weights[origin] * memory[first + origin, i, j]
    for k in range(m):
        weight = weights[k]
        if k == origin or weight < _NEGLIGIBLE:
            continue
        state = memory[first + k, n]
        for i in range(n):
            d[i] = state[i] - reference[i]
        d[COURSE] = wrap(d[COURSE])
        for i in range(n):
            mean[i] += weight * d[i]
            for j in range(i, n):
                p[i, j] += weight * (memory[first + k, i, j] + d[i] * d[j])
    for i in range(n):
        x[i] = reference[i] + mean[i]
        for j in range(i, n):
            p[i, j] -= mean[i] * mean[j]


@lean_kernel
def mix(memory):
    """What each mode starts a step from: all of them, as likely as each of them led to it."""
    n, m = memory.shape[2], (len(memory) - 1) // 2
    probability, change = memory[0, n + 9], memory[0, n + 10 :]
    for k in range(1, 1 + m):
        for i in range(n):
            memory[m + k, n, i] = memory[k, n, i]
            for j in range(i, n):
                memory[m + k, i, j] = memory[k, i, j]
    after = memory[1 + m, n + 2]
    for j in range(m):
        weights = memory[1 + m, n + 3]
        after[j] = 0.0
        for i in range(m):
            weights[i] = probability[i] * change[i, j]
            after[j] += weights[i]
        for i in range(m):
            weights[i] /= after[j]
        blend(memory, weights, 1 + m, m, memory[1 + j])
    total = 0.0
    for j in range(m):
        total += after[j]
    for j in range(m):
        probability[j] = after[j] / total


@lean_kernel
def predict_modes(memory, models):
    """One step of every mode."""
    mix(memory)
    n = memory.shape[2]
    for k in range(1, len(models)):
        predict_underway(memory[k, n], memory[k, :n], memory[k, n + 6 : n + 9], models[k])


@lean_kernel
def course_is_lost(memory):
    """Whether the mean's course means nothing any more; only then is it worth reckoning."""
    for k in range(1, 1 + (len(memory) - 1) // 2):
        if memory[k, COURSE, COURSE] > LOST_COURSE_VARIANCE:
            join(memory)
            return memory[0, COURSE, COURSE] > LOST_COURSE_VARIANCE
    return False


@lean_kernel
def weigh_fix(memory, north, east, doubt, models):
    """NIS of a fix against the mean of all modes, and what with it makes −2 log of its density (less 2 log 2π).

    And the least NIS, of the mean or of a mode: an unlikely turn hardly widens the mean, and yet foretells where she
    is at the beginning of one.
    """
    n = memory.shape[2]
    probability = memory[0, n + 9]
    g, pairs, variance = int(models[1, ERROR_STATE]), int(models[1, ERROR_PAIRS]), doubt * models[1, POSITION_VARIANCE]
    mean_n = mean_e = mean_nn = mean_ne = mean_ee = 0.0
    least = math.inf
    for k in range(1, len(models)):
        p, x = memory[k, :n], memory[k, n]
        nu_n, nu_e, s_nn, s_ne, s_ee = innovation(x, p, north, east, variance, variance, g, pairs)
        square = normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee)
        least = min(least, square)
        memory[k, n + 1, SURPRISE] = square + math.log(s_nn * s_ee - s_ne * s_ne)
        weight = probability[k - 1]
        mean_n += weight * nu_n
        mean_e += weight * nu_e
        mean_nn += weight * (s_nn + nu_n * nu_n)
        mean_ne += weight * (s_ne + nu_n * nu_e)
        mean_ee += weight * (s_ee + nu_e * nu_e)
    spread = mean_nn - mean_n * mean_n, mean_ne - mean_n * mean_e, mean_ee - mean_e * mean_e
    nis = normalised_square(mean_n, mean_e, spread[0], spread[1], spread[2])
    return nis, surprise_of_all(memory) - nis, min(nis, least)


@lean_kernel
def surprise_of_all(memory):
    """−2 log of the density that all modes together gave the last measurement, each as likely as it is."""
    n, m = memory.shape[2], (len(memory) - 1) // 2
    probability = memory[0, n + 9]
    least = math.inf
    for k in range(m):
        least = min(least, memory[1 + k, n + 1, SURPRISE])
    density = 0.0
    for k in range(m):
        density += probability[k] * math.exp(0.5 * (least - memory[1 + k, n + 1, SURPRISE]))
    return least - 2.0 * math.log(density)


@lean_kernel
def correct_modes(memory, north, east, doubt, models):
    """Correct every mode by a fix that has been weighed, and their probabilities by how well each foretold it."""
    n = memory.shape[2]
    g, pairs, variance = int(models[1, ERROR_STATE]), int(models[1, ERROR_PAIRS]), doubt * models[1, POSITION_VARIANCE]
    m = len(models) - 1
    for k in range(1, 1 + m):
        p, x, work = memory[k, :n], memory[k, n], memory[k, n + 2 : n + 6]
        nu_n, nu_e, s_nn, s_ne, s_ee = innovation(x, p, north, east, variance, variance, g, pairs)
        before = memory[m + k, n]
        for i in range(n):
            before[i] = x[i]
        correct(x, p, work, nu_n, nu_e, s_nn, s_ne, s_ee, g, pairs)
        turn_along(x, p, before, g, pairs)
    judge_modes(memory)


@lean_kernel
def turn_along(x, p, before, g, pairs):
    """Make a correction one of a pose in the plane: where the course turns, the way there bends and the spread turns.

    x and P are those after a linear correction of the state `before`. This is the left-invariant form of A. Barrau and
    S. Bonnabel, IEEE Trans. Automatic Control 62(4), 2017, on SE(2): an error of the course does not pass for one of
    the speed. Errors of the receiver turn along, so that their sum with the position stays as well known as it was.
    """
    angle = x[COURSE] - before[COURSE]
    c, s = math.cos(angle), math.sin(angle)
    along, across = (s / angle, (1.0 - c) / angle) if abs(angle) > 1e-6 else (1.0, 0.5 * angle)
    turn_pair(x, p, before, 0, c, s, along, across)
    if g:
        for i in range(g, g + 2 * pairs, 2):
            turn_pair(x, p, before, i, c, s, along, across)


@lean_kernel
def turn_pair(x, p, before, a, c, s, along, across):
    """The states a and a + 1 of `turn_along`."""
    north, east = x[a] - before[a], x[a + 1] - before[a + 1]
    x[a] = before[a] + along * north - across * east
    x[a + 1] = before[a + 1] + across * north + along * east
    rotate_pair(p, a, c, s)


@lean_kernel
def rotate_pair(p, a, c, s):
    """P ← J P Jᵀ in place, J a rotation of the states a and a + 1."""
    b = a + 1
    for i in range(a):
        p[i, a], p[i, b] = c * p[i, a] - s * p[i, b], s * p[i, a] + c * p[i, b]
    for j in range(a + 2, p.shape[1]):
        p[a, j], p[b, j] = c * p[a, j] - s * p[b, j], s * p[a, j] + c * p[b, j]
    aa, ab, bb = p[a, a], p[a, b], p[b, b]
    p[a, a] = c * c * aa - 2.0 * c * s * ab + s * s * bb
    p[a, b] = c * s * (aa - bb) + (c * c - s * s) * ab
    p[b, b] = s * s * aa + 2.0 * c * s * ab + c * c * bb


@lean_kernel
def judge_modes(memory):
    """Bayes' rule for the probabilities of the modes, by the surprise of each."""
    n, m = memory.shape[2], (len(memory) - 1) // 2
    probability = memory[0, n + 9]
    least = math.inf
    for k in range(m):
        least = min(least, memory[1 + k, n + 1, SURPRISE])
    total = 0.0
    for k in range(m):
        probability[k] *= math.exp(0.5 * (least - memory[1 + k, n + 1, SURPRISE]))
        total += probability[k]
    for k in range(m):
        probability[k] = probability[k] / total * (1.0 - m * _LEAST_PROBABILITY) + _LEAST_PROBABILITY


@lean_kernel
def aid_modes(memory, aids, models):
    """Correct every mode by every aid that is known (not NaN) and that at least one of them can believe.

    Returns the sum of their surprises.
    """
    n = memory.shape[2]
    surprise = 0.0
    for which in range(len(aids)):
        if not math.isfinite(aids[which]):
            continue
        least = math.inf
        for k in range(1, len(models)):
            p, x, work = memory[k, :n], memory[k, n], memory[k, n + 2 : n + 6]
            i, companion, sign, nu, variance = aided(which, aids[which], x, models[k])
            s = scalar_innovation(p, work, i, companion, sign, variance)
            least = min(least, nu * nu / s)
            memory[k, n + 1, SURPRISE] = nu * nu / s + math.log(s)
        surprise += surprise_at(surprise_of_all(memory))
        if least > SCALAR_GATE:
            continue
        for k in range(1, len(models)):
            p, x, work = memory[k, :n], memory[k, n], memory[k, n + 2 : n + 6]
            i, companion, sign, nu, variance = aided(which, aids[which], x, models[k])
            correct_scalar(x, p, work, i, companion, sign, nu, variance, math.inf)
        judge_modes(memory)
    return surprise


@lean_kernel
def fold_modes(memory):
    """U ≥ 0 and χ in [−π, π) in every mode."""
    n, m = memory.shape[2], (len(memory) - 1) // 2
    for k in range(1, 1 + m):
        fold(memory[k, n], memory[k, :n])


@lean_kernel
def take_place_modes(memory, north, east, doubt, models):
    """Take the position anew from a fix in every mode."""
    n = memory.shape[2]
    for k in range(1, len(models)):
        take_place(memory[k, n], memory[k, :n], north, east, doubt, models[k])


@lean_kernel
def shift_modes(memory, north, east):
    """Move the origin of the plane by north and east (m)."""
    n, m = memory.shape[2], (len(memory) - 1) // 2
    for k in range(1, 1 + m):
        memory[k, n, 0] -= north
        memory[k, n, 1] -= east
