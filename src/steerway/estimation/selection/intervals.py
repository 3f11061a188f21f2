"""95 % intervals of every parameter that is fitted to a log.

At the maximum the likelihood falls off as its curvature says, if the model is the truth. Where it is not, the
scores of neighbouring rows depend on one another, and stretches of the log disagree more than they should: the spread
of their scores takes the place of the curvature's own (the sandwich of P. J. Huber, Proc. 5th Berkeley Symposium, 1967;
H. White, Econometrica 50(1), 1982). The wider of the two is given.
"""

import numpy as np

from steerway.estimation.selection.search import Fit

_STRETCHES = 20
"""Parts whose scores are taken as independent: each longer than the errors of a receiver, in logs of an hour."""
_QUANTILE = 2.09
"""Of Student's t with 19 degrees of freedom, for 95 %."""
_DIFFERENCE = 0.1
"""Of a logarithm, for second differences: wide enough for the steps of the likelihood at rejections."""
_LEAST_FREEDOM = 0.1
"""Of χ²: less than a waiting time has no upper end."""


def intervals(fit: Fit) -> dict[str, tuple[float, float]]:
    """Lower and upper end by name."""
    search, spread = fit.search, np.sqrt(np.maximum(*_variances(fit)))
    reach = np.array([_reach(name, each) for name, each in zip(search.names, spread, strict=True)])
    low, high = np.exp(np.clip(fit.logs + reach.T, *search.limits))
    return {name: (_rounded(a), _rounded(b)) for name, a, b in zip(search.names, low, high, strict=True)}


def _reach(name, spread) -> tuple[float, float]:
    """How far an interval reaches to either side, of the logarithm.

    The mean of k waiting times is known to 1/√k of itself, and errs upwards by more than downwards: 2k of its share of
    the truth are distributed as χ² with 2k degrees of freedom.
    """
    if name not in ("straight_time", "turn_time"):
        return -_QUANTILE * spread, _QUANTILE * spread
    from scipy.stats import chi2

    freedom = max(2.0 / spread**2, _LEAST_FREEDOM)
    most, least = np.log(freedom / chi2.ppf([0.975, 0.025], freedom))
    return most * _QUANTILE / 1.96, least * _QUANTILE / 1.96


def _variances(fit: Fit) -> tuple[np.ndarray, np.ndarray]:
    """(p,), (p,) variances of the logarithms: by the curvature, and by the scores of stretches."""
    scores = fit.search.scores(fit.logs)
    prior = np.diag(1.0 / fit.search.prior[1])
    curvature = _curvature(fit)
    if np.linalg.eigvalsh(curvature)[0] <= 0.0:
        curvature = scores.T @ scores + prior
    inverse = np.linalg.inv(curvature)
    parts = np.array([part.sum(axis=0) for part in np.array_split(scores, _STRETCHES)])
    parts -= parts.mean(axis=0)
    meat = parts.T @ parts * _STRETCHES / (_STRETCHES - 1.0) + prior
    return np.diag(inverse), np.diag(inverse @ meat @ inverse)


def _curvature(fit: Fit) -> np.ndarray:
    """(p, p) second derivatives of what was minimised, by symmetric differences."""
    n = len(fit.logs)
    shifts = np.eye(n) * _DIFFERENCE
    rows, columns = np.triu_indices(n, 1)
    both = shifts[rows] + shifts[columns]
    values = fit.search.values(fit.logs + np.concatenate([shifts, -shifts, both, -both]))
    ahead, behind, ahead_both, behind_both = np.split(values, np.cumsum([n, n, len(both)]))
    bend = ahead + behind - 2.0 * fit.cost
    curvature = np.diag(bend)
    mixed = 0.5 * (ahead_both + behind_both - 2.0 * fit.cost - bend[rows] - bend[columns])
    curvature[rows, columns] = curvature[columns, rows] = mixed
    return curvature / _DIFFERENCE**2


def _rounded(value) -> float:
    return float(f"{value:.3g}")
