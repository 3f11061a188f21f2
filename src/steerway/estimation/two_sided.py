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
from steerway.estimation.linear_algebra import factor, fill_lower, multiply, solve_rows
from steerway.estimation.mixture import PROBABILITY, blend
from steerway.estimation.model import (
    ADRIFT,
    COURSE,
    EXTRAS,
    GYRO_STATE,
    LATITUDE,
    LONGITUDE,
    MODE,
    RATE,
    RATE_DECAY,
    RECEDES,
    SPEED_DECAY,
    START_RATE_VARIANCE,
    STARTS_IN,
    UNDERWAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
    empty_memory,
)
from steerway.estimation.tracking import advance, conclude, recentre, settle, speak, take_aids, take_position
from steerway.estimation.way import fold


@kernel
def smooth_modes(time, first, second, aids, geodetic, models, kept, spoken):
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
            advance(memory, time[k + 1] - time[k], others)
            bound_growth(memory, others)
            conclude(memory)
        here = kept[k, 0, n + 1]
        if here[MODE] == book[MODE] and here[MODE] >= ADRIFT:
            north = east = 0.0
            if geodetic:
                north, east = displacement(book[LATITUDE], book[LONGITUDE], here[LATITUDE], here[LONGITUDE])
            if here[MODE] == UNDERWAY:
                meet_in_modes(kept[k], memory, north, east, gyro, fused, weights, room)
                blend(fused, weights, 0, m, mean)
            else:
                meet(kept[k, 0], memory[0], north, east, gyro, False, mean, room)
            kept[k, 0, : n + 1] = mean[: n + 1]
            if here[MODE] == UNDERWAY:
                fold(kept[k, 0, n], kept[k, 0, :n])
        speak(kept[k, 0], geodetic, spoken[k])
        fixed = math.isfinite(first[k]) and math.isfinite(second[k])
        if fixed:
            take_position(memory, first[k], second[k], geodetic, others)
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
    """The parameters of the filter that comes from the future."""
    other = models.copy()
    for k in range(len(models)):
        row = other[k]
        row[RECEDES] = 1.0
        row[SPEED_DECAY], row[RATE_DECAY] = -row[SPEED_DECAY], -row[RATE_DECAY]
        row[START_RATE_VARIANCE] = models[0, START_RATE_VARIANCE]
        row[STARTS_IN] = 1.0 / (len(models) - 1)
        for j in range(EXTRAS, len(row), 3):
            row[j] = -row[j]
    return other


@kernel
def bound_growth(memory, models):
    """Remind what grew beyond all a vessel or receiver does of what they do: a course rate, an error, a bias.

    Seen from the future any rate may have decayed since; without bounds the course would be lost along with it.
    """
    n = memory.shape[2]
    for k in range(len(models)):
        p, x, work = memory[k, :n], memory[k, n], memory[k, n + 2 : n + 6]
        for i in range(RATE, n):
            most = models[k, START_RATE_VARIANCE] if i == RATE else models[k, EXTRAS + 3 * (i - 5) + 2]
            if p[i, i] > most:
                correct_scalar(x, p, work, i, 0, 0.0, -x[i], most, math.inf)


@kernel
def meet_in_modes(past, future, north, east, gyro, fused, weights, room):
    """Both filters in every mode: fills `fused` (modes, n + 1, n) and `weights` (modes,)."""
    n, m = past.shape[2], len(past) - 1
    least = math.inf
    for k in range(m):
        known = past[1 + k, n + 1, PROBABILITY] * future[0, n + 9, k]
        weights[k] = meet(past[1 + k], future[1 + k], north, east, gyro, True, fused[k], room) - 2.0 * math.log(known)
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
