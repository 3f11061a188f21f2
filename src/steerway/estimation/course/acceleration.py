"""Acceleration along the course as a further state, first-order Gauss–Markov.

(R. A. Singer, IEEE Trans. Aerospace and Electronic Systems 6(4), 1970.)

U̇ = −α1 U + a + w1. A vessel in a swell, or one that slows down for a harbour, does not change speed at random from one
moment to the next: for a while she goes on as she has begun. The five-state prediction stays as it is; speed is lent
the mean of what acceleration gives it over the step before, and given the rest after.
"""

import math

from steerway.core.compiled import lean_kernel
from steerway.estimation.course.five_state import predict, turn_noise, turn_response
from steerway.estimation.course.model import (
    ACCELERATION_STATE,
    COURSE,
    DT,
    EXTRAS,
    LEAN,
    RATE,
    SPEED,
    SPEED_INTEGRAL,
    SPEED_LEFT,
)


@lean_kernel
def shares(step, model):
    """What a unit of acceleration gives to speed: before the prediction, and after it for a unit then left."""
    a = int(model[ACCELERATION_STATE])
    left, gained, way = turn_response(model[EXTRAS + 3 * (a - 5)], step[DT])
    lent = way / step[SPEED_INTEGRAL] if step[DT] > 0.0 else 0.0
    return lent, (gained - step[SPEED_LEFT] * lent) / left


@lean_kernel
def predict_accelerating(x, p, step, model):
    """`five_state.predict`, with acceleration where the model has it."""
    a = int(model[ACCELERATION_STATE])
    c = s = rest = 0.0
    if a:
        mean_course = x[COURSE] + step[LEAN] * x[RATE]
        c, s = math.cos(mean_course), math.sin(mean_course)
        lent, rest = shares(step, model)
        give(x, p, SPEED, a, lent)
    predict(x, p, step, model)
    if a:
        settle_acceleration(x, p, a, rest, c, s, step, model)


@lean_kernel
def settle_acceleration(x, p, a, rest, c, s, step, model):
    """After the prediction: what is left to give, and the noise, which goes by a through U to the way along (c, s)."""
    decay_rate, density = model[EXTRAS + 3 * (a - 5)], model[EXTRAS + 3 * (a - 5) + 1]
    aa, ua, uu, la, lu, ll = turn_noise(decay_rate, step[DT])
    p[a, a] -= density * aa  # what came up during the step has its own way to the speed
    give(x, p, SPEED, a, rest)
    p[a, a] += density * aa
    p[0, 0] += density * ll * c * c
    p[0, 1] += density * ll * c * s
    p[1, 1] += density * ll * s * s
    p[0, 2] += density * lu * c
    p[1, 2] += density * lu * s
    p[2, 2] += density * uu
    p[0, a] += density * la * c
    p[1, a] += density * la * s
    p[2, a] += density * ua


@lean_kernel
def give(x, p, to, a, share):
    """x[to] ← x[to] + share · x[a], and what that does to the covariance (upper triangle)."""
    x[to] += share * x[a]
    p[to, to] += share * (2.0 * p[to, a] + share * p[a, a])
    for i in range(to):
        p[i, to] += share * p[i, a]
    for j in range(to + 1, len(x)):
        p[to, j] += share * p[min(a, j), max(a, j)]
