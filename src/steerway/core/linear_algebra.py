"""Small dense matrices, in place and without allocation: numba's `@` is 6–30 times slower at these sizes."""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import lean_kernel


def symmetric(upper: Floats) -> Floats:
    """Symmetric matrices (…, n, n) from their upper triangles."""
    return np.triu(upper) + np.swapaxes(np.triu(upper, 1), -1, -2)


@lean_kernel
def fill_lower(a: Floats) -> None:
    """Copy the upper triangle of a square matrix into the lower."""
    for i in range(1, min(a.shape[0], a.shape[1])):
        for j in range(i):
            a[i, j] = a[j, i]


@lean_kernel
def multiply(a: Floats, b: Floats, out: Floats) -> None:
    """out ← A B."""
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@lean_kernel
def multiply_transposed(a: Floats, b: Floats, out: Floats) -> None:
    """out ← A Bᵀ."""
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[j, k]
            out[i, j] = total


@lean_kernel
def factor(a: Floats, scale: Floats, lower: Floats) -> None:
    """Cholesky factor of D A D with D = diag(scale) = diag(A)^(−1/2), from A's upper triangle.

    Scaling makes positions in m and rates in rad/s comparable. A pivot that rounding has cancelled is set to 1e-14.
    """
    n = len(a)
    for i in range(n):
        scale[i] = 1.0 / math.sqrt(max(a[i, i], 1e-300))
    for j in range(n):
        for i in range(j, n):
            total = a[j, i] * scale[i] * scale[j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                lower[j, j] = math.sqrt(max(total, 1e-14))
            else:
                lower[i, j] = total / lower[j, j]


@lean_kernel
def solve_rows(lower: Floats, scale: Floats, rows: Floats) -> None:
    """rows ← rows A⁻¹ for the matrix A that `factor` has factored."""
    n = len(lower)
    for r in range(rows.shape[0]):
        row = rows[r]
        for i in range(n):
            total = row[i] * scale[i]
            for k in range(i):
                total -= lower[i, k] * row[k]
            row[i] = total / lower[i, i]
        for i in range(n - 1, -1, -1):
            total = row[i]
            for k in range(i + 1, n):
                total -= lower[k, i] * row[k]
            row[i] = total / lower[i, i]
        for i in range(n):
            row[i] *= scale[i]
