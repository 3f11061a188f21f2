"""Mean and covariance of the position over all modes and structures."""

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel
from steerway.estimation.filter.model import EAST, NORTH, Bank

MOMENTS = 5
"""Mean north and east (m), variance of north, covariance, variance of east (m²)."""


@called_kernel
def place_moments(bank: Bank, out: Floats) -> None:
    """MOMENTS of the position over all modes, into `out`."""
    x, p, probability = bank.x, bank.p, bank.probability
    for i in range(MOMENTS):
        out[i] = 0.0
    for k in range(len(probability)):
        out[0] += probability[k] * x[k, NORTH]
        out[1] += probability[k] * x[k, EAST]
    for k in range(len(probability)):
        a, b = x[k, NORTH] - out[0], x[k, EAST] - out[1]
        out[2] += probability[k] * (p[k, 0, 0] + a * a)
        out[3] += probability[k] * (p[k, 0, 1] + a * b)
        out[4] += probability[k] * (p[k, 1, 1] + b * b)


def mixed(moments: Floats, weights: Floats) -> Floats:
    """(…, MOMENTS) of the mixture of structures (s, …, MOMENTS) with these weights (s,)."""
    mean = np.tensordot(weights, moments, 1)
    apart = moments[..., :2] - mean[..., :2]
    mean[..., 2] += np.tensordot(weights, apart[..., 0] ** 2, 1)
    mean[..., 3] += np.tensordot(weights, apart[..., 0] * apart[..., 1], 1)
    mean[..., 4] += np.tensordot(weights, apart[..., 1] ** 2, 1)
    return mean


def rotated(moments: Floats, azimuth: float | Floats) -> tuple[Floats, Floats, Floats]:
    """Variance of true north, covariance and variance of true east (…,) from MOMENTS in a plane of this azimuth."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    nn, ne, ee = moments[..., 2], moments[..., 3], moments[..., 4]
    return (
        c * c * nn - 2.0 * c * s * ne + s * s * ee,
        c * s * (nn - ee) + (c * c - s * s) * ne,
        s * s * nn + 2.0 * c * s * ne + c * c * ee,
    )
