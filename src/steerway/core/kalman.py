"""The Kalman update by a scalar and by a position, for all filters of this package except those with several modes.

Filters that use positions have north and east as their first two states. A fix may have coloured noise besides white
noise, such as wave motion: its north and east parts are the states g and g + 1; g = 0 means no such errors. The kernels
read and write the upper triangle of a covariance.
"""

import math
from typing import NamedTuple

from steerway.core.arrays import Floats
from steerway.core.compiled import lean_kernel
from steerway.core.statistics import AID_GATE


class Fix(NamedTuple):
    """A position and the variances of its white noise, m and m²."""

    north: float
    east: float
    north_variance: float
    east_variance: float


class Innovation(NamedTuple):
    """Innovation of a fix, m, and its covariance, m²."""

    north: float
    east: float
    nn: float
    ne: float
    ee: float


@lean_kernel
def innovation(x: Floats, p: Floats, fix: Fix, g: int) -> Innovation:
    """The innovation of a fix, and its covariance."""
    north, east = fix.north - x[0], fix.east - x[1]
    nn, ne, ee = p[0, 0] + fix.north_variance, p[0, 1], p[1, 1] + fix.east_variance
    if g:
        north -= x[g]
        east -= x[g + 1]
        nn += 2.0 * p[0, g] + p[g, g]
        ne += p[0, g + 1] + p[1, g] + p[g, g + 1]
        ee += 2.0 * p[1, g + 1] + p[g + 1, g + 1]
    return Innovation(north, east, nn, ne, ee)


@lean_kernel
def normalised_square(seen: Innovation) -> float:
    """NIS of a fix, νᵀ S⁻¹ ν."""
    square = seen.north * seen.north * seen.ee + seen.east * seen.east * seen.nn
    return (square - 2.0 * seen.north * seen.east * seen.ne) / (seen.nn * seen.ee - seen.ne * seen.ne)


@lean_kernel
def correct(x: Floats, p: Floats, work: Floats, fix: Fix, g: int) -> None:
    """Correct by a fix, one axis after the other: their white noise is uncorrelated. work: (2, n) or more."""
    other = g + 1 if g else 0
    correct_scalar(x, p, work, 0, g, 1.0, fix.north - x[0] - (x[g] if g else 0.0), fix.north_variance, math.inf)
    correct_scalar(x, p, work, 1, other, 1.0, fix.east - x[1] - (x[other] if g else 0.0), fix.east_variance, math.inf)


@lean_kernel
def place_by_fix(p: Floats, fix: Fix, g: int) -> None:
    """Set the covariance of a position that was set to a fix minus the error states.

    The position's error is the white noise minus the errors of the error states. Its covariance with every other state
    is therefore minus that of the error states; with any other value P would not be positive semidefinite.
    """
    n = p.shape[1]
    for k in range(2):
        for i in range(2, n):
            p[k, i] = -p[min(g + k, i), max(g + k, i)] if g else 0.0
    p[0, 0] = fix.north_variance + (p[g, g] if g else 0.0)
    p[0, 1] = p[g, g + 1] if g else 0.0
    p[1, 1] = fix.east_variance + (p[g + 1, g + 1] if g else 0.0)


@lean_kernel
def scalar_innovation(p: Floats, work: Floats, i: int, companion: int, sign: float, variance: float) -> float:
    """Variance of the innovation of a measurement of x[i] + sign · x[companion] (companion 0: none).

    Stores in work[0] (n,) the covariance of the state with the measured quantity.
    """
    pc = work[0]
    for j in range(len(pc)):
        pc[j] = p[min(i, j), max(i, j)]
        if companion:
            pc[j] += sign * p[min(companion, j), max(companion, j)]
    return pc[i] + variance + sign * pc[companion] if companion else pc[i] + variance


@lean_kernel
def correct_scalar(
    x: Floats,
    p: Floats,
    work: Floats,
    i: int,
    companion: int,
    sign: float,
    innovation: float,
    variance: float,
    gate: float = AID_GATE,
) -> float:
    """Correct by a measurement of x[i] + sign · x[companion] (companion 0: none) unless the gate refuses it.

    Joseph's form for a scalar. Returns the NIS: above the gate the measurement was not used.
    """
    pc, k = work[0], work[1]
    s = scalar_innovation(p, work, i, companion, sign, variance)
    return take_scalar(x, p, pc, k, s, innovation, gate)


@lean_kernel
def take_scalar(
    x: Floats, p: Floats, pc: Floats, k: Floats, s: float, innovation: float, gate: float = AID_GATE
) -> float:
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
