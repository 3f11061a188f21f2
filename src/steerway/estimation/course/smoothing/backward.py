"""The backward bank: likelihoods of the rows to come, one for each hypothesis.

A likelihood holds no prior, so that nothing is counted twice where it is combined with the forward bank: at the end of
a record it is one whatever the deviation, and Λ = 0.
"""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.linear_algebra import fill_lower, square_root
from steerway.estimation.course.motion.layout import COURSE, EAST, ERROR_PAIRS, ERROR_STATE, NORTH
from steerway.estimation.course.smoothing.hypotheses import LOG_WEIGHT, MODES
from steerway.estimation.course.smoothing.overlap import log_mean_likelihood
from steerway.estimation.course.update.aids import measured

_LEAST_GAIN = 1e-9
"""Relative reduction of a variance above which it is information and not rounding: 5·10⁶ times that of a double."""


@kernel
def start_backward(bank, filtered, smoothed):
    """All hypotheses equal: the information of rows at low speed after the stretch, by the plain smoother.

    That is the information of `smoothed` (n + 2, n) less that of `filtered`, as far as the former has more: the courses
    and speeds of a vessel that comes to rest are not as Gaussian as either says.
    """
    n = bank.shape[3]
    root, lost, scale = np.zeros((n, n)), np.empty(n), np.empty(n)  # the upper triangle stays zero
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
        if left[k] < 1.0 - _LEAST_GAIN:
            axis = axes[:, k].copy()
            gained = 1.0 / max(left[k], _LEAST_GAIN) - 1.0
            shift = (lost * axis).sum()
            for i in range(n):
                one[n, i] -= shift * axis[i]
                for j in range(n):
                    one[i, j] += gained * axis[i] * axis[j]
    for m in range(MODES):
        for h in range(bank.shape[1] - 1):
            bank[m, h, : n + 1] = one[: n + 1]


@called_kernel
def take_fix(bank, fix, parameters, h):
    """Multiply every likelihood by that of a fix of `fix_of`, along and across the way; h is workspace (n,)."""
    north, east, variance, way_n, way_e = fix
    g, pairs = int(parameters[ERROR_STATE]), int(parameters[ERROR_PAIRS])
    way = math.hypot(way_n, way_e)
    c, s = (way_n / way, way_e / way) if way > 0.0 else (1.0, 0.0)
    for axis_n, axis_e, of_axis in ((c, s, variance + way * way), (-s, c, variance)):
        for i in range(len(h)):
            h[i] = 0.0
        h[NORTH], h[EAST] = axis_n, axis_e
        if g:
            for i in range(g, g + 2 * pairs, 2):
                h[i], h[i + 1] = axis_n, axis_e
        multiply(bank, h, axis_n * north + axis_e * east, of_axis)


@called_kernel
def take_aids(bank, aids, trajectory, accepted, parameters, h):
    """Multiply every likelihood by those of the aids that the forward bank accepted; h is workspace (n,)."""
    for which in range(len(aids)):
        if accepted[which]:
            i, companion, sign, value, variance = measured(which, aids[which], trajectory, parameters)
            for j in range(len(h)):
                h[j] = 0.0
            h[companion] = sign
            h[i] = 1.0
            multiply(bank, h, value, variance)


@lean_kernel
def multiply(bank, h, value, variance):
    """Multiply every likelihood by that of hᵀd = `value` with a variance, up to a common factor."""
    n = len(h)
    for m in range(MODES):
        for which in range(bank.shape[1] - 1):
            one = bank[m, which]
            for i in range(n):
                if h[i] != 0.0:
                    for j in range(n):
                        one[i, j] += h[i] * h[j] / variance
                    one[n, i] += h[i] * value / variance


@called_kernel
def predict_backward(bank, f, offset, q, scale, root, product, lower, room):
    """Take the hypotheses (hypotheses + 1, n + 2, n) of one mode a step back, over what `linearise` fills.

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
        one[n + 1, LOG_WEIGHT] += gained + log_mean_likelihood(root, one, gradient, product, lower, u)
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
        through_transition(one, f, gradient, product)


@lean_kernel
def through_transition(one, f, gradient, product):
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
