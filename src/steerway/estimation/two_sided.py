"""Fixed-interval smoothing of a vessel of several modes: a filter from the future meets the one from the past.

After R. E. Helmick, W. D. Blair and S. A. Hoffman, IEEE Trans. Information Theory 41(6), 1995: mode by mode the filter
of the past and one that runs from the end of the record say what they know, each mode counts by how well the two agree
in it, and the mean of them is the estimate. The filter from the future is the same filter: seen backwards a vessel runs
the opposite course at the same speed and turns the other way. It carries likelihoods and no expectation of its own, so
that nothing counts twice: what decays in the past's model grows in its own, and it begins from next to nothing.
"""

import math

import numpy as np

from steerway.angles import wrap
from steerway.compiled import kernel
from steerway.earth import displacement
from steerway.estimation.aiding import COG, HEADING, YAW_RATE, correct_scalar
from steerway.estimation.five_state import predict, set_step
from steerway.estimation.linear_algebra import factor, fill_lower, multiply, solve_rows
from steerway.estimation.mixture import PROBABILITY, blend, course_is_lost, set_steps
from steerway.estimation.model import (
    ADRIFT,
    COURSE,
    EMPTY,
    EXTRAS,
    GYRO_STATE,
    LATITUDE,
    LONGEST_STEP,
    LONGITUDE,
    MODE,
    RATE,
    RATE_DECAY,
    SPEED_DECAY,
    START_RATE_VARIANCE,
    STARTS_IN,
    STEP_SLACK,
    STRAY,
    UNDERWAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
    empty_memory,
)
from steerway.estimation.tracking import advance, conclude, recentre, settle, speak, take_aids, take_position
from steerway.estimation.way import fold, judge

_LEFT_MIXING, _LEFT_MEETING = 1e-4, 1e-2
"""Parts of an expectation that `unlearn` leaves, or nothing would bound the rate: next to none where another takes its
place, more where only the past's filter, far surer, comes after it."""
_GREATEST_ODDS = 50.0
"""Logarithm; what is left over of a mode that contradicts another may not overflow."""
_LEAST_LIKELY = 1e-12
"""No mode is ever ruled out."""


@kernel
def smooth_modes(time, first, second, doubts, aids, geodetic, models, kept, spoken):
    """Backward pass over the record of `track`: smooths its `kept` in place and states `spoken` (n, SPOKEN) anew.

    Rows in which only one of the two filters has a course stay as they were.
    """
    n, m = kept.shape[3], kept.shape[1] - 1
    others = seen_from_the_future(models)
    memory = empty_memory(models)
    book, gyro = memory[0, n + 1], int(models[0, GYRO_STATE])
    fused, weights, mean = np.empty((m, n + 1, n)), np.empty(m), np.empty((n + 4, n))
    room = np.empty((7, n, n))
    for k in range(len(time) - 1, -1, -1):
        if k + 1 < len(time):
            recede(memory, time[k + 1] - time[k], others)
            conclude(memory)
        here = kept[k, 0, n + 1]
        if here[MODE] == book[MODE] and here[MODE] >= ADRIFT:
            north = east = 0.0
            if geodetic:
                north, east = displacement(book[LATITUDE], book[LONGITUDE], here[LATITUDE], here[LONGITUDE])
            if here[MODE] == UNDERWAY:
                meet_in_modes(kept[k], memory, north, east, gyro, others, fused, weights, room)
                blend(fused, weights, 0, m, mean)
            else:
                meet(kept[k, 0], memory[0], north, east, gyro, False, mean, room)
            kept[k, 0, : n + 1] = mean[: n + 1]
            if here[MODE] == UNDERWAY:
                fold(kept[k, 0, n], kept[k, 0, :n])
        speak(kept[k, 0], geodetic, spoken[k])
        fixed = math.isfinite(first[k]) and math.isfinite(second[k])
        if fixed:
            take_position(memory, first[k], second[k], geodetic, doubts[k] if len(doubts) else 1.0, others)
        if len(aids):
            take_aids(memory, seen_backwards(aids[k]), others)
        if fixed or len(aids):
            settle(memory, others)
        if geodetic and fixed:
            recentre(memory)


@kernel
def seen_backwards(aids):
    """What instruments say (5,) of the same vessel seen backwards in time."""
    seen = aids.copy()
    for course in (COG, HEADING):
        seen[course] = wrap(aids[course] + math.pi)
    seen[YAW_RATE] = -aids[YAW_RATE]
    return seen


@kernel
def seen_from_the_future(models):
    """The parameters of the filter that comes from the future, and what it expects of the course rate in each mode.

    Backwards a steady process is the same process, so that the rate decays in that direction too; but on a course just
    taken up, where a turn's rate still decays, it grows.
    """
    other = models.copy()
    for k in range(len(models)):
        row = other[k]
        row[SPEED_DECAY] = -row[SPEED_DECAY]
        if k > 0 and row[STARTS_IN] == 0.0:
            row[RATE_DECAY] = -row[RATE_DECAY]
            row[START_RATE_VARIANCE] = models[0, START_RATE_VARIANCE]
        for j in range(EXTRAS, len(row), 3):
            row[j] = -row[j]
    other[1:, STARTS_IN] = 1.0 / (len(models) - 1)
    return other


@kernel
def recede(memory, dt, models):
    """One step of the filter that comes from the future."""
    n, m = memory.shape[2], len(models) - 1
    book, likely = memory[0, n + 1], memory[0, n + 9]
    if book[MODE] != UNDERWAY or dt <= 0.0 or dt > LONGEST_STEP * (1.0 + STEP_SLACK):
        advance(memory, dt, models)
        if book[MODE] != EMPTY:
            restrain(memory[0, n], memory[0, :n], memory[0, n + 2 : n + 6], models[0])
        return
    if book[STRAY] >= 0.0:
        book[STRAY] += dt
    if memory[0, n + 6, 0] != dt:
        set_step(memory[0, n + 6 : n + 9], dt, models[0])
        set_steps(memory, dt, models)
    mix_backwards(memory, models)
    total = 0.0
    for k in range(1, 1 + m):
        p, x, work = memory[k, :n], memory[k, n], memory[k, n + 2 : n + 6]
        if models[k, RATE_DECAY] < 0.0:
            # What is expected of the rate after a step is less than before it: e^{−2α dt} of it, the noise apart.
            known = models[k, START_RATE_VARIANCE]
            left = known * math.exp(2.0 * models[k, RATE_DECAY] * dt)
            odds = 0.5 * math.log(known / left)
            variance = known * left / (known - left)
            odds += 0.5 * math.log(variance) + learn(x, p, work, RATE, variance)
            likely[k - 1] *= math.exp(odds)
        predict(x, p, memory[k, n + 6 : n + 9], models[k])
        restrain(x, p, work, models[k])
        total += likely[k - 1]
    for k in range(m):
        likely[k] = max(likely[k] / total, _LEAST_LIKELY)
    if course_is_lost(memory):
        judge(memory[0, n], memory[0, :n], book, models[0])


@kernel
def restrain(x, p, work, model):
    """What grows backwards in time is never worse known than by what is expected of it."""
    for i in range(5, len(x)):
        bound = model[EXTRAS + 3 * (i - 5) + 2]
        if p[i, i] > bound:
            learn(x, p, work, i, bound)


@kernel
def mix_backwards(memory, models):
    """What each mode goes back from: all of them, as it leads to each, under its own expectation of the rate."""
    n, m = memory.shape[2], len(models) - 1
    likely, change = memory[0, n + 9], memory[0, n + 10 :]
    before, weights = memory[1 + m :, : n + 1], np.empty((m, m))
    after = np.empty((m, n + 1, n))
    sums = np.zeros(m)
    for j in range(m):
        known = models[1 + j, START_RATE_VARIANCE]
        for i in range(m):
            before[i] = memory[1 + i, : n + 1]
            odds = 0.0
            if models[1 + i, START_RATE_VARIANCE] != known:
                p, x, work = before[i, :n], before[i, n], memory[1 + j, n + 2 : n + 6]
                odds = unlearn(x, p, work, RATE, models[1 + i, START_RATE_VARIANCE], _LEFT_MIXING)
                odds += learn(x, p, work, RATE, known)
            weights[j, i] = likely[i] * change[j, i] * math.exp(min(odds, _GREATEST_ODDS))
            sums[j] += weights[j, i]
        for i in range(m):
            weights[j, i] /= sums[j]
        mean = np.empty((n + 4, n))
        blend(memory, weights[j], 1 + m, m, mean)
        after[j] = mean[: n + 1]
    for j in range(m):
        memory[1 + j, : n + 1] = after[j]
        likely[j] = sums[j]


@kernel
def learn(x, p, work, i, variance):
    """Multiply by what is expected of a state, N(0, variance); returns the logarithm of how well that agrees."""
    spread = p[i, i] + variance
    agreement = -0.5 * (math.log(spread) + x[i] ** 2 / spread)
    correct_scalar(x, p, work, i, 0, 0.0, -x[i], variance, math.inf)
    return agreement


@kernel
def unlearn(x, p, work, i, variance, left):
    """Divide by what is expected of a state: the reverse of `learn`, up to a part `left` of it."""
    variance = (1.0 + left) * max(variance, p[i, i]) + x[i] ** 2
    correct_scalar(x, p, work, i, 0, 0.0, -x[i], -variance, math.inf)
    spread = p[i, i] + variance
    return 0.5 * (math.log(spread) + x[i] ** 2 / spread)


@kernel
def meet_in_modes(past, future, north, east, gyro, models, fused, weights, room):
    """Both filters in every mode: fills `fused` (modes, n + 1, n) and `weights` (modes,)."""
    n, m = past.shape[2], len(past) - 1
    least, seen = math.inf, np.empty((future.shape[1], n))
    for k in range(m):
        known = math.log(past[1 + k, n + 1, PROBABILITY] * future[0, n + 9, k])
        seen[:] = future[1 + k]
        known += unlearn(
            seen[n], seen[:n], seen[n + 2 : n + 6], RATE, models[1 + k, START_RATE_VARIANCE], _LEFT_MEETING
        )
        weights[k] = meet(past[1 + k], seen, north, east, gyro, True, fused[k], room) - 2.0 * known
        least = min(least, weights[k])
    total = 0.0
    for k in range(m):
        weights[k] = math.exp(0.5 * (least - weights[k]))
        total += weights[k]
    for k in range(m):
        weights[k] /= total


@kernel
def meet(past, future, north, east, gyro, underway, out, room):
    """What two filters know together, into `out` (n + 1, n); returns −2 log of how well they agree, up to a constant.

    As a measurement of the whole state: P = P_past − G P_past, G = P_past (P_past + P_future)⁻¹.
    """
    n = past.shape[1]
    p, s, lower, gain, product = room[0], room[1], room[2], room[3], room[4]
    scale, d = room[5, 0], room[5, 1]
    turned_round(future, north, east, gyro, underway, s, d)
    for i in range(n):
        d[i] -= past[n, i]
        for j in range(i, n):
            p[i, j] = past[i, j]
            s[i, j] += past[i, j]
    if underway:
        d[COURSE] = wrap(d[COURSE])
    fill_lower(p)
    fill_lower(s)
    factor(s, scale, lower)
    gain[:] = p
    solve_rows(lower, scale, gain)
    multiply(gain, p, product)
    surprise = 0.0
    for i in range(n):
        out[n, i] = past[n, i]
        surprise += 2.0 * math.log(lower[i, i] / scale[i])
        for j in range(n):
            out[n, i] += gain[i, j] * d[j]
            out[i, j] = p[i, j] - product[i, j]
    room[6, :1] = d
    solve_rows(lower, scale, room[6, :1])
    for i in range(n):
        surprise += room[6, 0, i] * d[i]
    return surprise


@kernel
def turned_round(future, north, east, gyro, underway, p, x):
    """The state and covariance of a filter that came from the future, as one that came from the past has them."""
    n = len(x)
    for i in range(n):
        x[i] = future[n, i]
        for j in range(i, n):
            p[i, j] = future[i, j]
    x[0] += north
    x[1] += east
    if underway:
        x[COURSE] += math.pi
    for i in range(n):
        if i == RATE or (gyro and i == gyro) or (not underway and (i == VELOCITY_NORTH or i == VELOCITY_EAST)):
            x[i] = -x[i]
            for j in range(i):
                p[j, i] = -p[j, i]
            for j in range(i + 1, n):
                p[i, j] = -p[i, j]
