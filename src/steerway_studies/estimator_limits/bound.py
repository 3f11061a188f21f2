"""What no estimator can do better than: the Riccati recursion at the true trajectory with the mode of motion known.

The Cramér–Rao bound of P. Tichavský, C. H. Muravchik and A. Nehorai, IEEE Trans. Signal Processing 46(5), 1998, for a
vessel whose states are those of P0 (11)–(15): the covariance of the filter that is linearised at the truth and knows
when a turn begins and ends.
"""

import numpy as np

from steerway.core import fill_lower, kernel
from steerway.estimation.course import (
    POSITION_VARIANCE,
    START_RATE_VARIANCE,
    START_SPEED_VARIANCE,
    correct,
    set_step,
    smoothing_step,
    transition,
)
from steerway.estimation.course import predict_five_state as predict


def filtering_bound(voyage, profile) -> np.ndarray:
    """(n, 5, 5) covariance of [x^n y^n U χ ω_χ] after each fix that no causal estimator betters on this voyage."""
    covariance = np.empty((len(voyage.time), 5, 5))
    _riccati(voyage.time, voyage.states, voyage.turning, profile.modes(), covariance)
    return covariance


def smoothing_bound(voyage, profile) -> np.ndarray:
    """(n, 5, 5) covariance that no estimator betters that knows the whole record."""
    covariance = filtering_bound(voyage, profile)
    _smooth(voyage.time, voyage.states, voyage.turning, profile.modes(), covariance)
    return covariance


@kernel
def _riccati(time, states, turning, models, covariance):
    n = states.shape[1]
    p, work, steps = np.zeros((n, n)), np.zeros((4, n)), np.zeros((2, 3, n))
    variance = models[0, POSITION_VARIANCE]
    p[0, 0] = p[1, 1] = variance
    p[2, 2], p[4, 4] = models[0, START_SPEED_VARIANCE], models[1, START_RATE_VARIANCE]
    p[3, 3] = 1.0
    covariance[0] = p
    for k in range(1, len(time)):
        mode = int(turning[k - 1])
        set_step(steps[mode], time[k] - time[k - 1], models[mode])
        predict(states[k - 1].copy(), p, steps[mode], models[mode])
        correct(states[k].copy(), p, work, 0.0, 0.0, p[0, 0] + variance, p[0, 1], p[1, 1] + variance, 0)
        fill_lower(p)
        covariance[k] = p


@kernel
def _smooth(time, states, turning, models, covariance):
    n = states.shape[1]
    f, gain, lower, product = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    scale, still, steps = np.empty(n), np.zeros(n), np.zeros((2, 3, n))
    p_later = covariance[-1].copy()
    for k in range(len(time) - 2, -1, -1):
        mode = int(turning[k])
        p_next = covariance[k].copy()
        set_step(steps[mode], time[k + 1] - time[k], models[mode])
        transition(states[k], True, steps[mode], models[mode], f)
        predict(states[k].copy(), p_next, steps[mode], models[mode])
        smoothing_step(states[k].copy(), covariance[k], f, p_next, still, p_later, gain, lower, product, scale)
        fill_lower(covariance[k])
        p_later[:] = covariance[k]
