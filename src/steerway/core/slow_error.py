"""A prior for the slow error of a receiver, by the kind of fix. Positions alone cannot show this error.

Atmosphere, orbits and reflections shift all fixes of several minutes together. From fixes an estimator therefore gets
only the uncertainty relative to this error; the uncertainty of a position combines both.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

ALONE, DIFFERENTIAL, PRECISE, FIXED, FLOAT, DEAD_RECKONING = range(1, 7)
SLOW_STD = np.array([np.nan, 1.5, 0.7, 0.7, 0.02, 0.3, 7.0, np.nan, np.nan])
"""1σ of north and of east (m), indexed by the quality of GGA or the method of PGN 129029. The indices are: no fix,
autonomous, differential (SBAS), precise, RTK fixed, RTK float, dead reckoning, manual, simulated. The values are orders
of magnitude: makers state 2.5 m (50 %) for an autonomous receiver in the open and 0.01 m + 1 ppm for RTK."""
USUAL_STD = float(SLOW_STD[ALONE])
"""1σ of the slow error, m, if a receiver reports neither accuracy nor kind of fix."""


def slow_std(reported: ArrayLike) -> Any:
    """1σ (m) of north and of east of the slow error: the reported accuracy (m; array or number), else `USUAL_STD`.

    An accuracy computed from the kind of fix and its dilution of precision contains this prior: see `formats.dilution`.
    """
    return np.where(np.isfinite(reported) & (np.asarray(reported) > 0.0), reported, USUAL_STD)


def position_std(relative: ArrayLike, slow: ArrayLike = USUAL_STD) -> Any:
    """1σ (m) of a position: its σ relative to the slow error, and the slow error's σ, combined; arrays or numbers."""
    return np.hypot(relative, slow)
