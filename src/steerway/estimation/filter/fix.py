"""What one mode sees of a fix: what is measured, the innovation, and the correction by any pair of measurements.

A fix is the position, plus the states of the receiver's errors, plus the antenna's displacement athwart, plus white
noise.
"""

import math
from typing import NamedTuple

from steerway.core.arrays import Floats, Records
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.filter.model import COURSE, EAST, NORTH, ON_ANTENNA, ON_FIX, RATE, SPEED
from steerway.estimation.filter.relative import corrected
from steerway.estimation.filter.vectors import Sym2, Vec2, outer, plus, scaled, widened


class Seen(NamedTuple):
    """A fix as one mode sees it."""

    off: Vec2  # innovation ν, m
    s: Sym2  # its covariance where the fix is a good one, m²
    velocity: Vec2  # m/s


@called_kernel
def see(x: Floats, p: Floats, processes: Records, clock: float, fix: Vec2, variance: float, rows: Floats) -> Seen:
    """A fix (Vec2, m) of this white variance (m²) as a mode, x (n,) and p (n, n), sees it.

    clock: variance of the moment of the fix, s². rows: workspace, of which the first two (n,) are filled with the
    covariance C = P Hᵀ of state and fix.
    """
    n, c_n, c_e, h_n, h_e = len(x), rows[0], rows[1], rows[2], rows[3]
    velocity = observe(x, processes, h_n, h_e)
    off_n, off_e = fix.n - x[NORTH], fix.e - x[EAST]
    for i in range(n):
        c_n[i], c_e[i] = p[NORTH, i], p[EAST, i]
    for j in range(RATE + 1, n):
        if h_n[j] != 0.0 or h_e[j] != 0.0:
            off_n -= h_n[j] * x[j]
            off_e -= h_e[j] * x[j]
            for i in range(n):
                c_n[i] += h_n[j] * p[j, i]
                c_e[i] += h_e[j] * p[j, i]
    nn, ne, ee = c_n[NORTH], c_n[EAST], c_e[EAST]
    for j in range(RATE + 1, n):
        if h_n[j] != 0.0 or h_e[j] != 0.0:
            nn += h_n[j] * c_n[j]
            ne += h_e[j] * c_n[j]
            ee += h_e[j] * c_e[j]
    s = plus(Sym2(nn, ne, ee), scaled(clock, outer(velocity)))
    return Seen(Vec2(off_n, off_e), widened(s, variance), velocity)


@lean_kernel
def observe(x: Floats, processes: Records, h_n: Floats, h_e: Floats) -> Vec2:
    """Fill H, what a fix measures north and east of a state (n,), behind the rate. Returns the velocity (Vec2)."""
    c, s = math.cos(x[COURSE]), math.sin(x[COURSE])
    velocity = Vec2(x[SPEED] * c, x[SPEED] * s)
    for j in range(RATE + 1, len(x)):
        h_n[j] = h_e[j] = 0.0
    for f in range(len(processes)):
        j, acts_on = processes[f].state, processes[f].acts_on
        if acts_on == ON_FIX:
            h_n[j] = h_e[j + 1] = 1.0
        elif acts_on == ON_ANTENNA:
            h_n[j], h_e[j] = -s, c
    return velocity


@called_kernel
def correct(x: Floats, p: Floats, rows: Floats, m: Sym2, s: Vec2, alone: bool) -> None:
    """Correct a mode by a fix: x ← x + C s and P ← P − C M Cᵀ (Vec2, Sym2), with C in the first two `rows`.

    alone: see `relative.corrected`.
    """
    n, c_n, c_e, error = len(x), rows[0], rows[1], rows[2]
    for i in range(n):
        error[i] = c_n[i] * s.n + c_e[i] * s.e
    for i in range(n):
        a, b = c_n[i] * m.nn + c_e[i] * m.ne, c_n[i] * m.ne + c_e[i] * m.ee
        for j in range(n):
            p[i, j] -= a * c_n[j] + b * c_e[j]
    corrected(x, p, error, alone)
