"""Hypotheses of the last change of mode (forward), or of the next one (backward).

With known times of change the estimate would be optimal; unknown, there is a history for every combination of times.
Few matter: those that differ long ago agree by now. So a bank holds four hypotheses of each mode, in the order of their
change. After every row a new one is spawned, and the closest pair of neighbours is merged: the more probable one stays
with the weight of both.

A bank is (MODES, hypotheses + 1, n + 2, n): for each hypothesis a matrix (n, n), a vector (n,) and its flags; the last
place of each mode is for the one spawned. Forward they are a covariance and a mean, backward a likelihood
exp(ηᵀx − ½ xᵀΛx), the matrix Λ and the vector η: see `forward` and `backward`.
"""

import math

import numpy as np

from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.estimation.course.motion.layout import LEAVING

MODES = 2
"""Course held, and turn."""
HYPOTHESES = 4
"""Of each mode. With 3 the rate on a straight course is up to a tenth worse, with 6 or 8 nothing is better (`steerway
study estimator-limits` with this number changed)."""
LOG_WEIGHT, PROBABILITY = range(2)
"""Flags of a hypothesis: the logarithm of its weight in the bank, and its probability given all rows so far used."""
_LEAST_CHANCE = 1e-12
"""No change of mode is ever excluded: its logarithm stays finite. Chosen: far below any rate times any step."""
LEAST_PROBABILITY = 1e-30
"""… and no hypothesis: its logarithm stays finite."""


@kernel
def empty_hypotheses(n, hypotheses):
    """Room for a bank, all hypotheses of a mode alike."""
    bank = np.zeros((MODES, hypotheses + 1, n + 2, n))
    bank[:, :, n + 1, LOG_WEIGHT] = -math.log(hypotheses)
    return bank


@lean_kernel
def set_change_probabilities(change, dt, modes):
    """Fill (2,): probability that each mode has changed to the other one dt seconds later."""
    both = modes[0, LEAVING] + modes[1, LEAVING]
    for m in range(MODES):
        change[m] = max(-modes[m, LEAVING] / both * math.expm1(-both * dt), _LEAST_CHANCE)


@called_kernel
def normalise(bank):
    """Weights of sum one, and the probabilities by them."""
    n = bank.shape[3]
    largest, total = -math.inf, 0.0
    for m in range(MODES):
        for h in range(bank.shape[1] - 1):
            largest = max(largest, bank[m, h, n + 1, LOG_WEIGHT])
    for m in range(MODES):
        for h in range(bank.shape[1] - 1):
            total += math.exp(bank[m, h, n + 1, LOG_WEIGHT] - largest)
    largest += math.log(total)
    for m in range(MODES):
        for h in range(bank.shape[1] - 1):
            flags = bank[m, h, n + 1]
            flags[LOG_WEIGHT] -= largest
            flags[PROBABILITY] = max(math.exp(flags[LOG_WEIGHT]), LEAST_PROBABILITY)


@called_kernel
def spawn(bank, change, backwards):
    """The mode may change: one hypothesis is spawned in each, from the best of the other, with the weight of all those.

    change: (2,) probabilities of leaving each mode; `backwards` for the backward bank, which goes from the mode after
    the change to the one before it.
    """
    n = bank.shape[3]
    for m in range(MODES):
        best, probability = 0, 0.0
        for h in range(bank.shape[1] - 1):
            probability += bank[1 - m, h, n + 1, PROBABILITY]
            if bank[1 - m, h, n + 1, PROBABILITY] > bank[1 - m, best, n + 1, PROBABILITY]:
                best = h
        copy(bank[1 - m, best], bank[m, -1])
        probability_of_change = change[m] if backwards else change[1 - m]
        flags = bank[m, -1, n + 1]
        flags[LOG_WEIGHT] += math.log(probability / flags[PROBABILITY] * probability_of_change)
        flags[PROBABILITY] = max(probability * probability_of_change, LEAST_PROBABILITY)
    for m in range(MODES):
        unchanged = 1.0 - change[m]
        for h in range(bank.shape[1] - 1):
            bank[m, h, n + 1, LOG_WEIGHT] += math.log(unchanged)
            bank[m, h, n + 1, PROBABILITY] *= unchanged
        merge_closest(bank[m])


@called_kernel
def merge_closest(bank):
    """Merge the closest pair of neighbours (hypotheses + 1, n + 2, n): the more probable stays, with both weights."""
    n = bank.shape[2]
    at, least = 0, math.inf
    for h in range(len(bank) - 1):
        loss = merging_cost(bank[h], bank[h + 1])
        if loss < least:
            at, least = h, loss
    ours, theirs = bank[at, n + 1, PROBABILITY], bank[at + 1, n + 1, PROBABILITY]
    kept_one = at if ours > theirs else at + 1
    bank[kept_one, n + 1, LOG_WEIGHT] += math.log((ours + theirs) / bank[kept_one, n + 1, PROBABILITY])
    bank[kept_one, n + 1, PROBABILITY] = ours + theirs
    for h in range(at if kept_one > at else at + 1, len(bank) - 1):
        copy(bank[h + 1], bank[h])


@lean_kernel
def merging_cost(one, other):
    """Cost of merging two hypotheses: how far they differ, state by state, by their probabilities."""
    n = one.shape[1]
    apart = 0.0
    for i in range(n):
        both = one[i, i] + other[i, i] + 1e-300
        apart += (one[n, i] - other[n, i]) ** 2 / both + ((one[i, i] - other[i, i]) / both) ** 2
    ours, theirs = one[n + 1, PROBABILITY], other[n + 1, PROBABILITY]
    return apart * ours * theirs / (ours + theirs)


@lean_kernel
def copy(one, to):
    """Copy a hypothesis."""
    for i in range(one.shape[0]):
        for j in range(one.shape[1]):
            to[i, j] = one[i, j]
