"""Mean and covariance of the motion, of all modes and structures together."""

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.linear_algebra import symmetric
from steerway.estimation.filter.model import COURSE, SPEED

_LEAST_SPEED = 1e-6
"""m/s, to divide by: at rest course means nothing."""


def motion_moments(models, banks, weights) -> tuple[Floats, Floats]:
    """State [x^n y^n U χ ω_χ …] and covariance of one mode (n, n), or of the mixture of all (5,) and (5, 5).

    The course rate is the held one; NaN before the first fix.
    """
    n = banks[0].x.shape[1] if len(banks) == 1 and len(models[0].modes) == 1 else 5
    if not all(bank.run["started"][0] for bank in banks):
        return np.full(n, np.nan), np.full((n, n), np.nan)
    means, covariances, shares = [], [], []
    for bank, weight in zip(banks, weights, strict=True):
        for x, p, probability in zip(bank.x, bank.p, bank.probability, strict=True):
            means.append(x[:n])
            covariances.append(of_course(x, p)[:n, :n])
            shares.append(weight * probability)
    likeliest = means[int(np.argmax(shares))]
    apart = np.array(means) - likeliest
    apart[:, COURSE] = [wrap(each) for each in apart[:, COURSE]]
    share = np.array(shares) / np.sum(shares)
    mean = share @ apart
    spread = np.einsum("k,ki,kj->ij", share, apart, apart) - np.outer(mean, mean)
    state = likeliest + mean
    state[COURSE] = wrap(state[COURSE])
    return state, np.einsum("k,kij->ij", share, np.array(covariances)) + spread


def of_course(x, p) -> Floats:
    """Covariance (n, n) of the state, of that with the velocity across the course in place of the course."""
    scale = np.ones(len(x))
    scale[COURSE] = 1.0 / max(x[SPEED], _LEAST_SPEED)
    return symmetric(p) * np.outer(scale, scale)
