"""Algebra of small symmetric matrices, written out: numba's `@` is several times slower at these sizes."""

import math

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel

_ROUNDING = 1e-6
"""Largest negative pivot, relative to the diagonal element, that counts as rounding of a positive definite matrix."""
_LEAST = 1e-11
"""Least pivot relative to the diagonal element: 5·10⁴ times the rounding of a double, 2.2·10⁻¹⁶."""


@called_kernel
def inverse(a: Floats, out: Floats, lower: Floats) -> float:
    """out ← a⁻¹ of a symmetric positive definite matrix (n, n) by Cholesky's decomposition, and lower ← L⁻¹.

    Returns log det a, or NaN where a is not positive definite.
    """
    log_determinant = factor(a, lower)
    if not math.isnan(log_determinant):
        invert_factor(lower, out)
    return log_determinant


@called_kernel
def factor(a: Floats, lower: Floats) -> float:
    """lower ← L with a = L Lᵀ (n, n). Reads the lower triangle of `a`.

    Returns log det a, or NaN where a is not positive definite.
    """
    n = len(a)
    log_determinant = 0.0
    for j in range(n):
        for i in range(j):
            lower[i, j] = 0.0
        for i in range(j, n):
            total = a[i, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                if not total > -_ROUNDING * a[j, j]:
                    return math.nan
                total = max(total, _LEAST * a[j, j])
                if total == 0.0:
                    return math.nan
                lower[j, j] = math.sqrt(total)
                log_determinant += 2.0 * math.log(lower[j, j])
            else:
                lower[i, j] = total / lower[j, j]
    return log_determinant


@called_kernel
def invert_factor(lower: Floats, out: Floats) -> None:
    """lower ← L⁻¹ and out ← (L Lᵀ)⁻¹. On entry, `lower` is L (n, n)."""
    n = len(lower)
    for j in range(n):
        lower[j, j] = 1.0 / lower[j, j]
        for i in range(j + 1, n):
            total = 0.0
            for k in range(j, i):
                total -= lower[i, k] * lower[k, j]
            lower[i, j] = total / lower[i, i]
    for i in range(n):
        for j in range(i, n):
            total = 0.0
            for k in range(j, n):
                total += lower[k, i] * lower[k, j]
            out[i, j] = out[j, i] = total


@called_kernel
def whitened_square(lower: Floats, vector: Floats, out: Floats) -> float:
    """out ← L⁻¹ v for a factor L (n, n). Returns its squared length, vᵀ (L Lᵀ)⁻¹ v."""
    square = 0.0
    for i in range(len(vector)):
        total = vector[i]
        for k in range(i):
            total -= lower[i, k] * out[k]
        out[i] = total / lower[i, i]
        square += out[i] * out[i]
    return square
