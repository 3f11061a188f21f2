"""The definition of a gap in a record. Summaries, episodes, surveys of logs and archives use this one."""

import math

import numpy as np

from steerway.core.arrays import Floats

LONGEST_GAP = 1800.0
"""s without a fix after which the filter starts anew: with the decay rates of the profiles here (0.05 1/s and more)
nothing of the manoeuvre is left, and the position is known to kilometres."""
GAP_INTERVALS = 3.0
"""Usual intervals in a gap of one's own log."""


def shortest_gap(intervals: Floats, reports: bool) -> float:
    """The shortest interval (s) between fixes that is a gap: three times the median of the intervals above 0.

    AIS reports have no usual interval, because vessels report every 2 s to 6 min as they move: `LONGEST_GAP`.
    """
    if reports:
        return LONGEST_GAP
    known = intervals[intervals > 0.0]
    return GAP_INTERVALS * float(np.median(known)) if len(known) else math.inf
