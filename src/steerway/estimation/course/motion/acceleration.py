"""Acceleration along the course as a further state, first-order Gauss–Markov.

(R. A. Singer, IEEE Trans. Aerospace and Electronic Systems 6(4), 1970.)

U̇ = −α1 U + a + w1. In a swell or on the approach to a harbour acceleration persists for seconds and is not white. The
prediction is the five-state one between two linear maps: before it speed takes the mean of what acceleration adds over
the step, after it the rest.
"""

import math

from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.course.motion.five_state import gauss_markov, turn_noise, turn_response
from steerway.estimation.course.motion.five_state import predict as predict_five_states
from steerway.estimation.course.motion.layout import (
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


def pack(profile, row, add_state) -> bool:
    """Fill a row of parameters; False for a profile without persistent acceleration."""
    if profile.acceleration_std == 0.0:
        return False
    row[ACCELERATION_STATE] = add_state(*gauss_markov(profile.acceleration_std, profile.acceleration_time))
    return True


@lean_kernel
def shares(step, parameters):
    """What a unit of acceleration adds to speed: before the prediction, and after it for a unit then left."""
    a = int(parameters[ACCELERATION_STATE])
    left, gained, distance = turn_response(parameters[EXTRAS + 3 * (a - 5)], step[DT])
    before = distance / step[SPEED_INTEGRAL] if step[DT] > 0.0 else 0.0
    return before, (gained - step[SPEED_LEFT] * before) / left


@called_kernel
def predict(x, p, step, parameters):
    """x ← f(x), P ← F P Fᵀ + Q in place; the noise of a reaches U and the displacement along the course too."""
    a = int(parameters[ACCELERATION_STATE])
    mean_course = x[COURSE] + step[LEAN] * x[RATE]
    c, s = math.cos(mean_course), math.sin(mean_course)
    before, after = shares(step, parameters)
    add_share(x, p, SPEED, a, before)
    predict_five_states(x, p, step, parameters)
    decay_rate, density = parameters[EXTRAS + 3 * (a - 5)], parameters[EXTRAS + 3 * (a - 5) + 1]
    aa, ua, uu, la, lu, ll = turn_noise(decay_rate, step[DT])
    p[a, a] -= density * aa  # the noise of the step reaches the speed by its own integral, below
    add_share(x, p, SPEED, a, after)
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
def add_share(x, p, to, a, share):
    """x[to] ← x[to] + share · x[a], and what that does to the covariance (upper triangle)."""
    x[to] += share * x[a]
    p[to, to] += share * (2.0 * p[to, a] + share * p[a, a])
    for i in range(to):
        p[i, to] += share * p[i, a]
    for j in range(to + 1, p.shape[1]):
        p[to, j] += share * p[min(a, j), max(a, j)]
