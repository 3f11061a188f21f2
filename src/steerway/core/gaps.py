"""The definition of a gap in a record. Summaries, episodes, surveys of logs and archives use this one."""

import math

import numpy as np

from steerway.core.arrays import Floats

LONGEST_GAP = 1800.0
"""Time without a fix, s, after which the filter restarts. By then, with the course-rate decay of the built-in profiles
(0.05 1/s and more), the last manoeuvre has decayed and the position is uncertain by kilometres."""
GAP_INTERVALS = 3.0
"""Shortest gap in the log of a single vessel, as a multiple of the median interval."""


def shortest_gap(intervals: Floats, reports: bool) -> float:
    """The shortest interval (s) between fixes that is a gap: three times the median of the intervals above 0.

    For AIS reports it is `LONGEST_GAP`: their interval varies with a vessel's motion, from 2 s to 6 min.
    """
    if reports:
        return LONGEST_GAP
    known = intervals[intervals > 0.0]
    return GAP_INTERVALS * float(np.median(known)) if len(known) else math.inf
