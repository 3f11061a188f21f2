"""What the future says of a row: the quotient of what is known with it and without it."""

import math

from steerway.core.compiled import called_kernel
from steerway.estimation.inference.algebra import eigen, inverse, product, product_transposed

_FARTHEST = 4.0
"""Standard deviations that what the future says may lie from what was expected of it: the normal distribution
holds 6·10⁻⁵ beyond."""


@called_kernel
def future(smoothed, shift, before, information, vector, room):
    """What the future says, in information form about the mean before: the quotient of two Gaussians.

    Where merging has left the smoothed one wider than that before, the future says nothing.
    smoothed, before: (n, n) covariances; shift: (n,) difference of means. Fills information (n, n), vector (n,).
    """
    n = len(shift)
    a, b, lower, spread, vectors = room[13], room[14], room[15], room[16], room[12]
    inverse(before, b, lower)
    product(lower, smoothed, a)
    product_transposed(a, lower, spread)
    whitened, reported = room[11, 3], room[11, 4]
    for u in range(n):
        total = 0.0
        for v in range(u + 1):
            total += lower[u, v] * shift[v]
        whitened[u] = total
    if tells_everywhere(spread, whitened, a, reported):
        inverse(smoothed, information, a)
        for u in range(n):
            total = 0.0
            for v in range(n):
                total += information[u, v] * shift[v]
                information[u, v] -= b[u, v]
            vector[u] = total
        return
    eigen(spread, vectors)
    for u in range(n):
        reported[u] = 0.0
        for v in range(n):
            information[u, v] = 0.0
    for e in range(n):
        value = max(spread[e, e], 1e-9)
        if value > 1.0 - 1e-6:
            continue
        along = 0.0
        for u in range(n):
            along += vectors[e, u] * whitened[u]
        most = _FARTHEST * math.sqrt(1.0 - value)
        along = min(max(along, -most), most)
        for u in range(n):
            reported[u] += vectors[e, u] * along / value
            for v in range(n):
                information[u, v] += vectors[e, u] * (1.0 / value - 1.0) * vectors[e, v]
    # back from the whitened coordinates: lowerᵀ (…) lower
    for u in range(n):
        total = 0.0
        for v in range(u, n):
            total += lower[v, u] * reported[v]
        vector[u] = total
    product(information, lower, a)
    for u in range(n):
        for v in range(n):
            total = 0.0
            for k in range(u, n):
                total += lower[k, u] * a[k, v]
            information[u, v] = total


@called_kernel
def tells_everywhere(spread, whitened, factor, solved):
    """Whether the future narrows every direction, and lies where it was expected: I − spread is positive definite."""
    n = len(whitened)
    distance = 0.0
    for j in range(n):
        for i in range(j, n):
            total = -spread[i, j]
            if i == j:
                total += 1.0 - 1e-6
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                factor[j, j] = math.sqrt(total)
            else:
                factor[i, j] = total / factor[j, j]
        value = whitened[j]
        for k in range(j):
            value -= factor[j, k] * solved[k]
        solved[j] = value / factor[j, j]
        distance += solved[j] * solved[j]
    return distance < _FARTHEST**2
