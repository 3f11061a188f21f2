"""Rows after an outage: receivers slide in, and positions alone do not tell the slide from a motion.

Behind a loss of reception receivers may be off by tens of metres and come back to the true place within a quarter of a
minute. The positions then have a speed that the vessel has not. Until they rest, the velocity before the outage stays
possible: the difference from it is added to the variances.
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
"""s without a fix behind which a receiver may slide in. Chosen: after a shorter loss it need not search anew."""
_INTERVALS = 5.0
"""Usual intervals that an outage is at least. Chosen: fewer are missing fixes."""
SLIDES = 20.0 - 1e-3
"""s for which a receiver slides, less what clocks err by. Chosen: a recorded slide takes ten, and the estimate follows
it some seconds late."""
_SHARE = 0.3
"""Share of the square of the difference that is added. Chosen: with 0.26 a 95 % interval just reaches the velocity
before."""
_FASTER, _BY = 2.0, 1.0
"""A speed of more than so many times that before, and m/s more, is taken for a slide's; else a vessel that has turned
meanwhile would have no course. Chosen."""


@lean_kernel
def is_outage(interval: float, usual: float) -> bool:
    """Whether an interval (s) between fixes is an outage; usual: the last one shorter than SHORTEST, 0 for none."""
    return SHORTEST <= interval <= LONGEST_GAP and interval >= _INTERVALS * usual > 0.0


@lean_kernel
def is_faster(sog: float, sog_before: float) -> bool:
    """Whether a speed after an outage is rather a slide's than the vessel's, by that before the outage (m/s)."""
    return sog > _FASTER * sog_before + _BY


@lean_kernel
def doubt(estimate: Floats, sog_before: float, cog_before: float, slides: bool) -> None:
    """Add to the deviations of an estimate (9,) after an outage what the velocity before it means.

    slides: whether a slide is suspected; without it a change of course is the vessel's. A course that is not known any
    more is not stated.
    """
    estimate[SOG_STD] = math.sqrt(estimate[SOG_STD] ** 2 + _SHARE * (estimate[SOG] - sog_before) ** 2)
    if slides and math.isfinite(cog_before):
        turned = wrap(estimate[COG] - cog_before)
        estimate[COG_STD] = math.sqrt(estimate[COG_STD] ** 2 + _SHARE * turned * turned)
        if not estimate[COG_STD] < COURSE_STD:
            estimate[COG] = estimate[RATE] = estimate[COG_STD] = estimate[RATE_STD] = math.nan


def outages(time: Floats) -> list[int]:
    """Index of the last fix before every outage, of fixes at these times (n,)."""
    intervals = np.diff(time)
    is_short = (intervals > 0.0) & (intervals < SHORTEST)
    latest = np.maximum.accumulate(np.where(is_short, np.arange(len(intervals)), -1))
    long = np.flatnonzero((intervals >= SHORTEST) & (latest >= 0))
    return [int(k) for k in long if is_outage(intervals[k], intervals[latest[k]])]


def doubt_slides(time: Floats, fixed: Bools, causal: Floats, estimate: Floats) -> None:
    """`doubt` of the rows of a record (n, 9) after its outages, by the causal estimate (n, 9) at the fix before each.

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
