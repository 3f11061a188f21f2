"""Fixed-interval smoothing by Rauch, Tung and Striebel, AIAA Journal 3(8), 1965.

The two-filter smoother (`filter.smoother`) divides by what is known without any fix, which is exact only where the
noise does not change. This one serves where it changes at every row, and models of another kind. The backward pass
predicts each row again: only the filter state after every row is kept.
"""

from typing import NamedTuple

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.linear_algebra import factor, fill_lower, multiply, multiply_transposed, solve_rows
from steerway.estimation.filter.model import COURSE, RATE, SPEED, Bank, Model
from steerway.estimation.filter.motion import arc_of, set_rates
from steerway.estimation.filter.relative import difference, is_steady, shifted, turned, widen

_UNKNOWN = 1e12
"""Factor on a variance that leaves nothing of the later row's information, and keeps the factorisation regular."""


_RATIO = 2.0
"""Ratio of two speeds above which their velocities are compared as vectors: compared as a course, the information on
the velocity across would grow with the ratio. Chosen."""


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

    Δx = `x_excess` is the later row's smoothed state less its prediction; `p_later` is used up.
    """
    fill_lower(p)
    multiply_transposed(p, f, room.gain)
    apply_gain(p, p_next, x_excess, p_later, room)
    for i in range(len(x)):
        x[i] += room.error[i]


@called_kernel
def apply_gain(p: Floats, p_next: Floats, x_excess: Floats, p_later: Floats, room: Room) -> None:
    """P (upper triangle) and the error of x from `room.gain` = P Fᵀ, the covariance of the row and its prediction."""
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
    """Take no information of state k from the later row: of a position or a course rate that was reset there."""
    x_later[k] = x_next[k]
    p_next[k, k] *= _UNKNOWN


@called_kernel
def carry(covariance: Floats, bank: Bank, model: Model, room: Room) -> None:
    """C ← C Fᵀ, C (n, n) the covariance of any state with that of a bank of one mode, over the bank's next step."""
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
    """Smooth x (n,) and P of a row, as errors of velocity along and across the course, see `filter.model`.

    x_next, p_next: predicted from there, of which `room.gain` is the covariance with the row; later, p_later: the next
    row smoothed, in the same plane. All are used up.
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
    """Whether another state is compared with this one by speed and course, not as a vector."""
    return (
        is_steady(x[SPEED], p[SPEED, SPEED], p[COURSE, COURSE]) and 1.0 < _RATIO * other[SPEED] / x[SPEED] < _RATIO**2
    )
