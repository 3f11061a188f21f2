"""How likely a log's fixes are under a profile."""

import math

import numpy as np

from steerway.estimation.model import OUTLIER
from steerway.estimation.profiles import Profile
from steerway.estimation.replay import run_rows
from steerway.records import Fixes

_OUTLIER_COST = 24.0
"""−log of the density of an outlier: one fix in ten thousand, anywhere within a kilometre."""


def surprises(profile: Profile, fixes: Fixes, counted: np.ndarray | None = None) -> np.ndarray:
    """(n,) −log likelihood of the innovation of every row; 0 where there is none, or where it is not `counted`.

    No innovation surprises more than an outlier of a uniform density does. Those that the gate refuses cost what they
    would have cost if believed: refusing good fixes costs likelihood, and the cost is continuous in the profile.
    What a filter takes beyond its gate because an outlier is unlikelier (`OUTLIER`) is refused here, or a profile that
    claims too much would go unpunished.
    """
    model = profile.model()
    model[..., OUTLIER] = -math.inf
    run = run_rows(model, (), fixes)
    known = np.isfinite(run.nis) if counted is None else counted & np.isfinite(run.nis)
    gaussian = 0.5 * (run.log_determinant + run.nis) + math.log(2.0 * math.pi)
    return np.where(known, np.minimum(gaussian, _OUTLIER_COST), 0.0)


def cost(profile: Profile, fixes: Fixes, counted: np.ndarray | None = None) -> float:
    """−log likelihood of the rows `counted` (n,) bool, by default all."""
    return float(surprises(profile, fixes, counted).sum())
