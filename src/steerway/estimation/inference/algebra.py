"""Algebra of small symmetric matrices, written out: numba's `@` is several times slower at these sizes."""

import math

from steerway.core.compiled import called_kernel

_LEAST = 1e-11
"""Part of a variance that rounding may not take away."""


@called_kernel
def inverse(a, out, lower):
    """out ← a⁻¹ of a symmetric positive definite matrix (n, n) by Cholesky's decomposition, lower receives L⁻¹.

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
                total = max(total, _LEAST * a[j, j])
                if not total > 0.0:
                    return math.nan
                lower[j, j] = math.sqrt(total)
                log_determinant += 2.0 * math.log(lower[j, j])
            else:
                lower[i, j] = total / lower[j, j]
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
    return log_determinant


@called_kernel
def product(a, b, out):
    """out ← a b, (n, n) each."""
    n = len(a)
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
        for k in range(n):
            value = a[i, k]
            if value != 0.0:
                for j in range(n):
                    out[i, j] += value * b[k, j]


@called_kernel
def product_transposed(a, b, out):
    """out ← a bᵀ, (n, n) each."""
    n = len(a)
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += a[i, k] * b[j, k]
            out[i, j] = total


@called_kernel
def eigen(a, vectors):
    """Eigenvalues onto the diagonal of a symmetric matrix (n, n), in place; eigenvectors in columns (Jacobi)."""
    n = len(a)
    for i in range(n):
        for j in range(n):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(12):
        off = 0.0
        for i in range(n):
            for j in range(i + 1, n):
                off += a[i, j] * a[i, j]
        if off < 1e-20:
            return
        for i in range(n):
            for j in range(i + 1, n):
                if abs(a[i, j]) < 1e-14:
                    continue
                theta = 0.5 * (a[j, j] - a[i, i]) / a[i, j]
                t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
                c = 1.0 / math.sqrt(t * t + 1.0)
                s = t * c
                for k in range(n):
                    a[k, i], a[k, j] = c * a[k, i] - s * a[k, j], s * a[k, i] + c * a[k, j]
                for k in range(n):
                    a[i, k], a[j, k] = c * a[i, k] - s * a[j, k], s * a[i, k] + c * a[j, k]
                for k in range(n):
                    vectors[k, i], vectors[k, j] = (
                        c * vectors[k, i] - s * vectors[k, j],
                        s * vectors[k, i] + c * vectors[k, j],
                    )
