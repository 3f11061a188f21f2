"""How well a Gaussian agrees with a likelihood: the one integral of smoothing in two directions.

After D. C. Fraser and J. E. Potter, IEEE Trans. Automatic Control 14(4), 1969, with the square root of the covariance,
so that neither it nor the information need have an inverse.
"""

import math

from steerway.compiled import lean_kernel


@lean_kernel
def agreement(root, information, gradient, seen, lower, u):
    """Logarithm of the mean of exp(gᵀw − ½ wᵀΛw) where w is N(0, L Lᵀ).

    Args:
        root: L (n, n), lower. information, gradient: Λ (n, n), whole, and g (n,).

    Fills seen = ΛL, lower = C with C Cᵀ = I + Lᵀ Λ L, and u = C⁻¹ Lᵀ g. Then the mean of w, weighed, is L C⁻ᵀ u, and
    its covariance L C⁻ᵀ C⁻¹ Lᵀ.
    """
    n = len(gradient)
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(j, n):
                total += information[i, k] * root[k, j]
            seen[i, j] = total
    found = 0.0
    volume = 1.0
    for j in range(n):
        for i in range(j, n):
            total = 1.0 if i == j else 0.0
            for k in range(i, n):
                total += root[k, i] * seen[k, j]
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                volume *= max(total, 1e-3)
                lower[j, j] = math.sqrt(max(total, 1e-3))
            else:
                lower[i, j] = total / lower[j, j]
    for i in range(n):
        total = 0.0
        for k in range(i, n):
            total += root[k, i] * gradient[k]
        for k in range(i):
            total -= lower[i, k] * u[k]
        u[i] = total / lower[i, i]
        found += u[i] * u[i]
    return 0.5 * (found - math.log(volume))
