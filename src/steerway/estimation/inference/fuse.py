"""What all modes together say: mean and spread of the mixture, and the motion that fixes do not resolve."""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.inference.model import (
    ACTS_ON,
    COURSE,
    DECAY,
    EAST,
    FREQUENCY,
    MODES,
    NORTH,
    ON_COURSE,
    ON_RATE,
    ON_SPEED,
    RATE,
    SPEED,
    STATE,
    TURN,
    VARIANCE,
)

SOG_VARIANCE, RATE_VARIANCE = 5, 7
"""Columns of `fuse`."""
QUICK_SPEED, QUICK_SPEED_TIME, QUICK_RATE, QUICK_RATE_TIME = 0.02, 6.0, 0.5 * math.pi / 180.0, 3.0
"""Speed (of the speed) and course rate (rad/s) that a vessel changes by at any time, and for how long (s): the medians
of the priors of wander, for a craft of 1.5 m/s."""


@called_kernel
def rate_weights(filters, h):
    """What each state contributes to the course rate, into h (n,)."""
    for i in range(len(h)):
        h[i] = 0.0
    h[RATE] = 1.0
    for f in range(len(filters)):
        j = int(filters[f, STATE])
        if filters[f, ACTS_ON] == ON_RATE:
            h[j] = 1.0
        elif filters[f, ACTS_ON] == ON_COURSE:
            h[j] = -filters[f, DECAY]
            if filters[f, FREQUENCY] > 0.0:
                h[j + 1] = -filters[f, FREQUENCY]


@lean_kernel
def course_rate(x, p, k, h):
    """Course rate of mode k, held and shaped, and its variance; h as of `rate_weights`."""
    n = x.shape[1]
    rate = variance = 0.0
    for i in range(RATE, n):
        if h[i] != 0.0:
            rate += h[i] * x[k, i]
            for j in range(RATE, n):
                variance += h[i] * h[j] * p[k, i, j]
    return rate, variance


@lean_kernel
def mean_speed(x, p, k):
    """Mean of the speed of mode k: where its velocity may lie in any direction, that of Rayleigh's distribution."""
    speed, across = x[k, SPEED], p[k, 3, 3]
    if k % MODES > TURN or across < speed * speed or across < _VAGUE**2:
        return speed
    return math.sqrt(speed * speed + 0.25 * math.pi * (p[k, 2, 2] + across))


_VAGUE = 0.4
"""m/s; a velocity that is known better and has no direction is that of a vessel at rest. Chosen: little
above `course.STEERAGEWAY`."""
LEAST_COUNTED = 0.003
"""Probability of a mode below which it is left out of the spread; of pairs of modes as many times less as there are
more of them. An interval is to hold 95 %, and modes so improbable would widen it alone: in the scene `circles` the
deviation of the rate would be 1.5 times as large. With 0.01 it holds 78 % of the rates in the scene `spins`, with this
90 %."""


@called_kernel
def fuse(x, p, probability, filters, h, out):
    """Mean and spread of all modes, or of pairs of modes, into `out` (FUSED); h is workspace (n,)."""
    m = x.shape[0]
    rate_weights(filters, h)
    likeliest = 0
    for k in range(1, m):
        if probability[k] > probability[likeliest]:
            likeliest = k
    reference = x[likeliest, COURSE]
    north = east = u = across = w = 0.0
    for k in range(m):
        if probability[k] == 0.0:
            continue
        weight, bend = probability[k], wrap(x[k, COURSE] - reference)
        rate, _ = course_rate(x, p, k, h)
        north += weight * x[k, NORTH]
        east += weight * x[k, EAST]
        u += weight * mean_speed(x, p, k)
        across += weight * bend
        w += weight * rate
    p_u = p_w = p_place = p_s = counted = 0.0
    least = LEAST_COUNTED * MODES / m
    for k in range(m):
        if probability[k] < least:
            continue
        counted += probability[k]
        weight, bend = probability[k], wrap(x[k, COURSE] - reference)
        rate, variance = course_rate(x, p, k, h)
        p_u += weight * (p[k, 2, 2] + (mean_speed(x, p, k) - u) ** 2)
        p_s += weight * (p[k, 3, 3] + (x[k, SPEED] * (bend - across)) ** 2)
        p_w += weight * (variance + (rate - w) ** 2)
        p_place += weight * 0.5 * (p[k, 0, 0] + p[k, 1, 1] + (x[k, 0] - north) ** 2 + (x[k, 1] - east) ** 2)
    p_u, p_s, p_w, p_place = p_u / counted, p_s / counted, p_w / counted, p_place / counted
    out[0], out[1], out[2], out[3], out[4] = north, east, u, wrap(reference + across), w
    out[5], out[6], out[7], out[8] = p_u, p_s / max(u * u, 1e-12), p_w, p_place
    out[9] = 1.0


@called_kernel
def add_unresolved_speed(filters, apart, out):
    """Add to the variance of the speed in `out` (FUSED) the motion that is faster than fixes `apart` s.

    The wander of a structure is fitted to what the fixes resolve. Of that which changes between them they tell nothing,
    and it is as usual: see QUICK_SPEED and QUICK_RATE.
    """
    out[SOG_VARIANCE] += unresolved_variance(filters, ON_SPEED, apart, QUICK_SPEED * out[2], QUICK_SPEED_TIME)


@called_kernel
def add_unresolved_rate(filters, apart, out):
    """As `add_unresolved_speed`, of the course rate."""
    out[RATE_VARIANCE] += unresolved_variance(filters, ON_RATE, apart, QUICK_RATE, QUICK_RATE_TIME)


@lean_kernel
def unresolved_variance(filters, acts_on, apart, usual, usual_time):
    """Variance of usual wander that fixes `apart` s do not resolve, as far as that of a structure does not hold it."""
    held = 0.0
    for f in range(len(filters)):
        if filters[f, ACTS_ON] == acts_on and filters[f, FREQUENCY] == 0.0:
            held += filters[f, VARIANCE] * unresolved(apart * filters[f, DECAY])
    return max(usual * usual * unresolved(apart / usual_time) - held, 0.0)


@lean_kernel
def unresolved(interval):
    """Share of the variance of a first-order process that means over an interval, in its time constants, lack."""
    a = max(interval, 1e-3)
    return 1.0 - 2.0 * (a - 1.0 + math.exp(-a)) / (a * a)
