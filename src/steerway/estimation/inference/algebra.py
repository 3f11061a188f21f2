"""Algebra of small symmetric matrices, written out: numba's `@` is several times slower at these sizes."""

import math

from steerway.core.compiled import called_kernel

_LEAST = 1e-11
"""Part of a variance that rounding may not take away: 5·10⁴ times the rounding of a double, 2.2·10⁻¹⁶."""
_SMALL = 1e-12
"""Part of an element on the diagonal beside which one off it counts as none: 5·10³ times the rounding of a double."""


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
    """Eigenvalues onto the diagonal of a symmetric matrix (n, n), in place; eigenvectors in the rows of `vectors`.

    Householder's reduction to a tridiagonal matrix, then implicit QL steps (H. Bowdler, R. S. Martin, C. Reinsch and
    J. H. Wilkinson, Numerische Mathematik 11, 1968).
    """
    n = len(a)
    for i in range(n):
        for j in range(n):
            vectors[i, j] = 1.0 if i == j else 0.0
    for k in range(n - 2):
        # reflect rows and columns beyond k so that column k ends below its diagonal
        norm = 0.0
        for i in range(k + 1, n):
            norm += a[i, k] * a[i, k]
        rest = norm - a[k + 1, k] * a[k + 1, k]
        if rest <= _SMALL * _SMALL:
            continue
        first = -math.copysign(math.sqrt(norm), a[k + 1, k])
        lead = a[k + 1, k] - first
        scale = 2.0 / (rest + lead * lead)
        # the reflection's vector is kept in column k below the diagonal
        a[k + 1, k] = lead
        along = 0.0
        for i in range(k + 1, n):
            total = 0.0
            for j in range(k + 1, n):
                total += a[i, j] * a[j, k]
            a[k, i] = scale * total
            along += a[k, i] * a[i, k]
        for i in range(k + 1, n):
            a[k, i] -= 0.5 * scale * along * a[i, k]
        for i in range(k + 1, n):
            for j in range(k + 1, n):
                a[i, j] -= a[i, k] * a[k, j] + a[k, i] * a[j, k]
        for j in range(n):
            total = 0.0
            for i in range(k + 1, n):
                total += a[i, k] * vectors[i, j]
            for i in range(k + 1, n):
                vectors[i, j] -= scale * total * a[i, k]
        a[k + 1, k] = first
    for i in range(n - 1):
        a[i, i + 1] = a[i + 1, i]
    for low in range(n):
        for _ in range(30):
            high = low
            while high < n - 1 and abs(a[high, high + 1]) > _SMALL * (abs(a[high, high]) + abs(a[high + 1, high + 1])):
                high += 1
            if high == low:
                break
            g = (a[low + 1, low + 1] - a[low, low]) / (2.0 * a[low, low + 1])
            g = a[high, high] - a[low, low] + a[low, low + 1] / (g + math.copysign(math.hypot(g, 1.0), g))
            c = s = 1.0
            shift = 0.0
            i = high - 1
            while i >= low:
                f, b = s * a[i, i + 1], c * a[i, i + 1]
                r = math.hypot(f, g)
                if i + 1 < n - 1:
                    a[i + 1, i + 2] = r
                if r == 0.0:
                    a[i + 1, i + 1] -= shift
                    if high < n - 1:
                        a[high, high + 1] = 0.0
                    break
                s, c = f / r, g / r
                g = a[i + 1, i + 1] - shift
                r = (a[i, i] - g) * s + 2.0 * c * b
                shift = s * r
                a[i + 1, i + 1] = g + shift
                g = c * r - b
                for k in range(n):
                    vectors[i + 1, k], vectors[i, k] = (
                        s * vectors[i, k] + c * vectors[i + 1, k],
                        c * vectors[i, k] - s * vectors[i + 1, k],
                    )
                i -= 1
            if i >= low:
                continue
            a[low, low] -= shift
            a[low, low + 1] = g
            if high < n - 1:
                a[high, high + 1] = 0.0
