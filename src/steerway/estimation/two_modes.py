"""A vessel that holds her course and turns by turns: two five-state filters that interact.

The interacting multiple model filter of H. A. P. Blom and Y. Bar-Shalom, IEEE Trans. Automatic Control 33(8), 1988,
with the modes changing in continuous time, so that neither the filter's rate nor a gap changes the tuning. Each mode is
an extended Kalman filter on the kernels of the plain one, with the same states: those beyond the five (errors of the
receiver, biases of aids) are mixed with the rest. What the vessel is said to do is the mean of both and its spread.

A memory of two modes is (3, n + 10, n): the mean, the straight filter, the turning one, each laid out as a plain
filter's memory. The last row of the mean's holds the probability of the turn and how the modes change in a step.
"""

import math

from steerway.angles import wrap
from steerway.compiled import lean_kernel
from steerway.estimation.aiding import SCALAR_GATE, aided, correct_scalar, scalar_innovation
from steerway.estimation.five_state import predict, set_step
from steerway.estimation.model import (
    COURSE,
    ERROR_PAIRS,
    ERROR_STATE,
    LEAVING,
    POSITION_VARIANCE,
)
from steerway.estimation.position_update import correct, innovation, normalised_square
from steerway.estimation.way import fold, forget_rate, take_place

TURN_PROBABILITY, STRAIGHT_ENDS, TURN_ENDS = range(3)
"""The last row: probability of the turn; that a straight course, and that a turn, is over after a step."""

_LEAST_PROBABILITY = 1e-6


@lean_kernel
def parts(memory):
    """Covariance, state and workspace (4, n) of one filter's memory."""
    n = memory.shape[1]
    return memory[:n], memory[n], memory[n + 2 : n + 6]


@lean_kernel
def modes_row(memory):
    """The row of a memory of two modes that tells how likely each is."""
    return memory[0, memory.shape[2] + 9]


@lean_kernel
def set_steps(memory, dt, models):
    """Fill the step of either mode, and how the modes change in dt seconds."""
    n = memory.shape[2]
    for k in range(1, 3):
        set_step(memory[k, n + 6 : n + 9], dt, models[k])
    leaving = models[1, LEAVING] + models[2, LEAVING]
    changed = -math.expm1(-leaving * dt) / leaving
    row = modes_row(memory)
    row[STRAIGHT_ENDS], row[TURN_ENDS] = models[1, LEAVING] * changed, models[2, LEAVING] * changed


@lean_kernel
def part_ways(memory, models):
    """Both modes begin from the mean, each with the course rate that is its own."""
    n = memory.shape[2]
    for k in range(1, 3):
        for i in range(n + 1):
            for j in range(n):
                memory[k, i, j] = memory[0, i, j]
        p, x, _ = parts(memory[k])
        forget_rate(x, p, models[k])
    straight, turn = models[1, LEAVING], models[2, LEAVING]
    modes_row(memory)[TURN_PROBABILITY] = straight / (straight + turn)
    join(memory)


@lean_kernel
def join(memory):
    """The mean of both modes and its covariance."""
    p, x, _ = parts(memory[0])
    p_straight, x_straight, _ = parts(memory[1])
    p_turn, x_turn, difference = parts(memory[2])
    turn = modes_row(memory)[TURN_PROBABILITY]
    spread = turn * (1.0 - turn)
    n = len(x)
    d = difference[0]
    differ(x_straight, x_turn, d)
    for i in range(n):
        x[i] = x_straight[i] + turn * d[i]
        for j in range(i, n):
            p[i, j] = p_straight[i, j] + turn * (p_turn[i, j] - p_straight[i, j]) + spread * d[i] * d[j]


@lean_kernel
def differ(x_straight, x_turn, d):
    """d ← the turning state less the straight one."""
    for i in range(len(d)):
        d[i] = x_turn[i] - x_straight[i]
    d[COURSE] = wrap(d[COURSE])


@lean_kernel
def mix(memory):
    """What each mode starts a step from: both modes, as likely as each of them led to it."""
    p_straight, x_straight, _ = parts(memory[1])
    p_turn, x_turn, difference = parts(memory[2])
    row = modes_row(memory)
    turn, begins, ends = row[TURN_PROBABILITY], row[STRAIGHT_ENDS], row[TURN_ENDS]
    turn_after = turn * (1.0 - ends) + (1.0 - turn) * begins
    a = turn * ends / (1.0 - turn_after)  # that she turned before, if she sails straight now
    b = turn * (1.0 - ends) / turn_after  # … and if she turns now
    row[TURN_PROBABILITY] = turn_after
    n = len(x_turn)
    d = difference[0]
    differ(x_straight, x_turn, d)
    for i in range(n):
        x_turn[i] = x_straight[i] + b * d[i]
        x_straight[i] += a * d[i]
        for j in range(i, n):
            s, more, spread = p_straight[i, j], p_turn[i, j] - p_straight[i, j], d[i] * d[j]
            p_straight[i, j] = s + a * (more + (1.0 - a) * spread)
            p_turn[i, j] = s + b * (more + (1.0 - b) * spread)


@lean_kernel
def predict_modes(memory, models):
    """One step of either mode."""
    mix(memory)
    n = memory.shape[2]
    for k in range(1, 3):
        p, x, _ = parts(memory[k])
        predict(x, p, memory[k, n + 6 : n + 9], models[k])
    join(memory)


@lean_kernel
def weigh_fix(memory, north, east, models):
    """NIS of a fix against the mean of both modes, and what with it makes −2 log of its density (less 2 log 2π)."""
    turn = modes_row(memory)[TURN_PROBABILITY]
    p, x, _ = parts(memory[1])
    variance, g, pairs = models[1, POSITION_VARIANCE], int(models[1, ERROR_STATE]), int(models[1, ERROR_PAIRS])
    n1, e1, nn1, ne1, ee1 = innovation(x, p, north, east, variance, variance, g, pairs)
    p, x, _ = parts(memory[2])
    n2, e2, nn2, ne2, ee2 = innovation(x, p, north, east, variance, variance, g, pairs)
    first = normalised_square(n1, e1, nn1, ne1, ee1) + math.log(nn1 * ee1 - ne1 * ne1)
    second = normalised_square(n2, e2, nn2, ne2, ee2) + math.log(nn2 * ee2 - ne2 * ne2)
    least = min(first, second)
    surprise = least - 2.0 * math.log(
        (1.0 - turn) * math.exp(0.5 * (least - first)) + turn * math.exp(0.5 * (least - second))
    )
    n, e, spread = n2 - n1, e2 - e1, turn * (1.0 - turn)
    nis = normalised_square(
        n1 + turn * n,
        e1 + turn * e,
        nn1 + turn * (nn2 - nn1) + spread * n * n,
        ne1 + turn * (ne2 - ne1) + spread * n * e,
        ee1 + turn * (ee2 - ee1) + spread * e * e,
    )
    return nis, surprise - nis


@lean_kernel
def correct_modes(memory, north, east, models):
    """Correct either mode by a fix, and their probabilities by how well each foretold it."""
    log_odds = 0.0
    for k in range(1, 3):
        p, x, work = parts(memory[k])
        g, pairs, variance = int(models[k, ERROR_STATE]), int(models[k, ERROR_PAIRS]), models[k, POSITION_VARIANCE]
        nu_n, nu_e, s_nn, s_ne, s_ee = innovation(x, p, north, east, variance, variance, g, pairs)
        surprise = normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee) + math.log(s_nn * s_ee - s_ne * s_ne)
        log_odds += 0.5 * surprise if k == 1 else -0.5 * surprise
        correct(x, p, work, nu_n, nu_e, s_nn, s_ne, s_ee, g, pairs)
    judge_modes(memory, log_odds)
    join(memory)


@lean_kernel
def judge_modes(memory, log_odds):
    """Bayes' rule for the probability of the turn; neither mode is ever ruled out."""
    row = modes_row(memory)
    turn = row[TURN_PROBABILITY]
    odds = turn / (1.0 - turn) * math.exp(min(max(log_odds, -50.0), 50.0))
    row[TURN_PROBABILITY] = min(max(odds / (1.0 + odds), _LEAST_PROBABILITY), 1.0 - _LEAST_PROBABILITY)


@lean_kernel
def aid_modes(memory, aids, models):
    """Correct either mode by every aid that is known (not NaN) and that at least one of them can believe."""
    for which in range(len(aids)):
        if not math.isfinite(aids[which]):
            continue
        log_odds, least = 0.0, math.inf
        for k in range(1, 3):
            p, x, work = parts(memory[k])
            i, companion, sign, nu, variance = aided(which, aids[which], x, models[k])
            s = scalar_innovation(p, work, i, companion, sign, variance)
            surprise = nu * nu / s + math.log(s)
            least = min(least, nu * nu / s)
            log_odds += 0.5 * surprise if k == 1 else -0.5 * surprise
        if least > SCALAR_GATE:
            continue
        for k in range(1, 3):
            p, x, work = parts(memory[k])
            i, companion, sign, nu, variance = aided(which, aids[which], x, models[k])
            correct_scalar(x, p, work, i, companion, sign, nu, variance, math.inf)
        judge_modes(memory, log_odds)
    join(memory)


@lean_kernel
def fold_modes(memory):
    """U ≥ 0 and χ in [−π, π) in either mode and in the mean."""
    for k in range(1, 3):
        p, x, _ = parts(memory[k])
        fold(x, p)
    join(memory)
    p, x, _ = parts(memory[0])
    fold(x, p)


@lean_kernel
def take_place_modes(memory, north, east, models):
    """Take the position anew from a fix in either mode."""
    for k in range(1, 3):
        p, x, _ = parts(memory[k])
        take_place(x, p, north, east, models[k])
    join(memory)


@lean_kernel
def shift_modes(memory, north, east):
    """Move the origin of the plane by north and east (m)."""
    for k in range(1, 3):
        _, x, _ = parts(memory[k])
        x[0] -= north
        x[1] -= east
