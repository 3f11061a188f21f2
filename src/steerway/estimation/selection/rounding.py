"""Rounding of a receiver's positions: an error that every record has."""

import math

import numpy as np

from steerway.core.earth import radii
from steerway.core.records import Fixes
from steerway.core.rounding import written_step

_STEPS = np.sort(np.radians([10.0**-k / 60.0 for k in range(2, 9)] + [10.0**-k for k in range(4, 10)]))[::-1]
"""rad: decimals of minutes and of degrees, the coarsest first."""
_TOLERANCE = 1e-3
"""Of a step: far more than arithmetic errs by, far less than chance would have on many fixes."""
_MANY = 1000
"""Rows looked at: chance agreement with a wrong step is excluded after ten."""


def rounding_std(fixes: Fixes) -> float:
    """Standard deviation, north or east, of what the last digit of the positions leaves open (m); 0 if it is too small.

    An error between plus and minus half a digit, anywhere alike, is 1/√12 of it.
    """
    fixes = fixes.rows(fixes.has_position)
    if len(fixes) == 0:
        return 0.0
    rows = np.unique(np.linspace(0, len(fixes) - 1, min(len(fixes), _MANY)).astype(int))
    latitude, longitude = fixes.latitude[rows], fixes.longitude[rows]
    step = np.nan_to_num(written_step(np.concatenate([latitude, longitude]), _STEPS, _TOLERANCE))
    meridian, prime_vertical = radii(latitude[0])
    return float(step) * math.hypot(meridian, prime_vertical * math.cos(latitude[0])) / math.sqrt(24.0)
