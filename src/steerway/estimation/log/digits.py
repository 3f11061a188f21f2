"""The last digit of a log's positions, where it matters beside the noise."""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.earth import radii
from steerway.core.statistics import last_digit
from steerway.estimation.log.record import white_std

_FINE, _COARSE = 0.02, 20.0
"""Bounds of a last digit, m. A finer one counts as none, unless all fixes are at one place; a coarser one is accidental
(0.01 minutes are 18.5 m). With cells of 1 cm, errors of good receivers fall in some logs and rise in one."""
_APART = 10.0
"""Time, s, between the fixes that are kept of a run of equal ones. In generated records of 5 Hz with 4 decimals, 95 %
intervals cover 93 % of the courses with 3 s and 95 % with 10 s. With none, a boat moored in one cell moves in it."""
_FEW, _SAMPLE = 10, 2000
"""Least number of fixes that show their last digit, and most that are examined."""
_HIDDEN = 0.1
"""Ratio of the rounding error's σ (q/√12) to the white noise of fixes below which rounding is left out: it adds half a
per cent to the noise."""


def ends_of_repeats(time: Floats, north: Floats, east: Floats) -> Floats:
    """North (n,) of rounded fixes; in a run of equal fixes all but the first, the last and some between are NaN.

    The first fix of a run shows when the vessel entered the cell, the last when it left. If noise is small beside the
    digit, the others add nothing. A filter that took them would narrow its distribution by the same cell again and
    again, and two filters from either end would do so twice.
    """
    fixed = np.flatnonzero(np.isfinite(north))
    same = (np.diff(north[fixed]) == 0.0) & (np.diff(east[fixed]) == 0.0)
    inner = np.append(False, same) & np.append(same, False)
    begin = np.maximum.accumulate(np.where(inner, 0, np.arange(len(fixed))))
    nth = np.floor((time[fixed] - time[fixed[begin]]) / _APART)
    inner[1:] &= nth[1:] == nth[:-1]
    thinned = north.copy()
    thinned[fixed[inner]] = np.nan
    return thinned


def quantum_of(time: Floats, latitude: Floats, longitude: Floats) -> tuple[float, float]:
    """Last digit (m, north and east) with which fixes (n,), rad, are written; 0 if it is too fine to matter."""
    if len(time) < _FEW:
        return 0.0, 0.0
    some = slice(None, None, max(1, len(time) // _SAMPLE))
    digit = last_digit(np.concatenate([latitude[some], longitude[some]]))
    meridian, prime_vertical = radii(float(np.median(latitude)))
    north, east = digit * meridian, digit * prime_vertical * math.cos(float(np.median(latitude)))
    noise = white_std(time, meridian * latitude, prime_vertical * math.cos(latitude[0]) * np.unwrap(longitude))
    is_one_place = np.ptp(latitude) == 0.0 and np.ptp(longitude) == 0.0
    is_coarse = (north >= _FINE or is_one_place) and _HIDDEN * math.sqrt(12.0) * noise < north <= _COARSE
    return (north, east) if is_coarse else (0.0, 0.0)
