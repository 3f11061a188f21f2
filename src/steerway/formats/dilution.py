"""The accuracy of a fix from its dilution of precision, for receivers that report nothing better."""

import math

from steerway.core.interpreted import part_of_kernels
from steerway.core.slow_error import ALONE, DIFFERENTIAL, FIXED, FLOAT, SLOW_STD

__all__ = ["ALONE", "DIFFERENTIAL", "FIXED", "FLOAT", "LARGEST", "OF_FIX_TYPE", "deviation"]

LARGEST = 50.0
"""HDOP from which on it indicates no fix."""
OF_FIX_TYPE = {4: DIFFERENTIAL, 5: FLOAT, 6: FIXED}
"""Quality of GGA of a type or status of fix of ArduPilot, MAVLink and PX4; of others it is a fix alone."""


@part_of_kernels
def deviation(dilution: float, quality: float = ALONE) -> float:
    """1σ of north and of east (m) by HDOP and the quality of the fix; NaN where they are unknown.

    That of the kind of fix, times an HDOP above 1: satellites in better places do not make the atmosphere better.
    """
    if not 0.0 < dilution < LARGEST or not 0 <= quality < len(SLOW_STD):
        return math.nan
    return max(dilution, 1.0) * SLOW_STD[int(quality)]
