"""Combination of the forward and the backward bank: the mean of all pairs of hypotheses of one mode."""

import math

from steerway.core.compiled import called_kernel
from steerway.core.linear_algebra import square_root
from steerway.estimation.course.motion.layout import RATE
from steerway.estimation.course.smoothing.hypotheses import LEAST_PROBABILITY, LOG_WEIGHT, MODES, PROBABILITY
from steerway.estimation.course.smoothing.overlap import log_mean_likelihood

VESSEL_STATES = RATE + 1
"""The vessel's own states, which are combined."""
_NEGLIGIBLE = 1e-3
"""Weight, relative to the largest, below which a pair is left out of the mean: it would move it by a
thousandth of the distance at most. Chosen."""


@called_kernel
def combine(past, future, pairs, mean, scale, roots, product, lower, room):
    """Fill `mean` (VESSEL_STATES + 2, VESSEL_STATES), covariance and mean of the deviation, and set probabilities.

    That of a backward hypothesis is its likelihood over the forward bank, given its mode.
    pairs (MODES, hypotheses, hypotheses),
    roots (MODES, hypotheses, n, n), scale (n,), product, lower (n, n) and room (2, n): workspace.
    """
    n = past.shape[3]
    largest = -math.inf
    for m in range(MODES):
        for i in range(past.shape[1]):
            square_root(past[m, i, :n], scale, roots[m, i])
            for j in range(past.shape[1]):
                pairs[m, i, j] = pair_log_weight(past[m, i], future[m, j], roots[m, i], product, lower, room)
                largest = max(largest, pairs[m, i, j])
    for i in range(VESSEL_STATES + 1):
        for j in range(VESSEL_STATES):
            mean[i, j] = 0.0
    total = 0.0
    for m in range(MODES):
        known = 0.0
        for i in range(past.shape[1]):
            known += past[m, i, n + 1, PROBABILITY]
        for j in range(past.shape[1]):
            future[m, j, n + 1, PROBABILITY] = 0.0
            future[m, j, n + 1, LOG_WEIGHT] -= largest
        for i in range(past.shape[1]):
            for j in range(past.shape[1]):
                weight = math.exp(pairs[m, i, j] - largest)
                future[m, j, n + 1, PROBABILITY] += weight / known
                if weight > _NEGLIGIBLE:
                    total += weight
                    pair_log_weight(past[m, i], future[m, j], roots[m, i], product, lower, room)
                    add_moments(past[m, i], roots[m, i], lower, room, weight, mean)
        for j in range(past.shape[1]):
            future[m, j, n + 1, PROBABILITY] = max(future[m, j, n + 1, PROBABILITY], LEAST_PROBABILITY)
    for i in range(VESSEL_STATES):
        mean[VESSEL_STATES, i] /= total
    for i in range(VESSEL_STATES):
        for j in range(i, VESSEL_STATES):
            mean[i, j] = mean[i, j] / total - mean[VESSEL_STATES, i] * mean[VESSEL_STATES, j]


@called_kernel
def pair_log_weight(ours, theirs, root, product, lower, room):
    """Log weight of a pair of hypotheses; leaves in `lower` and room[1] what `add_moments` needs of it."""
    n = ours.shape[1]
    gradient, u = room[0], room[1]
    here = 0.0
    for i in range(n):
        gradient[i] = theirs[n, i]
        for j in range(n):
            gradient[i] -= theirs[i, j] * ours[n, j]
        here += 0.5 * (gradient[i] + theirs[n, i]) * ours[n, i]
    weight = ours[n + 1, LOG_WEIGHT] + theirs[n + 1, LOG_WEIGHT]
    return weight + here + log_mean_likelihood(root, theirs, gradient, product, lower, u)


@called_kernel
def add_moments(ours, root, lower, room, weight, mean):
    """Add the moments of a pair of hypotheses, times its weight."""
    n = ours.shape[1]
    u, spread = room[1], room[2 : 2 + VESSEL_STATES]
    for i in range(VESSEL_STATES):
        d = ours[n, i]
        for j in range(n):
            total = root[i, j] if j <= i else 0.0
            for k in range(j):
                total -= lower[j, k] * spread[i, k]
            spread[i, j] = total / lower[j, j]
            d += spread[i, j] * u[j]
        room[2 + VESSEL_STATES, i] = d
        mean[VESSEL_STATES, i] += weight * d
    for i in range(VESSEL_STATES):
        for j in range(i, VESSEL_STATES):
            total = room[2 + VESSEL_STATES, i] * room[2 + VESSEL_STATES, j]
            for k in range(n):
                total += spread[i, k] * spread[j, k]
            mean[i, j] += weight * total
