"""Fixed-interval smoothing (Rauch, Tung and Striebel, AIAA Journal 3(8), 1965) of a filtered record.

The backward pass predicts each filtered row again, so nothing but the filter's memory after every row need be kept.
Between rows on either side of a change of way, what the later row says is carried over into the earlier row's
coordinates to first order around the prediction.
"""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.compiled import kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.linear_algebra import factor, fill_lower, multiply, multiply_transposed, solve_rows
from steerway.estimation.course.acceleration import shares
from steerway.estimation.course.five_state import chord, set_step
from steerway.estimation.course.model import (
    ACCELERATION_STATE,
    COURSE,
    DT,
    EAST,
    EMPTY,
    FIRST,
    LATITUDE,
    LEFT,
    LONGITUDE,
    MODE,
    NORTH,
    RATE,
    RATE_LEFT,
    RETRIES,
    SPEED,
    SPEED_INTEGRAL,
    SPEED_LEFT,
    TURN,
    UNDERWAY,
    YAWING_STATE,
)
from steerway.estimation.course.tracking import speak
from steerway.estimation.course.way import fold, mix_velocity, predict_adrift
from steerway.estimation.course.yawing import predict_underway, pushes, yaw_transition


@lean_kernel
def transition(x, underway, step, model, f):
    """F of one prediction over a step from state x, (n, n)."""
    n = len(x)
    f[:] = 0.0
    for j in range(n):
        f[j, j] = 1.0
    for j in range(5, n):
        f[j, j] = step[LEFT, j]
    if step[DT] == 0.0:
        return
    if underway:
        a = int(model[ACCELERATION_STATE])
        lent, rest = shares(step, model) if a else (0.0, 0.0)
        speed = x[SPEED] + lent * x[a] if a else x[SPEED]
        d = int(model[YAWING_STATE])
        push, left = pushes(step, model) if d else (0.0, 0.0)
        rate = x[RATE] + push * x[d] if d else x[RATE]
        _, _, north, east, north_u, east_u, north_w, east_w = chord(speed, x[COURSE], rate, step)
        f[0, 2], f[0, 3], f[0, 4] = north_u, -east, north_w
        f[1, 2], f[1, 3], f[1, 4] = east_u, north, east_w
        f[2, 2], f[3, 4], f[4, 4] = step[SPEED_LEFT], step[TURN], step[RATE_LEFT]
        if a:
            for i in range(3):
                f[i, a] += lent * f[i, 2]
            f[2, a] += rest * f[a, a]
        if d:
            yaw_transition(f, push, left, d)
    else:
        f[0, 2] = f[1, 3] = step[SPEED_INTEGRAL]
        f[2, 2] = f[3, 3] = step[SPEED_LEFT]


@lean_kernel
def carry_over(x, p, mode, x_predicted, p_predicted, predicted_mode, model):
    """Express the later row's smoothed (x, P) in the coordinates of its prediction, in place."""
    if (mode == UNDERWAY) == (predicted_mode == UNDERWAY):
        return
    if predicted_mode == UNDERWAY:
        speed, c, s = max(x_predicted[SPEED], 1e-3), math.cos(x_predicted[COURSE]), math.sin(x_predicted[COURSE])
        north, east = x[2] - x_predicted[SPEED] * c, x[3] - x_predicted[SPEED] * s
        x[SPEED] = x_predicted[SPEED] + c * north + s * east
        x[COURSE] = x_predicted[COURSE] + (c * east - s * north) / speed
        mix_velocity(p, c, s, -s / speed, c / speed)
    else:
        speed, c, s = x[SPEED], math.cos(x[COURSE]), math.sin(x[COURSE])
        x[2], x[3] = speed * c, speed * s
        mix_velocity(p, c, -speed * s, s, speed * c)
    ignore(RATE, x, x_predicted, p_predicted)
    for k in (int(model[ACCELERATION_STATE]), int(model[YAWING_STATE])):
        if k:
            ignore(k, x, x_predicted, p_predicted)


@kernel
def smooth(time, geodetic, model, kept, spoken):
    """Backward pass: smooths `kept` in place and states `spoken` (n, SPOKEN) anew.

    Args:
        time: (n,) s, spaced by no more than the longest step except where the filter began anew.
        kept: (n, states + 2, states) covariance, state and bookkeeping of the filter after every row.
    """
    n = kept.shape[2]
    f = np.empty((n, n))
    gain = np.empty((n, n))
    lower = np.empty((n, n))
    product = np.empty((n, n))
    scale = np.empty(n)
    x_later, p_later = np.empty(n), np.empty((n, n))
    x_next, p_next = np.empty(n), np.empty((n, n))
    later_mode = EMPTY
    step = np.zeros((3, n))
    step[DT] = -1.0
    for k in range(len(time) - 1, -1, -1):
        x, p, book = kept[k, n], kept[k, :n], kept[k, n + 1]
        mode = book[MODE]
        if later_mode != EMPTY and mode != EMPTY and not begun_anew(kept[k], kept[k + 1]):
            dt = time[k + 1] - time[k]
            if dt != step[DT]:
                set_step(step, dt, model)
            transition(x, mode == UNDERWAY, step, model, f)
            x_next[:], p_next[:] = x, p
            if mode == UNDERWAY:
                predict_underway(x_next, p_next, step, model)
            else:
                predict_adrift(x_next, p_next, step, model)
            carry_over(x_later, p_later, later_mode, x_next, p_next, mode, model)
            if geodetic:
                later = kept[k + 1, n + 1]
                north, east = displacement(later[LATITUDE], later[LONGITUDE], book[LATITUDE], book[LONGITUDE])
                x_later[NORTH] += north
                x_later[EAST] += east
            if kept[k + 1, n + 1, RETRIES] > book[RETRIES]:
                ignore(NORTH, x_later, x_next, p_next)
                ignore(EAST, x_later, x_next, p_next)
            for i in range(n):
                x_later[i] -= x_next[i]
            if mode == UNDERWAY:
                x_later[COURSE] = wrap(x_later[COURSE])
            smoothing_step(x, p, f, p_next, x_later, p_later, gain, lower, product, scale)
            if mode == UNDERWAY:
                fold(x, p)
        x_later[:], p_later[:], later_mode = x, p, mode
        if mode != EMPTY:
            speak(kept[k], geodetic, spoken[k])


@lean_kernel
def smoothing_step(x, p, f, p_next, x_excess, p_later, gain, lower, product, scale):
    """One step of Rauch, Tung and Striebel in place: G = P Fᵀ P⁻(k+1)⁻¹, x += G Δx, P += G (P(k+1) − P⁻(k+1)) Gᵀ.

    Δx = `x_excess` is the later row's smoothed state less its prediction; `p_later` is used up, and so are the last
    four, workspace of (n, n), (n, n), (n, n) and (n,).
    """
    n = len(x)
    fill_lower(p)
    multiply_transposed(p, f, gain)
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
def begun_anew(earlier, later):
    """Whether the filter forgot everything between two rows."""
    n = earlier.shape[1]
    return later[n + 1, MODE] == FIRST and earlier[n + 1, MODE] != FIRST


@lean_kernel
def ignore(k, x_later, x_next, p_next):
    """Let the later row tell nothing of state k: where a position was taken anew, or a course rate forgotten."""
    x_later[k] = x_next[k]
    p_next[k, k] *= 1e12
