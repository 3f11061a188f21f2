"""Aiding updates: one scalar measurement at a time of SOG, COG, heading, speed through water and yaw rate.

Each is a state plus, where the profile carries it, one slowly varying companion: heading = χ − crab angle, speed
through water = U − the stream along the course, yaw rate = ω_χ + the gyro's bias.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import lean_kernel
from steerway.estimation.course.model import (
    COURSE,
    CRAB_STATE,
    GYRO_STATE,
    HEADING_VARIANCE,
    RATE,
    SOG_VARIANCE,
    SPEED,
    STREAM_STATE,
    VELOCITY_EAST,
    VELOCITY_NORTH,
    VELOCITY_VARIANCE,
    WATER_SPEED_VARIANCE,
    YAW_RATE_VARIANCE,
)

SOG, COG, HEADING, WATER_SPEED, YAW_RATE = range(5)
"""Columns of the aiding table."""

SCALAR_GATE = 10.8
"""χ² with one degree of freedom at 0.1 %."""
_LOG_2PI = math.log(2.0 * math.pi)
_LARGEST_SURPRISE = 20.0
"""−2 log of the density of an outlier: one measurement in ten thousand, anywhere between −1 and 1 (SI)."""


@lean_kernel
def scalar_innovation(p, work, i, companion, sign, variance):
    """Variance of the innovation of a measurement of x[i] + sign · x[companion] (companion 0: none).

    Leaves in work[0] (n,) the covariance of the state with what is measured.
    """
    pc = work[0]
    for j in range(len(pc)):
        pc[j] = p[min(i, j), max(i, j)]
        if companion:
            pc[j] += sign * p[min(companion, j), max(companion, j)]
    return pc[i] + variance + sign * pc[companion] if companion else pc[i] + variance


@lean_kernel
def correct_scalar(x, p, work, i, companion, sign, innovation, variance, gate=SCALAR_GATE):
    """Correct by a measurement of x[i] + sign · x[companion] (companion 0: none) unless the gate refuses it.

    Joseph's form for a scalar. Returns the NIS: above SCALAR_GATE the measurement was not used.
    """
    pc, k = work[0], work[1]
    s = scalar_innovation(p, work, i, companion, sign, variance)
    return take_scalar(x, p, pc, k, s, innovation, gate)


@lean_kernel
def take_scalar(x, p, pc, k, s, innovation, gate=SCALAR_GATE):
    """Correct by a scalar with covariances pc = P hᵀ (n,) and variance s, unless the gate refuses it; k is workspace.

    Reads and writes the upper triangle of P. Returns the NIS: above the gate the measurement was not used.
    """
    n = len(x)
    nis = innovation * innovation / s
    if nis > gate:
        return nis
    for j in range(n):
        k[j] = pc[j] / s
        x[j] += k[j] * innovation
    for a in range(n):
        for b in range(a, n):
            p[a, b] += k[a] * k[b] * s - k[a] * pc[b] - pc[a] * k[b]
    return nis


@lean_kernel
def aided(which, value, x, model):
    """What an aid measures: (state, its companion or 0, the companion's sign, innovation, variance)."""
    if which == SOG:
        return SPEED, 0, 0.0, value - x[SPEED], model[SOG_VARIANCE]
    if which == COG:
        return COURSE, 0, 0.0, wrap(value - x[COURSE]), model[VELOCITY_VARIANCE] / max(x[SPEED] ** 2, 1e-4)
    if which == HEADING:
        crab = int(model[CRAB_STATE])
        expected = x[COURSE] - x[crab] if crab else x[COURSE]
        return COURSE, crab, -1.0, wrap(value - expected), model[HEADING_VARIANCE]
    if which == WATER_SPEED:
        stream = int(model[STREAM_STATE])
        expected = x[SPEED] - x[stream] if stream else x[SPEED]
        return SPEED, stream, -1.0, value - expected, model[WATER_SPEED_VARIANCE]
    gyro = int(model[GYRO_STATE])
    expected = x[RATE] + x[gyro] if gyro else x[RATE]
    return RATE, gyro, 1.0, value - expected, model[YAW_RATE_VARIANCE]


@lean_kernel
def surprise_at(squares_and_log_variance):
    """−2 log of the density of a scalar measurement, of its NIS and the logarithm of its variance together.

    One that the gate refuses surprises as much as if it were believed; none does more than an outlier.
    """
    return min(squares_and_log_variance + _LOG_2PI, _LARGEST_SURPRISE)


@lean_kernel
def aid_underway(x, p, work, aids, model):
    """Every aid that is known (not NaN), in turn. Returns the sum of their surprises."""
    surprise = 0.0
    for which in range(len(aids)):
        if math.isfinite(aids[which]):
            i, companion, sign, innovation, variance = aided(which, aids[which], x, model)
            s = scalar_innovation(p, work, i, companion, sign, variance)
            surprise += surprise_at(take_scalar(x, p, work[0], work[1], s, innovation) + math.log(s))
    return surprise


@lean_kernel
def aid_adrift(x, p, work, sog, cog, model):
    """Without a course only the receiver's whole velocity says something."""
    if math.isfinite(sog) and math.isfinite(cog):
        north, east = sog * math.cos(cog), sog * math.sin(cog)
        variance = model[VELOCITY_VARIANCE]
        correct_scalar(x, p, work, VELOCITY_NORTH, 0, 0.0, north - x[VELOCITY_NORTH], variance)
        correct_scalar(x, p, work, VELOCITY_EAST, 0, 0.0, east - x[VELOCITY_EAST], variance)
