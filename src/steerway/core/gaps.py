"""What a gap in a record is: one definition for summaries, episodes, surveys of logs and archives."""

import math

import numpy as np

from steerway.core.arrays import Floats

LONGEST_GAP = 1800.0
"""s without a fix after which the filter starts anew: with the decay rates of the profiles here (0.05 1/s and more)
nothing of the manoeuvre is left, and the position is known to kilometres."""
GAP_INTERVALS = 3.0
"""Usual intervals in a gap of one's own log."""


def shortest_gap(intervals: Floats, reports: bool) -> float:
    """s from which on an interval between fixes is a gap: three times the median of those above 0.

    Of AIS reports it is `LONGEST_GAP`: they come every 2 s to 6 min as the vessel moves, so that no interval is usual.
    """
    known = intervals[intervals > 0.0]
    if reports:
        return LONGEST_GAP
    return GAP_INTERVALS * float(np.median(known)) if len(known) else math.inf
