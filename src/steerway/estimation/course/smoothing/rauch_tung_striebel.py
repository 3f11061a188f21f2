"""Fixed-interval smoothing (Rauch, Tung and Striebel, AIAA Journal 3(8), 1965) of a filtered record.

The backward pass predicts each filtered row again, so that only the filter state after every row is kept. Between rows
on either side of a change of phase the later row is expressed in the earlier row's coordinates, to first order around
the prediction.
"""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.linear_algebra import factor, fill_lower, multiply, multiply_transposed, solve_rows
from steerway.estimation.course.motion.layout import (
    COURSE,
    DT,
    EAST,
    EMPTY,
    FIRST,
    LATITUDE,
    LONGEST_STEP,
    LONGITUDE,
    MOTION_STATES,
    NORTH,
    PHASE,
    RATE,
    RESETS,
    SPEED,
    STEP_ROWS,
    UNDER_WAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
)
from steerway.estimation.course.motion.models import (
    LEAST_SPEED,
    change_velocity,
    may_lose_course,
    parts_of,
    predict_phase,
    set_step,
)
from steerway.estimation.course.output import write_output
from steerway.estimation.course.steerageway import fold, transform_velocity

FIRST_ROW = np.zeros(0, np.int64)
"""For `smooth`: all by the first row of the parameters."""
_UNKNOWN = 1e12
"""Factor on a variance that leaves nothing of the later row's information, and keeps the factorisation regular."""


@called_kernel
def change_coordinates(x, p, phase, x_predicted, p_predicted, predicted_phase, parameters):
    """Express the later row's smoothed (x, P) in the coordinates of its prediction, in place."""
    if (phase == UNDER_WAY) == (predicted_phase == UNDER_WAY):
        return
    if predicted_phase == UNDER_WAY:
        speed, c, s = (
            max(x_predicted[SPEED], LEAST_SPEED),
            math.cos(x_predicted[COURSE]),
            math.sin(x_predicted[COURSE]),
        )
        north, east = x[VELOCITY_NORTH] - x_predicted[SPEED] * c, x[VELOCITY_EAST] - x_predicted[SPEED] * s
        x[SPEED] = x_predicted[SPEED] + c * north + s * east
        x[COURSE] = x_predicted[COURSE] + (c * east - s * north) / speed
        transform_velocity(p, c, s, -s / speed, c / speed)
    else:
        speed, c, s = x[SPEED], math.cos(x[COURSE]), math.sin(x[COURSE])
        x[VELOCITY_NORTH], x[VELOCITY_EAST] = speed * c, speed * s
        transform_velocity(p, c, -speed * s, s, speed * c)
    ignore(RATE, x, x_predicted, p_predicted)
    for k in range(int(parameters[MOTION_STATES]), len(x)):
        ignore(k, x, x_predicted, p_predicted)


@kernel
def smooth(time, geodetic, parameters, row_of, kept, output):
    """Backward pass: smooths `kept` in place and writes `output` (n, OUTPUTS) anew.

    Args:
        time: (n,) s, with rows wherever the course may become undefined between fixes, see `must_divide`.
        parameters: (any, k). row_of: (n,) by which of them each row of the record was predicted, or FIRST_ROW.
        kept: (n, states + 2, states) covariance, state and flags of the filter after every row.
    """
    n = kept.shape[2]
    gain, lower, product = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    scale = np.empty(n)
    x_later, p_later = np.empty(n), np.empty((n, n))
    x_next, p_next = np.empty(n), np.empty((n, 2 * n))
    later_phase, row = EMPTY, -1
    step = np.zeros((STEP_ROWS, n))
    for k in range(len(time) - 1, -1, -1):
        x, p, flags = kept[k, n], kept[k, :n], kept[k, n + 1]
        phase = flags[PHASE]
        if later_phase != EMPTY and phase != EMPTY and not started_anew(kept[k], kept[k + 1]):
            dt, this = time[k + 1] - time[k], row_of[k + 1] if len(row_of) else 0
            fill_lower(p)
            for i in range(n):
                x_next[i] = x[i]
                for j in range(n):
                    p_next[i, j] = p_next[i, n + j] = p[i, j]
            parts = 1
            if dt > 0.0:
                change_velocity(x_next, p_next, phase == UNDER_WAY, parameters[this])
                parts = parts_of(x_next, p_next, phase == UNDER_WAY, dt, parameters[this])
            if dt / parts != step[DT] or this != row:
                set_step(step, dt / parts, parameters[this])
                row = this
            for _ in range(parts):
                predict_phase(x_next, p_next, phase == UNDER_WAY, step, parameters[this])
            for i in range(n):
                for j in range(n):
                    gain[j, i] = p_next[i, n + j]
            change_coordinates(x_later, p_later, later_phase, x_next, p_next, phase, parameters[this])
            if geodetic:
                later = kept[k + 1, n + 1]
                north, east = displacement(later[LATITUDE], later[LONGITUDE], flags[LATITUDE], flags[LONGITUDE])
                x_later[NORTH] += north
                x_later[EAST] += east
            if kept[k + 1, n + 1, RESETS] > flags[RESETS]:
                ignore(NORTH, x_later, x_next, p_next)
                ignore(EAST, x_later, x_next, p_next)
            for i in range(n):
                x_later[i] -= x_next[i]
            if phase == UNDER_WAY:
                x_later[COURSE] = wrap(x_later[COURSE])
            apply_gain(x, p, gain, p_next, x_later, p_later, lower, product, scale)
            if phase == UNDER_WAY:
                fold(x, p)
        x_later[:], p_later[:], later_phase = x, p, phase
        if phase != EMPTY:
            write_output(kept[k], geodetic, output[k])


@kernel
def must_divide(time, parameters, kept):
    """(n,) bool: whether the course may become undefined before the next row, which `smooth` cannot cross."""
    found = np.zeros(len(time), np.bool_)
    n = kept.shape[2]
    for k in range(len(time) - 1):
        dt = time[k + 1] - time[k]
        under_way = kept[k, n + 1, PHASE] == UNDER_WAY and not started_anew(kept[k], kept[k + 1])
        found[k] = under_way and dt > parameters[LONGEST_STEP] and may_lose_course(kept[k, :n], dt, parameters)
    return found


@lean_kernel
def smoothing_step(
    x: Floats,
    p: Floats,
    f: Floats,
    p_next: Floats,
    x_excess: Floats,
    p_later: Floats,
    gain: Floats,
    lower: Floats,
    product: Floats,
    scale: Floats,
) -> None:
    """One step of Rauch, Tung and Striebel in place: G = P Fᵀ P⁻(k+1)⁻¹, x += G Δx, P += G (P(k+1) − P⁻(k+1)) Gᵀ.

    Δx = `x_excess` is the later row's smoothed state less its prediction; `p_later` is used up, and so are the last
    four, workspace of (n, n), (n, n), (n, n) and (n,).
    """
    fill_lower(p)
    multiply_transposed(p, f, gain)
    apply_gain(x, p, gain, p_next, x_excess, p_later, lower, product, scale)


@called_kernel
def apply_gain(x, p, gain, p_next, x_excess, p_later, lower, product, scale):
    """The same from `gain` = P Fᵀ (n, n), the covariance of the earlier row with its prediction."""
    n = len(x)
    factor(p_next, scale, lower)
    solve_rows(lower, scale, gain)
    for i in range(n):
        for j in range(i, n):
            p_later[i, j] -= p_next[i, j]
    fill_lower(p_later)
    multiply(gain, p_later, product)
    for i in range(n):
        for j in range(n):
            x[i] += gain[i, j] * x_excess[j]
        for j in range(i, n):
            for m in range(n):
                p[i, j] += product[i, m] * gain[j, m]


@lean_kernel
def started_anew(earlier, later):
    """Whether the filter was reset between two rows."""
    n = earlier.shape[1]
    return later[n + 1, PHASE] == FIRST and earlier[n + 1, PHASE] != FIRST


@lean_kernel
def ignore(k, x_later, x_next, p_next):
    """Take no information of state k from the later row: of a position or a course rate that was reset there."""
    x_later[k] = x_next[k]
    p_next[k, k] *= _UNKNOWN
