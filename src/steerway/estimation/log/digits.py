"""The last digit of a log's positions, as far as it matters beside the noise."""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.earth import radii
from steerway.core.statistics import last_digit
from steerway.estimation.log.record import white_std

_FINE, _COARSE = 0.02, 20.0
"""m: a finer last digit is taken for none, unless all fixes are at one place, and a coarser one (of 0.01 minutes it is
18.5 m) for chance. Chosen: with cells of 1 cm some logs of good receivers are estimated better, and one worse."""
_APART = 10.0
"""s between fixes of a run of equal ones that are kept. Chosen by generated records of 5 Hz: with 3, courses of 4
decimals are held by 93 % of their intervals, with 10 by 95; with none a boat moored in one cell goes about in it."""
_FEW, _SAMPLE = 10, 2000
"""Fixes from which on their digits are known, and fixes that are looked at. Chosen."""
_HIDDEN = 0.1
"""Deviation of a rounding error (q/√12), in the white noise of fixes, below which it is left out. Chosen: it adds half
a per cent to the noise."""


def ends_of_repeats(time: Floats, north: Floats, east: Floats) -> Floats:
    """North (n,) of rounded fixes of which a run of equal ones keeps the first, the last and some between; NaN else.

    A cell is entered at the first and left after the last; fixes close by say nothing else where noise is small beside
    the digit. A filter that takes them narrows a normal distribution by the same cell again and again, and two filters
    from either end narrow it twice.
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
    """Last digit (m) north and east in which fixes (n,) rad are written; 0 where it is too fine to matter."""
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
