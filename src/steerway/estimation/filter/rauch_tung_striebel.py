"""Fixed-interval smoothing by Rauch, Tung and Striebel, AIAA Journal 3(8), 1965.

The two-filter smoother (`filter.smoother`) divides by the prior of the states, which is exact only for constant noise.
This smoother is for noise that changes at every row, and for other kinds of model. Its backward pass predicts every row
again, so that only the filtered state after every row is kept.
"""

from typing import NamedTuple

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.linear_algebra import factor, fill_lower, multiply, multiply_transposed, solve_rows
from steerway.estimation.filter.model import COURSE, RATE, SPEED, Bank, Model
from steerway.estimation.filter.motion import arc_of, set_rates
from steerway.estimation.filter.relative import difference, is_steady, shifted, turned, widen

_UNKNOWN = 1e12
"""Factor on a variance that removes the information of the later row, and keeps the factorisation regular."""
_RATIO = 2.0
"""Ratio of two speeds above which their velocities are compared as vectors. In a comparison of courses, the information
on the velocity across the course would grow with the ratio."""


class Room(NamedTuple):
    """Workspace for n states."""

    gain: Floats  # (n, n)
    lower: Floats  # (n, n)
    product: Floats  # (n, n)
    scale: Floats  # (n,)
    error: Floats  # (n,)
    rates: Floats  # (4, n)


@lean_kernel
def smoothing_step(
    x: Floats, p: Floats, f: Floats, p_next: Floats, x_excess: Floats, p_later: Floats, room: Room
) -> None:
    """One step in place, with upper triangles: G = P Fᵀ P⁻(k+1)⁻¹, x += G Δx, P += G (P(k+1) − P⁻(k+1)) Gᵀ.

    Δx = `x_excess` is the smoothed state of the later row less its prediction. `p_later` is overwritten.
    """
    fill_lower(p)
    multiply_transposed(p, f, room.gain)
    apply_gain(p, p_next, x_excess, p_later, room)
    for i in range(len(x)):
        x[i] += room.error[i]


@called_kernel
def apply_gain(p: Floats, p_next: Floats, x_excess: Floats, p_later: Floats, room: Room) -> None:
    """Smooth P (upper triangle) and write the correction of x into `room.error`, from `room.gain` = P Fᵀ."""
    n, gain = len(p), room.gain
    factor(p_next, room.scale, room.lower)
    solve_rows(room.lower, room.scale, gain)
    for i in range(n):
        for j in range(i, n):
            p_later[i, j] -= p_next[i, j]
    fill_lower(p_later)
    multiply(gain, p_later, room.product)
    for i in range(n):
        room.error[i] = 0.0
        for j in range(n):
            room.error[i] += gain[i, j] * x_excess[j]
        for j in range(i, n):
            for m in range(n):
                p[i, j] += room.product[i, m] * gain[j, m]


@lean_kernel
def ignore(k: int, x_later: Floats, x_next: Floats, p_next: Floats) -> None:
    """Use no information on state k (a position or the course rate) from the later row, at which it was reset."""
    x_later[k] = x_next[k]
    p_next[k, k] *= _UNKNOWN


@called_kernel
def carry(covariance: Floats, bank: Bank, model: Model, room: Room) -> None:
    """C ← C Fᵀ over the next step of a bank of one mode; C (n, n): covariance of an earlier state with the present."""
    x, responses, rates = bank.x[0], bank.responses[0], room.rates
    arc = arc_of(x, responses, bank.steps[0], model.driving)
    set_rates(rates, x[SPEED], arc, responses, bank.steps[0], model.driving)
    n = len(x)
    for i in range(n):
        row, moved = covariance[i], room.error
        for a in range(4):
            moved[a] = 0.0
            for j in range(SPEED, model.driving):
                moved[a] += rates[a, j] * row[j]
        for a in range(4):
            row[a] += moved[a]
        for j in range(RATE, n):
            left, spun = responses[j].left, responses[j].spun
            if spun != 0.0:
                row[j], row[j + 1] = left * row[j] - spun * row[j + 1], spun * row[j] + left * row[j + 1]
            elif responses[j - 1].spun == 0.0:
                row[j] *= left


@called_kernel
def smooth_row(
    x: Floats, p: Floats, x_next: Floats, p_next: Floats, later: Floats, p_later: Floats, room: Room
) -> None:
    """Smooth x (n,) and P of a row in place; for the error that P belongs to see `filter.model`.

    x_next, p_next: prediction of the next row. room.gain: covariance of the row with this prediction. later, p_later:
    the next row smoothed. `p_later` and the workspace are overwritten.
    """
    origin, error, excess = room.rates[0], room.error, room.rates[1]
    steady = are_compared_by_course(x_next, p_next, later)
    turned(p_later, difference(later, x_next, steady, excess))
    if steady:
        widen(p_later, x_next[SPEED] / later[SPEED])
    for i in range(len(x)):
        origin[i] = x[i]
    known = is_steady(x[SPEED], p[SPEED, SPEED], p[COURSE, COURSE])
    apply_gain(p, p_next, excess, p_later, room)
    fill_lower(p)
    known = known and 1.0 < _RATIO * (origin[SPEED] + error[SPEED]) / origin[SPEED] < _RATIO**2
    shifted(origin, error, known, x, p)
    if known:
        widen(p, x[SPEED] / origin[SPEED])


@lean_kernel
def are_compared_by_course(x: Floats, p: Floats, other: Floats) -> bool:
    """Whether the velocity of another state is compared with this one by speed and course, not as a vector."""
    return (
        is_steady(x[SPEED], p[SPEED, SPEED], p[COURSE, COURSE]) and 1.0 < _RATIO * other[SPEED] / x[SPEED] < _RATIO**2
    )
