"""The bank that comes from the future: likelihoods of what is still to be seen, one for each hypothesis.

A likelihood carries no expectation of its own, so that nothing is counted twice where it meets the past: at the end of
a record it is one whatever the deviation, and Λ = 0.
"""

import numpy as np

from steerway.core.angles import wrap
from steerway.core.compiled import kernel, lean_kernel
from steerway.core.linear_algebra import fill_lower, square_root
from steerway.estimation.course.aiding import aided
from steerway.estimation.course.model import COURSE, EAST, ERROR_PAIRS, ERROR_STATE, NORTH
from steerway.estimation.course.two_sided.agreement import agreement
from steerway.estimation.course.two_sided.hypotheses import LOG_WEIGHT, MANNERS

_MADE_SURER = 1e-9
"""Part of a variance that the future has to take away to have said anything, and not the rounding of a computer."""


@kernel
def foresee(bank, filtered, smoothed):
    """All hypotheses alike: what rows adrift behind the stretch say of its last, by the plain smoother.

    That is the information of `smoothed` (n + 2, n) less that of `filtered`, as far as the former has more: the courses
    and speeds of a vessel that comes to rest are not as Gaussian as either says.
    """
    n = bank.shape[3]
    root, lost, scale = np.empty((n, n)), np.empty(n), np.empty(n)
    square_root(filtered[:n], scale, root)
    whiten = np.linalg.inv(root)
    covariance = smoothed[:n].copy()
    fill_lower(covariance)
    for i in range(n):
        lost[i] = filtered[n, i] - smoothed[n, i]
    lost[COURSE] = wrap(lost[COURSE])
    left, axes = np.linalg.eigh(whiten @ covariance @ whiten.T)
    axes = whiten.T @ axes
    one = bank[0, 0]
    for k in range(n):
        if left[k] < 1.0 - _MADE_SURER:
            axis = axes[:, k].copy()
            gained = 1.0 / max(left[k], _MADE_SURER) - 1.0
            shift = (lost * axis).sum()
            for i in range(n):
                one[n, i] -= shift * axis[i]
                for j in range(n):
                    one[i, j] += gained * axis[i] * axis[j]
    for m in range(MANNERS):
        for h in range(bank.shape[1] - 1):
            bank[m, h, : n + 1] = one[: n + 1]


@lean_kernel
def see_fix(bank, fix, model, h):
    """Every hypothesis sees a fix (north, east, variance); h is workspace (n,)."""
    north, east, variance = fix
    g, pairs = int(model[ERROR_STATE]), int(model[ERROR_PAIRS])
    for axis in (NORTH, EAST):
        for i in range(len(h)):
            h[i] = 0.0
        h[axis] = 1.0
        if g:
            for i in range(g + axis, g + 2 * pairs, 2):
                h[i] = 1.0
        see(bank, h, north if axis == NORTH else east, variance)


@lean_kernel
def see_aids(bank, aids, trajectory, believed, model, h):
    """Every hypothesis sees the aids that the past believed; h is workspace (n,)."""
    for which in range(len(aids)):
        if believed[which]:
            i, companion, sign, seen, variance = aided(which, aids[which], trajectory, model)
            for j in range(len(h)):
                h[j] = 0.0
            h[companion] = sign
            h[i] = 1.0
            see(bank, h, seen, variance)


@lean_kernel
def see(bank, h, seen, variance):
    """Multiply every likelihood by that of hᵀd = `seen`, give or take the variance (but for a common factor)."""
    n = len(h)
    for m in range(MANNERS):
        for which in range(bank.shape[1] - 1):
            one = bank[m, which]
            for i in range(n):
                if h[i] != 0.0:
                    for j in range(n):
                        one[i, j] += h[i] * h[j] / variance
                    one[n, i] += h[i] * seen / variance


@lean_kernel
def recede(bank, f, offset, q, scale, root, product, lower, room):
    """Take the hypotheses (hypotheses + 1, n + 2, n) of one manner a step back, over what `linearise` says of it.

    The likelihood of d is the mean of that of f d + offset + w over the noise w. The last five are workspace.
    """
    n = len(offset)
    square_root(q, scale, root)
    gradient, u = room[0], room[1]
    for h in range(len(bank) - 1):
        one = bank[h]
        gained = 0.0
        for i in range(n):
            gradient[i] = one[n, i]
            for j in range(n):
                gradient[i] -= one[i, j] * offset[j]
            gained += 0.5 * (gradient[i] + one[n, i]) * offset[i]
        one[n + 1, LOG_WEIGHT] += gained + agreement(root, one, gradient, product, lower, u)
        # Λ − V Vᵀ and g − V u, with V = Λ L C⁻ᵀ
        for i in range(n):
            for j in range(n):
                total = product[i, j]
                for k in range(j):
                    total -= lower[j, k] * product[i, k]
                product[i, j] = total / lower[j, j]
                gradient[i] -= product[i, j] * u[j]
        for i in range(n):
            for j in range(i + 1):
                total = one[i, j]
                for k in range(n):
                    total -= product[i, k] * product[j, k]
                one[i, j] = one[j, i] = total
        see_through(one, f, gradient, product)


@lean_kernel
def see_through(one, f, gradient, product):
    """Λ ← Fᵀ Λ F and η ← Fᵀ g; most of F is zero."""
    n = len(gradient)
    for i in range(n):
        one[n, i] = 0.0
        for j in range(n):
            product[i, j] = 0.0
    for k in range(n):
        for j in range(n):
            if f[k, j] != 0.0:
                one[n, j] += f[k, j] * gradient[k]
                for i in range(n):
                    product[j, i] += one[k, i] * f[k, j]
    for i in range(n):
        for j in range(n):
            one[i, j] = 0.0
    for k in range(n):
        for j in range(n):
            if f[k, j] != 0.0:
                for i in range(n):
                    one[i, j] += product[i, k] * f[k, j]
