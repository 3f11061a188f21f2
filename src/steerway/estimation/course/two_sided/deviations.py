"""Deviations from a trajectory near the truth: they move linearly, and so do the instruments see them.

The trajectory is what `smoothing` makes of a record, `kept` (rows, n + 2, n) of state, covariance and bookkeeping. A
deviation is less than a radian and less than the earth's curvature shows, so that angles need no wrapping and the
tangent planes of the rows no reckoning but here.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import lean_kernel
from steerway.core.earth import displacement
from steerway.estimation.course.model import (
    COURSE,
    EAST,
    ERROR_PAIRS,
    ERROR_STATE,
    LATITUDE,
    LONGITUDE,
    NORTH,
    POSITION_VARIANCE,
    RETRIES,
)
from steerway.estimation.course.smoothing import transition
from steerway.estimation.course.yawing import predict_underway

FIX, PLACE_LOST = 5, 6
"""Columns of what was believed in a row, behind those of the aids: its fix; that the position began anew with it."""
BELIEFS = 7
_ANYWHERE = 1e8
"""m²: of a position of which nothing is known."""


@lean_kernel
def linearise(kept, k, geodetic, step, model, f, offset, q):
    """A step from row k: a deviation d becomes f d + offset, give or take what has the covariance q (upper triangle).

    Linearised around the trajectory of row k, where the step begins.
    """
    n = kept.shape[2]
    x, later, book = kept[k, n], kept[k + 1, n], kept[k, n + 1]
    transition(x, True, step, model, f)
    for i in range(n):
        offset[i] = x[i]
        for j in range(n):
            q[i, j] = 0.0
    predict_underway(offset, q, step, model)
    if geodetic:
        origin = kept[k + 1, n + 1]
        north, east = displacement(book[LATITUDE], book[LONGITUDE], origin[LATITUDE], origin[LONGITUDE])
        offset[NORTH] += north
        offset[EAST] += east
    for i in range(n):
        offset[i] -= later[i]
    offset[COURSE] = wrap(offset[COURSE])


@lean_kernel
def lose_place(p):
    """Add to a covariance what is not known of the position where it is taken anew."""
    p[NORTH, NORTH] += _ANYWHERE
    p[EAST, EAST] += _ANYWHERE


@lean_kernel
def taken_anew(kept, k):
    """Whether the filter took its position anew from the fix of row k, after unbroken rejections."""
    n = kept.shape[2]
    return kept[k, n + 1, RETRIES] > kept[k - 1, n + 1, RETRIES]


@lean_kernel
def fix_of(record, k, kept, model):
    """(north, east, variance) of the fix of row k as a deviation, m and m²; the variance of no fix is infinite."""
    _, first, second, doubts, _, geodetic = record
    if not math.isfinite(first[k]) or not math.isfinite(second[k]):
        return 0.0, 0.0, math.inf
    n = kept.shape[2]
    x, book = kept[k, n], kept[k, n + 1]
    north, east = first[k], second[k]
    if geodetic:
        north, east = displacement(north, east, book[LATITUDE], book[LONGITUDE])
    north -= x[NORTH]
    east -= x[EAST]
    g = int(model[ERROR_STATE])
    if g:
        for i in range(g, g + 2 * int(model[ERROR_PAIRS]), 2):
            north -= x[i]
            east -= x[i + 1]
    return north, east, model[POSITION_VARIANCE] * (doubts[k] if len(doubts) else 1.0)
