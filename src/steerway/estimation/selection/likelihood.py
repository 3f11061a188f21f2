"""How likely a log's fixes, and what its instruments say, are under a profile."""

import math

import numpy as np

from steerway.core.records import Fixes
from steerway.estimation.course.model import GATE
from steerway.estimation.course.replay import run_rows
from steerway.estimation.profiles import GATE as OWN_GATE
from steerway.estimation.profiles import Profile

_OUTLIER_COST = 24.0
"""−log of the density of an outlier: one fix in ten thousand, anywhere within a kilometre."""
OPEN_GATE = 70.0
"""On the NIS, far wider than a filter's own. What follows a refusal is a step of the likelihood, where a search stops
and takes noise for larger than it is."""


def surprises(
    profile: Profile,
    fixes: Fixes,
    counted: np.ndarray | None = None,
    aid: tuple[str, ...] = (),
    gate: float = OWN_GATE,
) -> np.ndarray:
    """(n,) −log likelihood of the innovations of every row; 0 where there is none, or where it is not `counted`.

    Of its position, and of what the instruments of `aid` say.
    No innovation surprises more than an outlier of a uniform density does. Those that the gate refuses cost what they
    would have cost if believed: refusing good fixes costs likelihood.
    """
    model = profile.model(aid)
    model[..., GATE] = gate
    run = run_rows(model, aid, fixes)
    gaussian = 0.5 * (run.log_determinant + run.nis) + math.log(2.0 * math.pi)
    surprise = np.where(np.isfinite(run.nis), np.minimum(gaussian, _OUTLIER_COST), 0.0) + 0.5 * run.aid_surprise
    return surprise if counted is None else np.where(counted, surprise, 0.0)


def cost(profile: Profile, fixes: Fixes, counted: np.ndarray | None = None) -> float:
    """−log likelihood of the rows `counted` (n,) bool, by default all."""
    return float(surprises(profile, fixes, counted).sum())
