"""When fixes were measured, of which the time stamps are rounded or those of receipt."""

import numpy as np

from steerway.core.arrays import Floats

_GAP = 2.5
"""Usual steps of the stamps above which fixes are missing. Chosen: a late or rounded stamp is off by one step."""
_WINDOW = 150
"""Fixes on either side of one whose stamps give its time: in 301 fixes errors of a whole interval, evenly distributed,
leave 0.02 of it, and 0.02 % of the interval itself (a line by least squares)."""
_IRREGULAR, _FEWEST = 0.3, 40
"""Part of an interval by which a stamp's step departs from it to be irregular, and such steps that are needed. Chosen:
clocks of receivers err by less than a hundredth."""
_WITHIN = 0.9
"""Share of stamps that are off a regular time by less than their usual step. Chosen: a receiver that measures
regularly is seldom later."""
_AROUND = 3
"""Fixes on either side of a step over which the velocity is taken. Chosen: a turn is slower."""
_CLOSER = 0.5
"""Ratio of what the regular times leave of the steps' lengths to what the stamps leave, below which they hold. In
recorded logs it is 0.2 and 0.3 of regular fixes, 1.6 to 19 of 14 others with irregular stamps."""


def regular_times(time: Floats, north: Floats, east: Floats) -> Floats | None:
    """(n,) s at which fixes were measured, where their stamps step irregularly and the vessel does not; else None.

    A receiver measures at a regular interval; a logger stamps what it receives, late or to the second. Where a stamp's
    step is irregular, the displacement in it shows which of the two it is.

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
    """(n,) s by lines through the stamps around; (n − 1,) its steps, NaN over gaps; the usual step of the stamps."""
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
