"""Rows after an outage: receivers slide to the true place, which positions alone cannot distinguish from motion.

After a loss of reception receivers may be off by tens of metres and return to the true place within a quarter of a
minute. The positions then move although the vessel does not. Until the slide is over, the velocity before the outage
remains possible: the difference from it is added to the variances.
"""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Bools, Floats
from steerway.core.compiled import lean_kernel
from steerway.core.gaps import LONGEST_GAP
from steerway.estimation.filter.fuse import COURSE_STD
from steerway.estimation.log.course import COG, COG_STD, RATE, RATE_STD, SOG, SOG_STD

SHORTEST = 10.0
"""Shortest time (s) without a fix after which a receiver may slide; after less it need not search again."""
_INTERVALS = 5.0
"""Shortest outage in usual intervals; shorter gaps are missing fixes."""
SLIDES = 20.0 - 1e-3
"""Time, s, after an outage in which a receiver may slide, minus the error of clocks. A recorded slide took 10 s, and
the estimate follows some seconds late."""
_SHARE = 0.3
"""Share of the squared difference that is added to the variance; with 0.26, 1.96 σ are just the difference."""
_FASTER, _BY = 2.0, 1.0
"""A speed above twice that before the outage plus 1 m/s counts as a slide. At lower speeds a changed course is the
vessel's: it may have turned meanwhile."""


@lean_kernel
def is_outage(interval: float, usual: float) -> bool:
    """Whether an interval (s) between fixes is an outage; usual: the last interval below SHORTEST, 0 for none."""
    return SHORTEST <= interval <= LONGEST_GAP and interval >= _INTERVALS * usual > 0.0


@lean_kernel
def is_faster(sog: float, sog_before: float) -> bool:
    """Whether a SOG after an outage is more likely a slide than motion, from the SOG before (m/s)."""
    return sog > _FASTER * sog_before + _BY


@lean_kernel
def doubt(estimate: Floats, sog_before: float, cog_before: float, slides: bool) -> None:
    """Widen the standard deviations of an estimate (9,) after an outage by its difference from the velocity before.

    slides: whether a slide is suspected; if not, the course keeps its σ. Course and course rate become NaN if the
    σ of the course is too large.
    """
    estimate[SOG_STD] = math.sqrt(estimate[SOG_STD] ** 2 + _SHARE * (estimate[SOG] - sog_before) ** 2)
    if slides and math.isfinite(cog_before):
        turned = wrap(estimate[COG] - cog_before)
        estimate[COG_STD] = math.sqrt(estimate[COG_STD] ** 2 + _SHARE * turned * turned)
        if not estimate[COG_STD] < COURSE_STD:
            estimate[COG] = estimate[RATE] = estimate[COG_STD] = estimate[RATE_STD] = math.nan


def outages(time: Floats) -> list[int]:
    """Indices of the last fix before every outage, for fixes at these times (n,)."""
    intervals = np.diff(time)
    is_short = (intervals > 0.0) & (intervals < SHORTEST)
    latest = np.maximum.accumulate(np.where(is_short, np.arange(len(intervals)), -1))
    long = np.flatnonzero((intervals >= SHORTEST) & (latest >= 0))
    return [int(k) for k in long if is_outage(intervals[k], intervals[latest[k]])]


def doubt_slides(time: Floats, fixed: Bools, causal: Floats, estimate: Floats) -> None:
    """Apply `doubt` to the estimates (n, 9) of rows after outages, with the causal estimate (n, 9) before each outage.

    fixed: (n,) bool, rows with a fix.
    """
    fixes = np.flatnonzero(fixed)
    found = outages(time[fixes])
    begins = [*(int(fixes[k + 1]) for k in found), len(time)]
    for k, begin, following in zip(found, begins, begins[1:], strict=False):
        sog, cog = causal[fixes[k], SOG], causal[fixes[k], COG]
        slides = False
        for row in range(begin, min(following, int(np.searchsorted(time, time[begin] + SLIDES)))):
            slides = slides or is_faster(estimate[row, SOG], sog)
            doubt(estimate[row], sog, cog, slides)
