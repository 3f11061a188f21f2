"""Likelihood of the fixes of a log, and of its aids, under a profile."""

import numpy as np

from steerway.core.records import Fixes
from steerway.estimation.course.motion.layout import GATE
from steerway.estimation.course.replay import run_rows
from steerway.estimation.course.update.outliers import FIX_GATE
from steerway.estimation.profiles import Profile

_OUTLIER_NLL = 24.0
"""−log of the density of an outlier: one fix in ten thousand, anywhere within a kilometre."""
OPEN_GATE = 70.0
"""On the NIS, far wider than a filter's own: at a rejection the likelihood has a step, where a search stops with too
much noise. Five times the gate of the filter rejects what no other noise explains."""


def row_nll(
    profile: Profile,
    fixes: Fixes,
    counted: np.ndarray | None = None,
    aid: tuple[str, ...] = (),
    gate: float = FIX_GATE,
) -> np.ndarray:
    """(n,) −log likelihood of the innovations of every row; 0 where there is none, or where it is not `counted`.

    Of its position, and of the aids. Each is at most that of an outlier of uniform density. A rejected fix counts as if
    accepted: rejecting good fixes costs likelihood.
    """
    parameters = profile.parameters(aid)
    parameters[:, GATE] = gate
    found = run_rows(parameters, aid, fixes)
    nll = np.where(np.isfinite(found.nis), np.minimum(found.nll, _OUTLIER_NLL), 0.0) + found.aid_nll
    return nll if counted is None else np.where(counted, nll, 0.0)


def cost(profile: Profile, fixes: Fixes, counted: np.ndarray | None = None) -> float:
    """−log likelihood of the rows `counted` (n,) bool, by default all."""
    return float(row_nll(profile, fixes, counted).sum())
