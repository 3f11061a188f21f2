"""Whether tuning predicts a part of the log that it has not seen better or worse than the default does.

Both look at the first four fifths, of which tuning holds a fifth back for itself. Judged is the density that each
predicts for the fixes of the last fifth, every one from those before it.
"""

import math

import steerway
from steerway.estimation import log_likelihood
from steerway_studies.unseen_logs.recordings import JudgedLog

SEEN = 0.8
STRONG = 3.0
"""Difference of log likelihoods that is called strong evidence (H. Jeffreys, Theory of Probability, 1961)."""


def held_back(recording: JudgedLog) -> tuple[float, float]:
    """Log likelihood of the last fifth: (default, tuned); NaN where there is too little motion to tune by."""
    fixes = recording.fixes
    begin = fixes.time[0] + SEEN * (fixes.time[-1] - fixes.time[0])
    seen = fixes.between(None, begin)
    try:
        found = steerway.tune(seen)
    except steerway.InputError:
        return math.nan, math.nan
    default, tuned = (log_likelihood(fixes, profile, begin) for profile in (found.default, found.profile))
    return default, tuned


def worse(default: float, tuned: float) -> bool:
    """Whether tuning lost, by strong evidence."""
    return tuned < default - STRONG
