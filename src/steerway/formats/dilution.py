"""The accuracy of a fix from its dilution of precision, for receivers that report nothing better."""

import math

from steerway.core.interpreted import part_of_kernels
from steerway.core.slow_error import ALONE, DIFFERENTIAL, FIXED, FLOAT, SLOW_STD

__all__ = ["ALONE", "DIFFERENTIAL", "FIXED", "FLOAT", "LARGEST", "OF_FIX_TYPE", "deviation"]

LARGEST = 50.0
"""HDOP at and above which there is no fix."""
OF_FIX_TYPE = {4: DIFFERENTIAL, 5: FLOAT, 6: FIXED}
"""GGA quality by fix type of ArduPilot, MAVLink and PX4; other types are fixes without corrections (ALONE)."""


@part_of_kernels
def deviation(dilution: float, quality: float = ALONE) -> float:
    """1σ of north and of east (m) from HDOP and GGA quality; NaN if either is unknown.

    The slow error for this quality (SLOW_STD) is multiplied by HDOP. HDOP below 1 counts as 1, because better satellite
    geometry does not reduce the error of the atmosphere.
    """
    if not 0.0 < dilution < LARGEST or not 0 <= quality < len(SLOW_STD):
        return math.nan
    return max(dilution, 1.0) * SLOW_STD[int(quality)]
