"""Aiding updates: one scalar measurement at a time of SOG, COG, heading, speed through water and yaw rate.

Each is a state plus, where the profile carries it, one slowly varying companion: heading = χ − crab angle, speed
through water = U − the stream along the course, yaw rate = ω_χ + the gyro's bias.
"""

import math

from steerway.angles import wrap
from steerway.compiled import lean_kernel
from steerway.estimation.model import (
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

SCALAR_GATE = 10.8
"""χ² with one degree of freedom at 0.1 %."""


@lean_kernel
def correct_scalar(x, p, work, i, companion, sign, innovation, variance):
    """Correct by a measurement of x[i] + sign · x[companion] (companion 0: none) unless the gate refuses it.

    Joseph's form for a scalar. Returns the NIS: above SCALAR_GATE the measurement was not used.
    """
    n = len(x)
    pc, k = work[0], work[1]
    for j in range(n):
        pc[j] = p[min(i, j), max(i, j)]
        if companion:
            pc[j] += sign * p[min(companion, j), max(companion, j)]
    s = pc[i] + variance
    if companion:
        s += sign * pc[companion]
    return take_scalar(x, p, pc, k, s, innovation)


@lean_kernel
def take_scalar(x, p, pc, k, s, innovation):
    """Correct by a scalar with covariances pc = P hᵀ (n,) and variance s, unless the gate refuses it; k is workspace.

    Reads and writes the upper triangle of P. Returns the NIS: above SCALAR_GATE the measurement was not used.
    """
    n = len(x)
    nis = innovation * innovation / s
    if nis > SCALAR_GATE:
        return nis
    for j in range(n):
        k[j] = pc[j] / s
        x[j] += k[j] * innovation
    for a in range(n):
        for b in range(a, n):
            p[a, b] += k[a] * k[b] * s - k[a] * pc[b] - pc[a] * k[b]
    return nis


@lean_kernel
def aid_underway(x, p, work, sog, cog, heading, water_speed, yaw_rate, model):
    """Every aid that is known (not NaN), in turn."""
    if math.isfinite(sog):
        correct_scalar(x, p, work, SPEED, 0, 0.0, sog - x[SPEED], model[SOG_VARIANCE])
    if math.isfinite(cog):
        variance = model[VELOCITY_VARIANCE] / max(x[SPEED] ** 2, 1e-4)
        correct_scalar(x, p, work, COURSE, 0, 0.0, wrap(cog - x[COURSE]), variance)
    if math.isfinite(heading):
        crab = int(model[CRAB_STATE])
        expected = x[COURSE] - x[crab] if crab else x[COURSE]
        correct_scalar(x, p, work, COURSE, crab, -1.0, wrap(heading - expected), model[HEADING_VARIANCE])
    if math.isfinite(water_speed):
        stream = int(model[STREAM_STATE])
        expected = x[SPEED] - x[stream] if stream else x[SPEED]
        correct_scalar(x, p, work, SPEED, stream, -1.0, water_speed - expected, model[WATER_SPEED_VARIANCE])
    if math.isfinite(yaw_rate):
        gyro = int(model[GYRO_STATE])
        expected = x[RATE] + x[gyro] if gyro else x[RATE]
        correct_scalar(x, p, work, RATE, gyro, 1.0, yaw_rate - expected, model[YAW_RATE_VARIANCE])


@lean_kernel
def aid_adrift(x, p, work, sog, cog, model):
    """Without a course only the receiver's whole velocity says something."""
    if math.isfinite(sog) and math.isfinite(cog):
        north, east = sog * math.cos(cog), sog * math.sin(cog)
        variance = model[VELOCITY_VARIANCE]
        correct_scalar(x, p, work, VELOCITY_NORTH, 0, 0.0, north - x[VELOCITY_NORTH], variance)
        correct_scalar(x, p, work, VELOCITY_EAST, 0, 0.0, east - x[VELOCITY_EAST], variance)
