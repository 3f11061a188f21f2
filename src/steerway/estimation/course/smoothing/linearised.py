"""The problem linearised around a trajectory near the truth: deviations move and are measured linearly.

The trajectory is that of the plain smoother, `kept` (rows, n + 2, n) of covariance, state and flags. Deviations are
small: less than a radian, and too short for the curvature of the earth, so that angles are wrapped and tangent planes
changed only here.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.kalman import innovation
from steerway.estimation.course.motion.layout import (
    COURSE,
    EAST,
    ERROR_PAIRS,
    ERROR_STATE,
    LATITUDE,
    LONGITUDE,
    NORTH,
    POSITION_VARIANCE,
    RESETS,
    SPEED,
    TIME_VARIANCE,
)
from steerway.estimation.course.motion.models import linearise as linearise_motion
from steerway.estimation.vessel.aids import AIDS

FIX, POSITION_RESET = len(AIDS), len(AIDS) + 1
"""Columns of what is accepted in a row, after those of the aids: its fix; that the position was reset to it."""
ROW_FLAGS = len(AIDS) + 2
_ANYWHERE = 1e8
"""m²: a variance beside which what was known of a position does not count: 10 km."""


@called_kernel
def linearise(kept, k, geodetic, step, parameters, both, f, offset, q):
    """A step from row k: a deviation d becomes f d + offset + w, where w has the covariance q (upper triangle).

    Linearised around the trajectory of row k, where the step starts. both: (n, 2n), workspace.
    """
    n = kept.shape[2]
    x, later, flags = kept[k, n], kept[k + 1, n], kept[k, n + 1]
    for i in range(n):
        offset[i] = x[i]
    linearise_motion(offset, both, True, step, parameters)
    for i in range(n):
        for j in range(n):
            q[i, j], f[i, j] = both[i, j], both[i, n + j]
    if geodetic:
        origin = kept[k + 1, n + 1]
        north, east = displacement(flags[LATITUDE], flags[LONGITUDE], origin[LATITUDE], origin[LONGITUDE])
        offset[NORTH] += north
        offset[EAST] += east
    for i in range(n):
        offset[i] -= later[i]
    offset[COURSE] = wrap(offset[COURSE])


@lean_kernel
def forget_position(p):
    """Make the position of a covariance diffuse."""
    p[NORTH, NORTH] += _ANYWHERE
    p[EAST, EAST] += _ANYWHERE


@lean_kernel
def was_reset(kept, k):
    """Whether the filter reset its position to the fix of row k, after unbroken rejections."""
    n = kept.shape[2]
    return kept[k, n + 1, RESETS] > kept[k - 1, n + 1, RESETS]


@called_kernel
def fix_of(record, k, kept, parameters):
    """(north, east, variance, way north, way east) of the fix of row k: a deviation (m), its variance (m²; of no fix
    infinite), and what the vessel sails in the deviation of its time (m)."""
    _, first, second, variance_scales, _, geodetic = record
    if not math.isfinite(first[k]) or not math.isfinite(second[k]):
        return 0.0, 0.0, math.inf, 0.0, 0.0
    n = kept.shape[2]
    x, flags = kept[k, n], kept[k, n + 1]
    north, east = first[k], second[k]
    if geodetic:
        north, east = displacement(north, east, flags[LATITUDE], flags[LONGITUDE])
    north -= x[NORTH]
    east -= x[EAST]
    g = int(parameters[ERROR_STATE])
    if g:
        for i in range(g, g + 2 * int(parameters[ERROR_PAIRS]), 2):
            north -= x[i]
            east -= x[i + 1]
    variance = parameters[POSITION_VARIANCE] * (variance_scales[k] if len(variance_scales) else 1.0)
    way = math.sqrt(parameters[TIME_VARIANCE]) * x[SPEED]
    return north, east, variance, way * math.cos(x[COURSE]), way * math.sin(x[COURSE])


@lean_kernel
def fix_innovation(d, p, fix, g, pairs):
    """`innovation` of a fix of `fix_of`, whose time is uncertain too."""
    north, east, variance, way_n, way_e = fix
    nu_n, nu_e, s_nn, s_ne, s_ee = innovation(d, p, north, east, variance, variance, g, pairs)
    return nu_n, nu_e, s_nn + way_n * way_n, s_ne + way_n * way_e, s_ee + way_e * way_e
