"""Smoothing by every history of modes that a record supports, where the product fuses two mixtures of three filters.

A Markov chain walks over the histories: it moves a change of mode, inserts a stretch of the other mode or removes one
(reversible jumps, P. J. Green, Biometrika 82(4), 1995), as likely as the record and the dwell times make it. Every
history that is kept is smoothed as if it were known, and the mean is the optimum for unknown modes. Too
slow for a product; it shows how much is left to gain.
"""

import math

import numpy as np

from steerway.core import fill_lower, kernel, wrap
from steerway.estimation.course import POSITION_VARIANCE, correct, innovation, smoothing_step, transition
from steerway.estimation.course import predict_five_state as predict
from steerway_studies.estimator_limits.particles import go, steps

_ROUNDS = 4
"""Of smoothing, each linearised around the one before (the iterated smoother, a Gauss–Newton method)."""
_TYPICAL_SHIFT = 8.0
"""Steps by which a change of mode is moved in the mean."""


def known_mode_smoother(places, start, turning, models, dt) -> np.ndarray:
    """(n, 5) smoothed states of an estimator that knows the history of modes (n,)."""
    step, _ = steps(models, dt)
    n = len(places)
    x, p, density = np.empty((n, 5)), np.empty((n, 5, 5)), np.zeros(n)
    x[0], p[0] = start
    _forward(places, turning.astype(np.int64), models, step, x, p, density, 0, n)
    _smooth(places, turning.astype(np.int64), models, step, x, p)
    return x


def all_histories(places, start, first_guess, models, dt, sweeps, seed, kept=100) -> tuple[np.ndarray, float]:
    """(n, 5) mean of the smoothed states over the histories that a chain of `sweeps` · n proposals visits.

    Args:
        first_guess: (n,) bool, the history it begins with.
        kept: how many histories are smoothed, evenly spaced over the second three quarters of the chain.

    Returns the means, and the share of proposals that were accepted.
    """
    step, chances = steps(models, dt)
    mean = np.zeros((len(places), 5))
    mode, chance = first_guess.astype(np.int64), np.random.default_rng(seed)
    accepted = _chain(places, *start, mode, models, step, chances, sweeps, kept, chance, mean)
    return mean, accepted


@kernel
def _forward(places, mode, models, step, x, p, density, first, last):
    work = np.empty((5, 5))
    for k in range(max(first, 1), last):
        m = mode[k - 1]
        x[k], p[k] = x[k - 1], p[k - 1]
        density[k] = go(x[k], p[k], step[m], models[m], places[k], work)


@kernel
def _smooth(places, mode, models, step, x, p):
    """Filtered x (n, 5) and P become smoothed, linearised where the smoothed states of the round before lie."""
    n = len(x)
    at, x0, p0 = x.copy(), x[0].copy(), p[0].copy()
    work, f, x_next, d = np.empty((4, 5)), np.empty((5, 5)), np.empty((n, 5)), np.empty(5)
    gain, lower, product, scale = np.empty((5, 5)), np.empty((5, 5)), np.empty((5, 5)), np.empty(5)
    p_next = np.empty((n, 5, 5))
    for _ in range(_ROUNDS):
        x[0], p[0] = x0, p0
        for k in range(1, n):
            m, variance = mode[k - 1], models[0, POSITION_VARIANCE]
            x_next[k], p_next[k] = at[k - 1], p[k - 1]
            transition(at[k - 1], True, step[m], models[m], f)
            predict(x_next[k], p_next[k], step[m], models[m])
            for i in range(5):
                d[i] = x[k - 1, i] - at[k - 1, i]
            for i in range(5):
                for j in range(5):
                    x_next[k, i] += f[i, j] * d[j]
            x[k], p[k] = x_next[k], p_next[k]
            fix = places[k]
            nu_n, nu_e, s_nn, s_ne, s_ee = innovation(x[k], p[k], fix[0], fix[1], variance, variance, 0)
            correct(x[k], p[k], work, nu_n, nu_e, s_nn, s_ne, s_ee, 0)
        fill_lower(p[n - 1])
        p_later = p[n - 1].copy()
        for k in range(n - 2, -1, -1):
            m = mode[k]
            transition(at[k], True, step[m], models[m], f)
            d[:] = x[k + 1] - x_next[k + 1]
            smoothing_step(x[k], p[k], f, p_next[k + 1], d, p_later, gain, lower, product, scale)
            fill_lower(p[k])
            p_later[:] = p[k]
        at[:] = x


@kernel
def _chain(places, x0, p0, mode, models, step, chances, sweeps, kept, chance, mean):
    n = len(places)
    x, p, density = np.empty((n, 5)), np.empty((n, 5, 5)), np.zeros(n)
    x_new, p_new, density_new = np.empty((n, 5)), np.empty((n, 5, 5)), np.zeros(n)
    x[0], p[0] = x0, p0
    x_new[0], p_new[0] = x0, p0
    _forward(places, mode, models, step, x, p, density, 0, n)
    changes = np.empty(n, np.int64)
    typical = 2.0 / chances.sum()
    total, began = sweeps * n, sweeps * n // 4
    every = max((total - began) // kept, 1)
    accepted, smoothed = 0, 0
    xs, ps = np.empty((n, 5)), np.empty((n, 5, 5))
    for proposal in range(total):
        first, last, log_ratio = _proposed(mode, changes, typical, chance)
        if first >= 0:
            log_ratio -= _log_prior(mode, chances, first, last)
            for k in range(first, last):
                mode[k] = 1 - mode[k]
            log_ratio += _log_prior(mode, chances, first, last)
            end, gained = _try(places, mode, models, step, x, p, density, x_new, p_new, density_new, first, last)
            if math.log(chance.random()) < log_ratio + gained:
                accepted += 1
                x[first + 1 : end], p[first + 1 : end] = x_new[first + 1 : end], p_new[first + 1 : end]
                density[first + 1 : end] = density_new[first + 1 : end]
            else:
                for k in range(first, last):
                    mode[k] = 1 - mode[k]
        if proposal >= began and (proposal - began) % every == 0:
            xs[:], ps[:] = x, p
            _smooth(places, mode, models, step, xs, ps)
            smoothed += 1
            for k in range(n):
                for i in range(5):
                    d = xs[k, i] - mean[k, i]
                    mean[k, i] += (wrap(d) if i == 3 and smoothed > 1 else d) / smoothed
    return accepted / total


@kernel
def _try(places, mode, models, step, x, p, density, x_new, p_new, density_new, first, last):
    """Filter anew from where the histories part until the filters agree again: where that is, and the gain in log
    density."""
    n = len(places)
    work = np.empty((5, 5))
    gained = 0.0
    x_new[first], p_new[first] = x[first], p[first]
    for k in range(first + 1, n):
        m = mode[k - 1]
        x_new[k], p_new[k] = x_new[k - 1], p_new[k - 1]
        density_new[k] = go(x_new[k], p_new[k], step[m], models[m], places[k], work)
        gained += density_new[k] - density[k]
        if k > last and abs(density_new[k] - density[k]) < 1e-7:
            apart = 0.0
            for i in range(5):
                apart = max(apart, (x_new[k, i] - x[k, i]) ** 2 / p[k, i, i])
                apart = max(apart, abs(p_new[k, i, i] / p[k, i, i] - 1.0))
            if apart < 1e-5:
                return k + 1, gained
    return n, gained


@kernel
def _log_prior(mode, chances, first, last):
    """Log probability of the changes into, within and out of the rows first to last."""
    total = 0.0
    for k in range(max(first, 1), min(last + 1, len(mode))):
        before = mode[k - 1]
        total += math.log(chances[before] if mode[k] != before else 1.0 - chances[before])
    return total


@kernel
def _proposed(mode, changes, typical, chance):
    """Rows [first, last) whose mode to swap, −1 for none, and the log ratio of proposing the way back and there."""
    n = len(mode)
    count = 0
    for k in range(1, n):
        if mode[k] != mode[k - 1]:
            changes[count] = k
            count += 1
    kind = chance.random()
    if kind < 0.6 and count:
        which = chance.integers(0, count)
        shift = 1 + int(-_TYPICAL_SHIFT * math.log(chance.random()))
        at = changes[which]
        if chance.random() < 0.5:
            lowest = changes[which - 1] if which else 1
            return (at - shift, at, 0.0) if at - shift >= lowest + (1 if which else 0) else (-1, -1, 0.0)
        highest = changes[which + 1] if which + 1 < count else n
        return (at, at + shift, 0.0) if at + shift < highest else (-1, -1, 0.0)
    if kind < 0.7:  # a last change more, or the last one less
        length = 1 + int(-typical * math.log(chance.random()))
        return (n - length, n, 0.0) if length < n else (-1, -1, 0.0)
    if kind < 0.85:  # a stretch of the other mode within one
        first = 1 + chance.integers(0, n - 1)
        length = 1 + int(-typical * math.log(chance.random()))
        last = first + length
        if last >= n:
            return -1, -1, 0.0
        for k in range(first, last + 1):
            if mode[k] != mode[first - 1]:
                return -1, -1, 0.0
        there = _log_length(length, typical) - math.log(n - 1)
        return first, last, -math.log(count + 1) - there
    if count < 2:
        return -1, -1, 0.0
    which = chance.integers(0, count - 1)
    first, last = changes[which], changes[which + 1]
    back = _log_length(last - first, typical) - math.log(n - 1)
    return first, last, back + math.log(count - 1)


@kernel
def _log_length(length, typical):
    """Log probability that 1 + ⌊exponential of mean `typical`⌋ is `length`."""
    return -(length - 1) / typical + math.log(-math.expm1(-1.0 / typical))
