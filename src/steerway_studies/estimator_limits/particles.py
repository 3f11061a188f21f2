"""Filtering by thousands of histories of modes at a time, where the product mixes three filters.

A filter that knows the history of modes is an extended Kalman filter, and as good as the bound; one that does not has
to weigh histories. This is the Rao–Blackwellised particle filter of A. Doucet, N. de Freitas, K. Murphy and S. Russell,
Proc. 16th Conf. Uncertainty in Artificial Intelligence, 2000: a particle is a history with its Kalman filter. Too slow
for a product; it shows how much is left to gain, and the NEES of the exact covariance while the mode is unknown.
"""

import math

import numpy as np

from steerway.core import kernel, radii, wrap
from steerway.estimation.course import (
    LEAVING,
    POSITION_VARIANCE,
    START_RATE_VARIANCE,
    correct,
    innovation,
    normalised_square,
    rotate_correction,
    set_step,
)
from steerway.estimation.course import predict_five_state as predict

_START_SPEED_STD, _START_COURSE_STD = 0.2, 0.2


def in_plane(fixes) -> np.ndarray:
    """(n, 2) north and east (m) of fixes around the equator's 0° E."""
    meridian, prime_vertical = radii(0.0)
    return np.column_stack([fixes.latitude * meridian, fixes.longitude * prime_vertical])


def begun(voyage, models, seed, course_std=_START_COURSE_STD) -> tuple[np.ndarray, np.ndarray]:
    """State and covariance to begin from: the truth, plus an error drawn from the covariance."""
    place, rate = models[0, POSITION_VARIANCE], models[0, START_RATE_VARIANCE]
    variances = np.array([place, place, _START_SPEED_STD**2, course_std**2, rate])
    draw = np.random.default_rng([seed, 8]).standard_normal(5)
    return voyage.states[0] + draw * np.sqrt(variances), np.diag(variances)


def steps(models, dt) -> np.ndarray:
    """(2, 3, 5) what predictions over dt need, and (2,) the chance that a mode is left in one."""
    found = np.zeros((2, 3, 5))
    for k, model in enumerate(models):
        _fill_step(found[k], dt, model)
    leaving = models[:, LEAVING]
    return found, leaving * (1.0 - math.exp(-leaving.sum() * dt)) / leaving.sum()


@kernel
def _fill_step(step, dt, model):
    set_step(step, dt, model)


@kernel
def go(x, p, step, model, fix, work, invariant=True):
    """Predict and correct, by the form of the product or by the textbook's; returns the log density of the fix (less
    log 2π)."""
    predict(x, p, step, model)
    variance = model[POSITION_VARIANCE]
    work[4] = x
    nu_n, nu_e, s_nn, s_ne, s_ee = innovation(x, p, fix[0], fix[1], variance, variance, 0)
    correct(x, p, work, nu_n, nu_e, s_nn, s_ne, s_ee, 0)
    if invariant:
        rotate_correction(x, p, work[4], 0, 0)
    return -0.5 * (normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee) + math.log(s_nn * s_ee - s_ne * s_ne))


def particle_filter(places, start, models, dt, particles, seed, invariant=True) -> tuple[np.ndarray, np.ndarray]:
    """(n, 5) means and (n, 5, 5) covariances after each fix, by so many histories at a time."""
    step, chances = steps(models, dt)
    means, spreads = np.zeros((len(places), 5)), np.zeros((len(places), 5, 5))
    _particles(places, *start, models, step, chances, particles, np.random.default_rng(seed), invariant, means, spreads)
    return means, spreads


@kernel
def _particles(places, x0, p0, models, step, chances, particles, chance, invariant, means, spreads):
    x, p = np.empty((2, particles, 5)), np.empty((2, particles, 5, 5))
    mode, weight = np.zeros((2, particles), np.int64), np.full(particles, 1.0 / particles)
    work, d, log_weight = np.empty((5, 5)), np.empty(5), np.zeros(particles)
    for i in range(particles):
        x[0, i], p[0, i] = x0, p0
    now = 0
    means[0], spreads[0] = x0, p0
    for k in range(1, len(places)):
        largest = -math.inf
        for i in range(particles):
            m = mode[now, i]
            log_weight[i] = math.log(weight[i]) if weight[i] > 0.0 else -math.inf
            log_weight[i] += go(x[now, i], p[now, i], step[m], models[m], places[k], work, invariant)
            largest = max(largest, log_weight[i])
            if chance.random() < chances[m]:
                mode[now, i] = 1 - m
        total = best = 0.0
        at = 0
        for i in range(particles):
            weight[i] = math.exp(log_weight[i] - largest)
            total += weight[i]
            if weight[i] > best:
                best, at = weight[i], i
        squares = 0.0
        for i in range(particles):
            weight[i] /= total
            squares += weight[i] ** 2
        _moments(x[now], p[now], weight, at, d, means[k], spreads[k])
        if squares * particles > 2.0:
            _resample(x, p, mode, weight, now, chance)
            now = 1 - now


@kernel
def _moments(x, p, weight, at, d, mean, spread):
    reference = x[at]
    for i in range(len(x)):
        if weight[i] == 0.0:
            continue
        for a in range(5):
            d[a] = x[i, a] - reference[a]
        d[3] = wrap(d[3])
        for a in range(5):
            mean[a] += weight[i] * d[a]
            for b in range(a, 5):
                spread[a, b] += weight[i] * (p[i, a, b] + d[a] * d[b])
    for a in range(5):
        for b in range(a, 5):
            spread[a, b] -= mean[a] * mean[b]
            spread[b, a] = spread[a, b]
    for a in range(5):
        mean[a] += reference[a]


@kernel
def _resample(x, p, mode, weight, now, chance):
    """Systematic resampling into the other half of the room."""
    particles = len(weight)
    place = chance.random() / particles
    i, reached = 0, weight[0]
    for j in range(particles):
        while reached < place and i < particles - 1:
            i += 1
            reached += weight[i]
        x[1 - now, j], p[1 - now, j], mode[1 - now, j] = x[now, i], p[now, i], mode[now, i]
        place += 1.0 / particles
    weight[:] = 1.0 / particles
