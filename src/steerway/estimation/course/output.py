"""Output of a filter state: the estimate of a row, its status, and a copy for the smoother."""

import math

from steerway.core.compiled import lean_kernel
from steerway.core.earth import displaced
from steerway.core.records import NO_COURSE, OK, PREDICTED, REJECTED
from steerway.core.records import STARTING as STARTING_STATUS
from steerway.estimation.course.motion.layout import (
    COURSE,
    EAST,
    EMPTY,
    LATITUDE,
    LONGITUDE,
    LOW_SPEED,
    NORTH,
    PHASE,
    RATE,
    SPEED,
    STARTING,
    UNDER_WAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
)

OUTPUTS = 9
"""Columns of `write_output`."""


@lean_kernel
def status_of(bank, fixed, accepted):
    """Status of a row, as a code of records.STATUSES."""
    phase = bank[0, bank.shape[2] + 1, PHASE]
    if phase <= STARTING:
        return STARTING_STATUS
    if fixed and not accepted:
        return REJECTED
    if phase == LOW_SPEED:
        return NO_COURSE
    return OK if fixed else PREDICTED


@lean_kernel
def write_output(block, geodetic, out):
    """Write the estimate in a block (n + 2, n) or longer.

    Latitude and longitude (or north and east), SOG, COG, course rate, the deviations of these three, of the position.
    """
    n = block.shape[1]
    p, x, flags = block[:n], block[n], block[n + 1]
    phase = flags[PHASE]
    out[:] = math.nan
    if phase == EMPTY:
        return
    out[0], out[1] = x[NORTH], x[EAST]
    if geodetic:
        out[0], out[1] = displaced(flags[LATITUDE], flags[LONGITUDE], x[NORTH], x[EAST])
    out[8] = math.sqrt(0.5 * (p[0, 0] + p[1, 1]))
    if phase == UNDER_WAY:
        out[2], out[3], out[4] = x[SPEED], x[COURSE], x[RATE]
        out[5], out[6], out[7] = math.sqrt(p[2, 2]), math.sqrt(p[3, 3]), math.sqrt(p[4, 4])
    elif phase == LOW_SPEED:
        out[2] = math.hypot(x[VELOCITY_NORTH], x[VELOCITY_EAST])
        out[5] = math.sqrt(0.5 * (p[2, 2] + p[3, 3]))


@lean_kernel
def copy_block(block, out):
    """Copy covariance, state and flags into (n + 2, n)."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = block[i, j]
