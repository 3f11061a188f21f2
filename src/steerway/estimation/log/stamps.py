"""Times of measurement of fixes whose time stamps are rounded or are those of reception."""

import numpy as np

from steerway.core.arrays import Floats

_GAP = 2.5
"""A step longer than this many usual ones is a gap; a late or rounded stamp is off by one step."""
_WINDOW = 150
"""Fixes on either side whose stamps determine the time of a fix, by a least-squares line. With 301 stamps whose errors
spread evenly over an interval, the time errs by 0.02 intervals, and the interval by 0.02 %."""
_IRREGULAR, _FEWEST = 0.3, 40
"""Least difference between a step of the stamps and the interval, as a share of the interval, that counts as irregular;
and least number of such steps. Clocks of receivers err by less than a hundredth."""
_WITHIN = 0.9
"""Least share of the stamps within a usual step of their regular times: few fixes are received later than that."""
_AROUND = 3
"""Fixes on either side of a step over which the velocity is averaged; turns are slower."""
_CLOSER = 0.5
"""Regular times are used if displacements differ from the predicted ones by less than this share of the stamps'
difference. The ratio is 0.2 and 0.3 in recorded logs of regular fixes, 1.6 to 19 in 14 others with irregular stamps."""


def regular_times(time: Floats, north: Floats, east: Floats) -> Floats | None:
    """(n,) regular times (s) of fixes whose stamps are irregular although the vessel moves evenly; None for others.

    Receivers measure at a regular interval, but loggers may stamp on reception or to the second. Where the step of the
    stamps is irregular, the displacement shows whether the time between the measurements was.

    Args:
        time: (n,) s, ascends. north, east: (n,) m.
    """
    regular, interval, usual = _regular(time)
    step = np.diff(time)
    odd = np.flatnonzero(np.abs(step - interval) > _IRREGULAR * interval)
    odd = odd[(odd >= _AROUND) & (odd < len(step) - _AROUND)]
    if len(odd) < _FEWEST or np.quantile(np.abs(time - regular), _WITHIN) > usual:
        return None
    first, last = odd - _AROUND, odd + _AROUND + 1
    around, moved = (np.hypot(north[b] - north[a], east[b] - east[a]) for a, b in ((first, last), (odd, odd + 1)))
    by_stamps, by_regular = (
        np.abs(moved - around * (t[odd + 1] - t[odd]) / np.maximum(t[last] - t[first], 1e-9)) for t in (time, regular)
    )
    apart = around * np.abs(step[odd] - interval[odd])
    telling = apart > np.median(apart)
    return regular if np.median(by_regular[telling]) < _CLOSER * np.median(by_stamps[telling]) else None


def _regular(time: Floats) -> tuple[Floats, Floats, float]:
    """(n,) times (s) by lines through nearby stamps; (n − 1,) their steps, NaN in gaps; usual step of the stamps."""
    n, step = len(time), np.diff(time)
    if not (step > 0.0).any():
        return time, np.zeros_like(step), 0.0
    usual = np.median(step[step > 0.0])
    gap = step > _GAP * usual
    begins = np.append(0, np.flatnonzero(gap) + 1)
    of_piece = np.append(0, np.cumsum(gap))
    row = np.arange(n)
    low = np.maximum(row - _WINDOW, begins[of_piece])
    high = np.minimum(row + _WINDOW, np.append(begins[1:], n)[of_piece] - 1) + 1
    rows = high - low
    mean = (time[-1] - time[0]) / n
    off = time - time[0] - mean * row  # small numbers, so that sums of many keep their digits
    total, moment = (np.append(0.0, np.cumsum(each)) for each in (off, off * row))
    centre = 0.5 * (low + high - 1)
    level = (total[high] - total[low]) / rows
    slope = (moment[high] - moment[low] - centre * level * rows) / np.maximum(rows * (rows**2 - 1.0) / 12.0, 1.0)
    regular = np.maximum.accumulate(time[0] + mean * row + level + slope * (row - centre))
    return regular, np.where(gap, np.nan, np.diff(regular)), usual
