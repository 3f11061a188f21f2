"""The slow error of a receiver, which positions cannot show: a prior by the kind of fix.

Atmosphere, orbits and reflections move all fixes of minutes together. What an estimator learns from fixes is therefore
the uncertainty relative to that error; the uncertainty of a position is both together.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

ALONE, DIFFERENTIAL, PRECISE, FIXED, FLOAT, DEAD_RECKONING = range(1, 7)
SLOW_STD = np.array([np.nan, 1.5, 0.7, 0.7, 0.02, 0.3, 7.0, np.nan, np.nan])
"""1σ of north and of east (m) by the quality of GGA and the method of PGN 129029: no fix, alone, differential (SBAS),
precise, RTK fixed, RTK float, dead reckoning, by hand, simulated. Chosen as orders of magnitude: makers state 2.5 m
(50 %) for a receiver alone in the open and 0.01 m + 1 ppm for RTK."""
USUAL_STD = float(SLOW_STD[ALONE])
"""m, 1σ of the slow error if a receiver reports nothing."""


def slow_std(reported: ArrayLike) -> Any:
    """1σ (m) of north and of east that a fix has by what its receiver reports of it (m; array or number, NaN: nothing).

    What is reported of a fix by its kind and dilution of precision is this prior itself, see `formats.dilution`.
    """
    return np.where(np.isfinite(reported) & (np.asarray(reported) > 0.0), reported, USUAL_STD)


def position_std(relative: ArrayLike, slow: ArrayLike = USUAL_STD) -> Any:
    """1σ (m) of a position by that relative to the receiver's slow error, and the slow error's; arrays or numbers."""
    return np.hypot(relative, slow)
