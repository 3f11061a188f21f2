"""Acceleration along the course as a further state, first-order Gauss–Markov.

(R. A. Singer, IEEE Trans. Aerospace and Electronic Systems 6(4), 1970.)

U̇ = −α1 U + a + w1. In a swell or on the approach to a harbour acceleration persists for seconds and is not white. The
prediction is the five-state one between two linear maps: before it speed takes the mean of what acceleration adds over
the step, after it the rest.
"""

import math

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.course.motion.five_state import gauss_markov, turn_noise, turn_response
from steerway.estimation.course.motion.five_state import predict as predict_five_states
from steerway.estimation.course.motion.layout import (
    ACCELERATION_STATE,
    COURSE,
    DT,
    EXTRAS,
    LEAN,
    PUSH_AFTER,
    PUSH_BEFORE,
    Q_AA,
    Q_LA,
    Q_LL_PUSH,
    Q_LU_PUSH,
    Q_UA,
    Q_UU_PUSH,
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


@called_kernel
def set_step(step: Floats, parameters: Floats) -> None:
    """Fill what the rows of acceleration in a `step` (5, n) hold, from those of the five-state model."""
    a, dt = int(parameters[ACCELERATION_STATE]), step[DT]
    decay_rate, density = parameters[EXTRAS + 3 * (a - 5)], parameters[EXTRAS + 3 * (a - 5) + 1]
    left, gained, distance = turn_response(decay_rate, dt)
    before = distance / step[SPEED_INTEGRAL] if dt > 0.0 else 0.0
    step[PUSH_BEFORE], step[PUSH_AFTER] = before, (gained - step[SPEED_LEFT] * before) / left
    aa, ua, uu, la, lu, ll = turn_noise(decay_rate, dt)
    step[Q_AA], step[Q_UA], step[Q_UU_PUSH] = density * aa, density * ua, density * uu
    step[Q_LA], step[Q_LU_PUSH], step[Q_LL_PUSH] = density * la, density * lu, density * ll


@called_kernel
def predict(x, p, step, parameters):
    """x ← f(x), P ← F P Fᵀ + Q in place; the noise of a reaches U and the displacement along the course too."""
    a = int(parameters[ACCELERATION_STATE])
    mean_course = x[COURSE] + step[LEAN] * x[RATE]
    c, s = math.cos(mean_course), math.sin(mean_course)
    add_share(x, p, SPEED, a, step[PUSH_BEFORE])
    predict_five_states(x, p, step, parameters)
    p[a, a] -= step[Q_AA]  # the noise of the step reaches the speed by its own integral, below
    add_share(x, p, SPEED, a, step[PUSH_AFTER])
    p[a, a] += step[Q_AA]
    p[0, 0] += step[Q_LL_PUSH] * c * c
    p[0, 1] += step[Q_LL_PUSH] * c * s
    p[1, 1] += step[Q_LL_PUSH] * s * s
    p[0, 2] += step[Q_LU_PUSH] * c
    p[1, 2] += step[Q_LU_PUSH] * s
    p[2, 2] += step[Q_UU_PUSH]
    p[0, a] += step[Q_LA] * c
    p[1, a] += step[Q_LA] * s
    p[2, a] += step[Q_UA]


@lean_kernel
def add_share(x, p, to, a, share):
    """x[to] ← x[to] + share · x[a], and what that does to the covariance (upper triangle)."""
    x[to] += share * x[a]
    p[to, to] += share * (2.0 * p[to, a] + share * p[a, a])
    for i in range(to):
        p[i, to] += share * p[i, a]
    for j in range(to + 1, p.shape[1]):
        p[to, j] += share * p[min(a, j), max(a, j)]
