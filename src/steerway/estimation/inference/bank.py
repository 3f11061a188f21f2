"""Interacting multiple models: one Gaussian a mode, mixed before every step.

H. A. P. Blom and Y. Bar-Shalom, IEEE Trans. Automatic Control 33(8), 1988. Modes change in continuous time, so that
neither the rate of fixes nor a gap changes the tuning.
"""

import math

from steerway.core.compiled import called_kernel, inlined_kernel
from steerway.estimation.inference.discrete import DT, set_steps
from steerway.estimation.inference.model import (
    ACTS_ON,
    COURSE,
    DRIFT_SPEED,
    EAST,
    FIX_VARIANCE,
    FREQUENCY,
    NORTH,
    ON_FIX,
    SINCE,
    SPEED,
    STARTED,
    STATE,
    VARIANCE,
)
from steerway.estimation.inference.motion import predict
from steerway.estimation.inference.relative import from_likeliest, shifted

LONGEST_STEP = 3.0
"""s; a longer interval is predicted in parts: up to four equal ones of at most this, beyond that from either end on a
part is as long as all between it and that end, the first two about this. Behind a fix modes differ, and before the next
one they have to, lest a manoeuvre be as long as the part; between, their shares are nearly steady. Chosen: about the
duration of a yaw manoeuvre, of which the prior median is 2 s."""
_LOST = 2.0
"""Variance across the course, in squares of the speed, above which there is no course: 1.4 rad. Chosen: of
uniform directions it is π²/3."""
SAME_STEP = 1e-4
"""Part of a step by which clocks err: a tenth of a millisecond at 1 Hz. Chosen: far below the error of
the time of a fix."""
START_SPEED_STD, START_RATE_STD = 10.0, 0.2
"""m/s, rad/s: of a vessel of which nothing is known. Chosen: two deviations are 39 kn and 23°/s."""
START_PROBABILITY = (0.55, 0.2, 0.15, 0.09, 0.01)
"""Of the modes of a vessel of which nothing is known. Chosen; the first rows are no part of a fit (`fit`)."""

LEAST_SHARE = 1e-3
"""Share that a mode has in what another starts a step from, of which half counts, and of a smaller one less. Moments
that hold every share in full would let a mode that is hardly probable and knows nothing, as an emergency, widen all
others at every step: the likelihood is lower, and SOG of scenes with steady courses off by 2 % more. With 0.01
manoeuvres are followed late."""


@called_kernel
def start(bank, model, north, east):
    """Begin from one fix: its place, and a velocity about which nothing is known."""
    x, p, probability, run = bank.x, bank.p, bank.probability, bank.run
    m, n = x.shape
    filters = model.filters
    for k in range(m):
        for i in range(n):
            x[k, i] = 0.0
            for j in range(n):
                p[k, i, j] = 0.0
        x[k, NORTH], x[k, EAST] = north, east
        p[k, 0, 0] = p[k, 1, 1] = model.receiver[FIX_VARIANCE]
        p[k, 2, 2] = p[k, 3, 3] = START_SPEED_STD**2
        p[k, 4, 4] = START_RATE_STD**2
        for f in range(len(filters)):
            j, variance = int(filters[f, STATE]), filters[f, VARIANCE]
            p[k, j, j] = variance
            if filters[f, ACTS_ON] == ON_FIX or filters[f, FREQUENCY] > 0.0:
                p[k, j + 1, j + 1] = variance
            if filters[f, ACTS_ON] == ON_FIX:
                for i in range(2):
                    p[k, i, i] += variance
                    p[k, i, j + i] = p[k, j + i, i] = -variance
        probability[k] = START_PROBABILITY[k]
    for i in range(len(run)):
        run[i] = 0.0
    run[STARTED] = 1.0


@called_kernel
def mix(bank):
    """What each mode starts a step from: all of them, as likely as each of them led to it."""
    x, p, origin, mixed_p = bank.x, bank.p, bank.mixed_x[0], bank.mixed_p
    probability, change, work = bank.probability, bank.change, bank.work
    m, n = x.shape
    reference, steady = from_likeliest(x, p, probability, work)
    for a in range(n):
        origin[a] = x[reference, a]
    for k in range(m):
        for a in range(n):
            for b in range(n):
                mixed_p[k, a, b] = p[k, a, b] + work[k, a] * work[k, b]
    flat, mixed_flat = p.reshape((m, n * n)), mixed_p.reshape((m, n * n))
    for j in range(m):
        total = 0.0
        for i in range(m):
            total += probability[i] * change[i, j]
        work[m + 1, j] = total
        kept, shares = 0.0, work[m + 2]
        for i in range(m):
            share = probability[i] * change[i, j] / total
            shares[i] = share * share / (share + LEAST_SHARE)
            kept += shares[i]
        w0, w1, w2, w3, w4 = shares[0] / kept, shares[1] / kept, shares[2] / kept, shares[3] / kept, shares[4] / kept
        for a in range(n * n):
            flat[j, a] = (
                w0 * mixed_flat[0, a]
                + w1 * mixed_flat[1, a]
                + w2 * mixed_flat[2, a]
                + w3 * mixed_flat[3, a]
                + w4 * mixed_flat[4, a]
            )
        for a in range(n):
            work[m, a] = w0 * work[0, a] + w1 * work[1, a] + w2 * work[2, a] + w3 * work[3, a] + w4 * work[4, a]
        for a in range(n):
            for b in range(n):
                p[j, a, b] -= work[m, a] * work[m, b]
        shifted(origin, work[m], steady, x, p, j)
    total = 0.0
    for j in range(m):
        total += work[m + 1, j]
    for j in range(m):
        probability[j] = work[m + 1, j] / total


@called_kernel
def steps_in(dt):
    """How many steps an interval of dt > 0 seconds is predicted in."""
    if dt <= 4.0 * LONGEST_STEP:
        return max(math.ceil(dt / LONGEST_STEP - 1e-3), 1)
    return 2 * round(math.log2(dt / LONGEST_STEP))


@called_kernel
def step_of(k, dt):
    """The k-th of the steps (s) that an interval of dt > 0 seconds is predicted in."""
    steps = steps_in(dt)
    if steps <= 4:
        return dt / steps
    return dt * 2.0 ** (max(min(k, steps - 1 - k) - 1, 0) - steps // 2)


@inlined_kernel
def advance(bank, model, dt, motion_states):
    """Predict by dt > 0 seconds."""
    x, p, steps = bank.x, bank.p, bank.steps
    bank.run[SINCE] += dt
    for j in range(steps_in(dt)):
        part = step_of(j, dt)
        if abs(part - steps[0][DT]) > SAME_STEP * part:
            set_steps(steps, bank.change, bank.work, part, model)
        mix(bank)
        for k in range(x.shape[0]):
            predict(x, p, k, steps[k], motion_states, model.receiver[DRIFT_SPEED], bank.work)
            if loses_course(x, p, k):
                forget_direction(x, p, k)


@called_kernel
def loses_course(x, p, k):
    """Whether mode k of a vessel under way knows no course any more."""
    return p[k, COURSE, COURSE] > _LOST * (x[k, SPEED] ** 2 + p[k, SPEED, SPEED])


@called_kernel
def forget_direction(x, p, k):
    """Where the course is lost, a velocity that may lie in any direction: of its moments those of a normal course.

    A covariance that is linear in the course would lay them all on a line across it. A course of variance σ² leaves
    exp(−σ²/2) of the mean velocity; the place follows by its regression on the velocity across.
    """
    n = x.shape[1]
    speed, across = x[k, SPEED], p[k, COURSE, COURSE]
    power = speed * speed + p[k, SPEED, SPEED]
    mean = speed * math.exp(-0.5 * across / power)
    spread = min(0.5 * (power - mean * mean), START_SPEED_STD**2)
    place = 0.5 * (p[k, NORTH, NORTH] + p[k, EAST, EAST])
    c, s = math.cos(x[k, COURSE]), math.sin(x[k, COURSE])
    lead = (c * p[k, EAST, COURSE] - s * p[k, NORTH, COURSE]) / across
    x[k, NORTH] += c * lead * (mean - speed)
    x[k, EAST] += s * lead * (mean - speed)
    x[k, SPEED] = mean
    for i in range(4):
        for j in range(n):
            p[k, i, j] = p[k, j, i] = 0.0
        p[k, i, i] = place if i < SPEED else spread
    with_speed = lead * spread
    p[k, NORTH, SPEED] = p[k, SPEED, NORTH] = c * with_speed
    p[k, EAST, SPEED] = p[k, SPEED, EAST] = s * with_speed
    p[k, NORTH, COURSE] = p[k, COURSE, NORTH] = -s * with_speed
    p[k, EAST, COURSE] = p[k, COURSE, EAST] = c * with_speed
