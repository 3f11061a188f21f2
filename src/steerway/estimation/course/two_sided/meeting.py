"""Where the bank of the past meets that of the future: the mean of all pairs of hypotheses of one manner."""

import math

from steerway.core.compiled import lean_kernel
from steerway.core.linear_algebra import square_root
from steerway.estimation.course.model import RATE
from steerway.estimation.course.two_sided.agreement import agreement
from steerway.estimation.course.two_sided.hypotheses import LEAST_WORTH, LOG_WEIGHT, MANNERS, WORTH

SAID = RATE + 1
"""The vessel's own states, of which the mean is taken."""
_NEGLIGIBLE = 1e-3
"""Part of the likeliest pair's weight below which a pair is left out of the mean."""


@lean_kernel
def meet(past, future, pairs, mean, scale, roots, product, lower, room):
    """Fill `mean` (SAID + 2, SAID), covariance and mean of the deviation, and what the future's hypotheses are worth.

    That is how well they agree with the past, if she is then in their manner. pairs (MANNERS, hypotheses, hypotheses),
    roots (MANNERS, hypotheses, n, n), scale (n,), product, lower (n, n) and room (2, n): workspace.
    """
    n = past.shape[3]
    largest = -math.inf
    for m in range(MANNERS):
        for i in range(past.shape[1]):
            square_root(past[m, i, :n], scale, roots[m, i])
            for j in range(past.shape[1]):
                pairs[m, i, j] = confront(past[m, i], future[m, j], roots[m, i], product, lower, room)
                largest = max(largest, pairs[m, i, j])
    for i in range(SAID + 1):
        for j in range(SAID):
            mean[i, j] = 0.0
    total = 0.0
    for m in range(MANNERS):
        known = 0.0
        for i in range(past.shape[1]):
            known += past[m, i, n + 1, WORTH]
        for j in range(past.shape[1]):
            future[m, j, n + 1, WORTH] = 0.0
            future[m, j, n + 1, LOG_WEIGHT] -= largest
        for i in range(past.shape[1]):
            for j in range(past.shape[1]):
                weight = math.exp(pairs[m, i, j] - largest)
                future[m, j, n + 1, WORTH] += weight / known
                if weight > _NEGLIGIBLE:
                    total += weight
                    confront(past[m, i], future[m, j], roots[m, i], product, lower, room)
                    add(past[m, i], roots[m, i], lower, room, weight, mean)
        for j in range(past.shape[1]):
            future[m, j, n + 1, WORTH] = max(future[m, j, n + 1, WORTH], LEAST_WORTH)
    for i in range(SAID):
        mean[SAID, i] /= total
    for i in range(SAID):
        for j in range(i, SAID):
            mean[i, j] = mean[i, j] / total - mean[SAID, i] * mean[SAID, j]


@lean_kernel
def confront(ours, theirs, root, product, lower, room):
    """Log weight of a pair of hypotheses; leaves in `lower` and room[1] what `add` needs of it."""
    n = ours.shape[1]
    gradient, u = room[0], room[1]
    here = 0.0
    for i in range(n):
        gradient[i] = theirs[n, i]
        for j in range(n):
            gradient[i] -= theirs[i, j] * ours[n, j]
        here += 0.5 * (gradient[i] + theirs[n, i]) * ours[n, i]
    weight = ours[n + 1, LOG_WEIGHT] + theirs[n + 1, LOG_WEIGHT]
    return weight + here + agreement(root, theirs, gradient, product, lower, u)


@lean_kernel
def add(ours, root, lower, room, weight, mean):
    """Add the moments of a pair of hypotheses, times its weight."""
    n = ours.shape[1]
    u, spread = room[1], room[2 : 2 + SAID]
    for i in range(SAID):
        d = ours[n, i]
        for j in range(n):
            total = root[i, j] if j <= i else 0.0
            for k in range(j):
                total -= lower[j, k] * spread[i, k]
            spread[i, j] = total / lower[j, j]
            d += spread[i, j] * u[j]
        room[2 + SAID, i] = d
        mean[SAID, i] += weight * d
    for i in range(SAID):
        for j in range(i, SAID):
            total = room[2 + SAID, i] * room[2 + SAID, j]
            for k in range(n):
                total += spread[i, k] * spread[j, k]
            mean[i, j] += weight * total
