"""A fix in one mode: its Jacobian, its innovation, and the correction of the mode.

A fix measures the position, plus the receiver's errors, the displacement of the antenna athwart and white noise.
"""

import math
from typing import NamedTuple

from steerway.core.arrays import Floats, Records
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.filter.model import COURSE, EAST, NORTH, ON_ANTENNA, ON_FIX, RATE, SPEED
from steerway.estimation.filter.relative import corrected
from steerway.estimation.filter.vectors import Sym2, Vec2, outer, plus, scaled, widened


class Seen(NamedTuple):
    """A fix compared with the prediction of one mode."""

    off: Vec2  # innovation ν, m
    s: Sym2  # its covariance S for a good fix, m²
    velocity: Vec2  # of the vessel, m/s


@called_kernel
def see(x: Floats, p: Floats, processes: Records, clock: float, fix: Vec2, variance: float, rows: Floats) -> Seen:
    """Compare a fix (m) of white noise of this variance (m²) with a mode, x (n,) and p (n, n).

    clock: variance of the time of the fix, s². rows: workspace (≥ 4, n), whose first two rows receive the covariance
    C = P Hᵀ of the state with the fix north and east.
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
    """Fill the Jacobian H of a fix north and east for the states behind the rate. Returns the velocity (m/s)."""
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
    """Correct a mode by a fix: x ← x + C s and P ← P − C M Cᵀ, with C of `see` in `rows`; alone: see `corrected`."""
    n, c_n, c_e, error = len(x), rows[0], rows[1], rows[2]
    for i in range(n):
        error[i] = c_n[i] * s.n + c_e[i] * s.e
    for i in range(n):
        a, b = c_n[i] * m.nn + c_e[i] * m.ne, c_n[i] * m.ne + c_e[i] * m.ee
        for j in range(n):
            p[i, j] -= a * c_n[j] + b * c_e[j]
    corrected(x, p, error, alone)
