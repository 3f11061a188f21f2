"""Mean of a likelihood over a Gaussian: the one integral of smoothing in two directions.

After D. C. Fraser and J. E. Potter, IEEE Trans. Automatic Control 14(4), 1969, with the square root of the covariance,
so that neither it nor the information need have an inverse.
"""

import math

from steerway.core.compiled import called_kernel


@called_kernel
def log_mean_likelihood(root, information, gradient, product, lower, u):
    """Logarithm of the mean of exp(gᵀw − ½ wᵀΛw) where w is N(0, L Lᵀ).

    Args:
        root: L (n, n), lower. information, gradient: Λ (n, n), whole, and g (n,).

    Fills product = ΛL, lower = C with C Cᵀ = I + Lᵀ Λ L, and u = C⁻¹ Lᵀ g. Then the mean of w, weighed, is L C⁻ᵀ u, and
    its covariance L C⁻ᵀ C⁻¹ Lᵀ.
    """
    n = len(gradient)
    for i in range(n):
        for j in range(n):
            product[i, j] = 0.0
        for k in range(n):
            for j in range(k + 1):
                product[i, j] += information[i, k] * root[k, j]
    for i in range(n):
        u[i] = 0.0
        for j in range(i):
            lower[i, j] = 0.0
        lower[i, i] = 1.0
    for k in range(n):
        for i in range(k + 1):
            u[i] += root[k, i] * gradient[k]
            for j in range(i + 1):
                lower[i, j] += root[k, i] * product[k, j]
    volume, found = 1.0, 0.0
    for j in range(n):
        for k in range(j):
            lower[j, j] -= lower[j, k] * lower[j, k]
            u[j] -= lower[j, k] * u[k]
        volume *= lower[j, j]
        lower[j, j] = math.sqrt(lower[j, j])
        u[j] /= lower[j, j]
        found += u[j] * u[j]
        for i in range(j + 1, n):
            for k in range(j):
                lower[i, j] -= lower[i, k] * lower[j, k]
            lower[i, j] /= lower[j, j]
    return 0.5 * (found - math.log(volume))
