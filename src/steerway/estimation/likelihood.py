"""How likely a log's fixes are under a profile."""

import math

import numpy as np

from steerway.estimation.profiles import GATE, Profile
from steerway.estimation.replay import run_rows
from steerway.records import Fixes

_OUTLIER_COST = 24.0
"""−log of the density of an outlier: one fix in ten thousand, anywhere within a kilometre."""


def cost(profile: Profile, fixes: Fixes, counted: np.ndarray | None = None) -> float:
    """−log likelihood of the innovations of the rows `counted` (n,) bool, by default all.

    Innovations beyond the gate count as outliers of a uniform density, so that rejecting good fixes costs likelihood.
    """
    run = run_rows(profile.model(), (), fixes)
    known = np.isfinite(run.nis) if counted is None else counted & np.isfinite(run.nis)
    good = known & (run.nis <= GATE)
    gaussian = 0.5 * (run.log_determinant[good] + run.nis[good]) + math.log(2.0 * math.pi)
    return float(gaussian.sum()) + _OUTLIER_COST * int((known & ~good).sum())
