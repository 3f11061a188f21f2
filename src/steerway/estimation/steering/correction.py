"""Corrections of the states of `motion` by a position, a velocity over ground, a heading."""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.steering.motion import (
    CURRENT_E,
    CURRENT_N,
    EAST,
    ERROR_E,
    ERROR_N,
    GAIN,
    HEADING,
    NORTH,
    SPEED_GAIN,
    STATES,
    WATER_SPEED,
    YAW_RATE,
)

OUTLIER = math.log(0.01 / (2.0 * math.pi * 30.0**2))
"""Logarithm of the density of a wrong fix: one in a hundred, within some 30 m."""
MANOEUVRE = math.log(0.05)
"""That of a motion that no order explains, where the response does not fit."""
_LARGEST_GAIN = 2.5
"""Of a response over the declared one, and the inverse of the least."""
_ASTERN = 2.0
"""Standard deviations from which on a speed through the water is one astern."""
GOOD, MANOEUVRED, REFUSED = range(3)


@lean_kernel
def _correct_scalar(x, p, h, residual, variance, gain):
    """Kalman's correction by one number z = h x + noise, in place; gain (13,) is scratch."""
    spread = variance
    for i in range(STATES):
        total = 0.0
        for j in range(STATES):
            total += p[i, j] * h[j]
        gain[i] = total
    for i in range(STATES):
        spread += h[i] * gain[i]
    for i in range(STATES):
        for j in range(i, STATES):
            p[i, j] -= gain[i] * gain[j] / spread
            p[j, i] = p[i, j]
    for i in range(STATES):
        x[i] += gain[i] * residual / spread


@lean_kernel
def _pair_nll(a, b, s_aa, s_ab, s_bb):
    """(NIS, −log density) of a residual (a, b)."""
    determinant = max(s_aa * s_bb - s_ab * s_ab, 1e-300)
    nis = (a * a * s_bb - 2.0 * a * b * s_ab + b * b * s_aa) / determinant
    return nis, 0.5 * (nis + math.log(determinant)) + math.log(2.0 * math.pi)


@lean_kernel
def _fix_nll(x, p, north, east, variance, added):
    a, b = north - x[NORTH] - x[ERROR_N], east - x[EAST] - x[ERROR_E]
    s_aa = p[NORTH, NORTH] + 2.0 * p[NORTH, ERROR_N] + p[ERROR_N, ERROR_N] + variance + added
    s_ab = p[NORTH, EAST] + p[NORTH, ERROR_E] + p[EAST, ERROR_N] + p[ERROR_N, ERROR_E]
    s_bb = p[EAST, EAST] + 2.0 * p[EAST, ERROR_E] + p[ERROR_E, ERROR_E] + variance + added
    return _pair_nll(a, b, s_aa, s_ab, s_bb)


@lean_kernel
def _log_sum(values, weights):
    """log Σ exp(weights − values)."""
    top = -1e300
    for m in range(len(values)):
        top = max(top, weights[m] - values[m])
    total = 0.0
    for m in range(len(values)):
        total += math.exp(weights[m] - values[m] - top)
    return top + math.log(total)


@kernel
def take_position(
    states: Floats,
    covariances: Floats,
    weights: Floats,
    north: float,
    east: float,
    std: float,
    interval: float,
    speed: float,
    rate: float,
) -> tuple[int, float]:
    """(GOOD, MANOEUVRED or REFUSED; NIS of the most probable hypothesis) of a fix; all hypotheses are corrected.

    states (m, 13), covariances (m, 13, 13), log weights (m,): in place. interval since the fix before, s; speed (m/s)
    and rate (rad/s) the size of an unordered manoeuvre. What is most probable is taken: the motion as predicted, a
    manoeuvre that no order explains, or a wrong fix.
    """
    m = len(states)
    variance = std * std
    costs, wide = np.empty(m), np.empty(m)
    added = (0.5 * speed * min(max(interval, 0.5), 3.0)) ** 2
    best, nis = 0, 0.0
    for k in range(m):
        this, costs[k] = _fix_nll(states[k], covariances[k], north, east, variance, 0.0)
        _, wide[k] = _fix_nll(states[k], covariances[k], north, east, variance, added)
        if weights[k] >= weights[best]:
            best, nis = k, this
    fits, manoeuvre = _log_sum(costs, weights), _log_sum(wide, weights) + MANOEUVRE
    if OUTLIER > max(fits, manoeuvre):
        return REFUSED, nis
    kind = GOOD
    if manoeuvre > fits:
        kind = MANOEUVRED
        costs = wide
        for k in range(m):
            p = covariances[k]
            p[NORTH, NORTH] += added
            p[EAST, EAST] += added
            p[WATER_SPEED, WATER_SPEED] += (0.3 * speed) ** 2
            p[HEADING, HEADING] += 0.1
            p[YAW_RATE, YAW_RATE] += rate * rate
    gain, h = np.empty(STATES), np.zeros(STATES)
    for k in range(m):
        x, p = states[k], covariances[k]
        weights[k] -= costs[k] + fits if kind == GOOD else costs[k] + manoeuvre - MANOEUVRE
        for i, error, measured in ((NORTH, ERROR_N, north), (EAST, ERROR_E, east)):
            h[i] = h[error] = 1.0
            _correct_scalar(x, p, h, measured - x[i] - x[error], variance, gain)
            h[i] = h[error] = 0.0
    return kind, nis


@kernel
def take_velocity(states: Floats, covariances: Floats, weights: Floats, north: float, east: float, std: float) -> bool:
    """Whether a velocity over ground (m/s) fits the most probable hypothesis; then all are corrected by it."""
    m = len(states)
    variance = std * std
    gain, h = np.empty(STATES), np.zeros(STATES)
    costs = np.empty(m)
    best, nis = 0, 0.0
    for k in range(m):
        x, p = states[k], covariances[k]
        c, s = math.cos(x[HEADING]), math.sin(x[HEADING])
        u = x[WATER_SPEED]
        n_c, n_s, e_c, e_s, n_h, e_h = c, s, c, s, -u * s, u * c
        a = north - u * n_c - x[CURRENT_N]
        b = east - u * n_s - x[CURRENT_E]
        ph = np.empty((2, STATES))
        for j in range(STATES):
            ph[0, j] = p[CURRENT_N, j] + e_c * p[WATER_SPEED, j] + n_h * p[HEADING, j]
            ph[1, j] = p[CURRENT_E, j] + e_s * p[WATER_SPEED, j] + e_h * p[HEADING, j]
        s_aa = ph[0, CURRENT_N] + e_c * ph[0, WATER_SPEED] + n_h * ph[0, HEADING] + variance
        s_ab = ph[0, CURRENT_E] + e_s * ph[0, WATER_SPEED] + e_h * ph[0, HEADING]
        s_bb = ph[1, CURRENT_E] + e_s * ph[1, WATER_SPEED] + e_h * ph[1, HEADING] + variance
        this, costs[k] = _pair_nll(a, b, s_aa, s_ab, s_bb)
        if weights[k] >= weights[best]:
            best, nis = k, this
    if nis > 16.0:
        return False
    fits = _log_sum(costs, weights)
    for k in range(m):
        x, p = states[k], covariances[k]
        weights[k] -= costs[k] + fits
        c, s, u = math.cos(x[HEADING]), math.sin(x[HEADING]), x[WATER_SPEED]
        h[CURRENT_N], h[CURRENT_E], h[WATER_SPEED], h[HEADING] = 1.0, 0.0, c, -u * s
        _correct_scalar(x, p, h, north - u * c - x[CURRENT_N], variance, gain)
        c, s, u = math.cos(x[HEADING]), math.sin(x[HEADING]), x[WATER_SPEED]
        h[CURRENT_N], h[CURRENT_E], h[WATER_SPEED], h[HEADING] = 0.0, 1.0, s, u * c
        _correct_scalar(x, p, h, east - u * s - x[CURRENT_E], variance, gain)
    return True


@kernel
def take_number(states: Floats, covariances: Floats, weights: Floats, number: float, std: float, what: int) -> None:
    """Correct all hypotheses by a measurement of one state: HEADING (rad) or YAW_RATE (rad/s)."""
    m = len(states)
    gain, h = np.empty(STATES), np.zeros(STATES)
    h[what] = 1.0
    costs = np.empty(m)
    for k in range(m):
        spread = covariances[k, what, what] + std * std
        residual = number - states[k, what]
        if what == HEADING:
            residual = wrap(residual)
        costs[k] = 0.5 * (residual * residual / spread + math.log(spread))
        _correct_scalar(states[k], covariances[k], h, residual, std * std, gain)
    fits = _log_sum(costs, weights)
    for k in range(m):
        weights[k] -= costs[k] + fits


@kernel
def fold(states: Floats, covariances: Floats) -> None:
    """Headings in [−π, π), speeds through the water ahead: a boat that goes astern points the other way, one about
    at rest keeps its heading. Gains limited.
    """
    for k in range(len(states)):
        x, p = states[k], covariances[k]
        if x[WATER_SPEED] < -_ASTERN * math.sqrt(p[WATER_SPEED, WATER_SPEED]):
            x[WATER_SPEED] = -x[WATER_SPEED]
            x[HEADING] += math.pi
            for j in range(STATES):
                p[WATER_SPEED, j] = -p[WATER_SPEED, j]
                p[j, WATER_SPEED] = -p[j, WATER_SPEED]
        x[HEADING] = wrap(x[HEADING])
        x[GAIN] = min(_LARGEST_GAIN, max(1.0 / _LARGEST_GAIN, x[GAIN]))
        x[SPEED_GAIN] = min(_LARGEST_GAIN, max(1.0 / _LARGEST_GAIN, x[SPEED_GAIN]))
