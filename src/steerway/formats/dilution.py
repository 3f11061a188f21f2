"""The accuracy of a fix from its dilution of precision, for receivers that report nothing better.

HDOP times the range error is the horizontal error, a radius. The range error depends on the kind of fix; the numbers
here are orders of magnitude, sufficient to distinguish a fix of centimetres from one of metres.
"""

import math

import numpy as np

from steerway.core.interpreted import part_of_kernels

RANGE_ERROR = np.array([np.nan, 3.0, 1.0, 1.0, 0.02, 0.3, 10.0, np.nan, np.nan])
"""m, by the quality of GGA and the method of PGN 129029: no fix, alone, differential, precise, RTK fixed, RTK float,
dead reckoning, by hand, simulated."""
ALONE, DIFFERENTIAL, PRECISE, FIXED, FLOAT, DEAD_RECKONING = range(1, 7)
LARGEST = 50.0
"""HDOP from which on it indicates no fix."""


@part_of_kernels
def deviation(dilution, quality=ALONE):
    """1σ of north and of east (m) by HDOP and the quality of the fix; NaN where they are unknown."""
    if not 0.0 < dilution < LARGEST or not 0 <= quality < len(RANGE_ERROR):
        return math.nan
    return dilution * RANGE_ERROR[int(quality)] / math.sqrt(2.0)
