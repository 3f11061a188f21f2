"""A bank of hypotheses of what a vessel has done, or will do: when she last changed her manner of moving, or next will.

A filter told when turns begin and end is as good as can be; one not told has to weigh histories, and there is one for
every combination of moments. Few matter: those that part ways long ago agree by now. So a bank holds a handful of
hypotheses of each manner, in the order in which they parted from the other one. After every row a new one parts, and of
two neighbours that hardly differ the likelier inherits what the other is worth.

A bank is (MANNERS, hypotheses + 1, n + 2, n): for each hypothesis a matrix (n, n), a vector (n,) and its bookkeeping;
the last place of each manner is for the one that is born. What comes from the past is a covariance and a mean, what
comes from the future is a likelihood exp(ηᵀx − ½ xᵀΛx), the matrix Λ and the vector η: see `past` and `future`.
"""

import math

import numpy as np

from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.course.model import LEAVING

MANNERS = 2
HYPOTHESES = 4
"""Of each manner. With 3 the rate on a straight course is up to a tenth worse, with 6 or 8 nothing is better."""
LOG_WEIGHT, WORTH = range(2)
"""Bookkeeping of a hypothesis: the logarithm of its weight, and what part of all that is known speaks for it."""
_LEAST_CHANCE = 1e-12
"""No change of manner is ever ruled out."""
LEAST_WORTH = 1e-30


@kernel
def empty_bank(n, hypotheses):
    """Room for a bank, all hypotheses of a manner alike."""
    bank = np.zeros((MANNERS, hypotheses + 1, n + 2, n))
    bank[:, :, n + 1, LOG_WEIGHT] = -math.log(hypotheses)
    return bank


@lean_kernel
def set_chances(chances, dt, manners):
    """Fill (2,): how likely she is to have left each manner dt seconds later, for the other one."""
    both = manners[0, LEAVING] + manners[1, LEAVING]
    for m in range(MANNERS):
        chances[m] = max(-manners[m, LEAVING] / both * math.expm1(-both * dt), _LEAST_CHANCE)


@lean_kernel
def normalise(bank):
    """Weights of sum one, and what each hypothesis is worth by them."""
    n = bank.shape[3]
    largest, total = -math.inf, 0.0
    for m in range(MANNERS):
        for h in range(bank.shape[1] - 1):
            largest = max(largest, bank[m, h, n + 1, LOG_WEIGHT])
    for m in range(MANNERS):
        for h in range(bank.shape[1] - 1):
            total += math.exp(bank[m, h, n + 1, LOG_WEIGHT] - largest)
    largest += math.log(total)
    for m in range(MANNERS):
        for h in range(bank.shape[1] - 1):
            book = bank[m, h, n + 1]
            book[LOG_WEIGHT] -= largest
            book[WORTH] = max(math.exp(book[LOG_WEIGHT]), LEAST_WORTH)


@lean_kernel
def part(bank, chances, backwards):
    """She may change her manner: one is born in each, of the best of the other, with the worth of all of those.

    chances: (2,) of leaving each manner; `backwards` in a bank that comes from the future, which goes from the manner
    she leaves for into the one she leaves.
    """
    n = bank.shape[3]
    for m in range(MANNERS):
        best, worth = 0, 0.0
        for h in range(bank.shape[1] - 1):
            worth += bank[1 - m, h, n + 1, WORTH]
            if bank[1 - m, h, n + 1, WORTH] > bank[1 - m, best, n + 1, WORTH]:
                best = h
        copy(bank[1 - m, best], bank[m, -1])
        chance = chances[m] if backwards else chances[1 - m]
        book = bank[m, -1, n + 1]
        book[LOG_WEIGHT] += math.log(worth / book[WORTH] * chance)
        book[WORTH] = max(worth * chance, LEAST_WORTH)
    for m in range(MANNERS):
        stays = 1.0 - chances[m]
        for h in range(bank.shape[1] - 1):
            bank[m, h, n + 1, LOG_WEIGHT] += math.log(stays)
            bank[m, h, n + 1, WORTH] *= stays
        settle_estate(bank[m])


@lean_kernel
def settle_estate(bank):
    """Of two neighbours (hypotheses + 1, n + 2, n) the likelier inherits; the last place is free again."""
    n = bank.shape[2]
    at, least = 0, math.inf
    for h in range(len(bank) - 1):
        loss = loss_of_joining(bank[h], bank[h + 1])
        if loss < least:
            at, least = h, loss
    ours, theirs = bank[at, n + 1, WORTH], bank[at + 1, n + 1, WORTH]
    heir = at if ours > theirs else at + 1
    bank[heir, n + 1, LOG_WEIGHT] += math.log((ours + theirs) / bank[heir, n + 1, WORTH])
    bank[heir, n + 1, WORTH] = ours + theirs
    for h in range(at if heir > at else at + 1, len(bank) - 1):
        copy(bank[h + 1], bank[h])


@lean_kernel
def loss_of_joining(one, other):
    """What it costs to make one hypothesis of two: how far they differ, state by state, by what they are worth."""
    n = one.shape[1]
    apart = 0.0
    for i in range(n):
        both = one[i, i] + other[i, i] + 1e-300
        apart += (one[n, i] - other[n, i]) ** 2 / both + ((one[i, i] - other[i, i]) / both) ** 2
    ours, theirs = one[n + 1, WORTH], other[n + 1, WORTH]
    return apart * ours * theirs / (ours + theirs)


@lean_kernel
def copy(one, to):
    """Copy a hypothesis."""
    for i in range(one.shape[0]):
        for j in range(one.shape[1]):
            to[i, j] = one[i, j]
