"""Corrections of the states of `motion` by a position, a velocity over ground, a heading."""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.steering.motion import (
    CURRENT_E,
    CURRENT_N,
    DAMPING,
    DEVIATION,
    EAST,
    ERROR_E,
    ERROR_N,
    GAIN,
    GYRO,
    HEADING,
    NORTH,
    SLIP,
    SPEED_GAIN,
    STATES,
    SWAY,
    TIME,
    WATER_SPEED,
    YAW_RATE,
)

OUTLIER = math.log(0.01 / (2.0 * math.pi * 30.0**2))
"""Log density (1/m²) of an outlier: one fix in 100, off by some 30 m. Chosen: reflections cause errors of tens of
metres."""
MANOEUVRES = 60.0
"""Mean time, s, between manoeuvres that no order explains. The value is chosen."""
_LARGEST_GAIN = 2.5
"""Largest ratio of the estimated gain to the declared gain; the least ratio is its inverse. Chosen: beyond it, the boat
is not the declared one."""
_SHORTEST, _LONGEST = 0.05, 2.5
"""Bounds of the ratio of estimated to declared time constant. Chosen: vehicles' own loops answer in 0.1 to 3 s."""
_LONGEST_SLIP = 2.0
"""Largest time constant of the sway, s. Chosen: small boats slip for 0.2 to 1 s."""
_ASTERN = 2.0
"""A negative speed through the water beyond this many of its σ counts as motion astern. By chance, a speed of 0 is
beyond this limit once in 44 times (normal, one tail)."""
_SETTLED = 0.1
"""1σ of the heading, rad, below which a correction keeps the velocity over ground as if it were a state. Fixes show
this velocity, and not how much of it is current. With the current as the state, its derivative by the heading changes
with every correction of the speed, and the filter gains information about the heading from noise: on a leg in a current
of 1.3 m/s the heading drifted by 4° in 50 s while its σ shrank. While the heading is unknown, the current is the better
known of the two: with 0.3 in place of 0.1, a departing boat misses it by twice as much."""
GOOD, MANOEUVRED, REFUSED = range(3)


@lean_kernel
def _correct_scalar(x: Floats, p: Floats, h: Floats, residual: float, variance: float, gain: Floats) -> None:
    """Kalman's correction by one number z = h x + noise, in place; gain (21,) is workspace."""
    spread = variance
    heading, water, sway = x[HEADING], x[WATER_SPEED], x[SWAY]
    is_settled = p[HEADING, HEADING] < _SETTLED * _SETTLED
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
    if is_settled:
        _keep_over_ground(x, p, heading, water, sway)


@lean_kernel
def _keep_over_ground(x: Floats, p: Floats, heading: float, water: float, sway: float) -> None:
    """Complete a correction as if the velocity over ground were a state in place of the current.

    heading, water, sway: the states before the correction.
    """
    c, s = math.cos(heading), math.sin(heading)
    after_c, after_s = math.cos(x[HEADING]), math.sin(x[HEADING])
    north, east = water * c - sway * s, water * s + sway * c  # through the water
    after_north = x[WATER_SPEED] * after_c - x[SWAY] * after_s
    after_east = x[WATER_SPEED] * after_s + x[SWAY] * after_c
    turned, faster, aside = x[HEADING] - heading, x[WATER_SPEED] - water, x[SWAY] - sway
    x[CURRENT_N] += north + faster * c - aside * s - turned * east - after_north
    x[CURRENT_E] += east + faster * s + aside * c + turned * north - after_east
    turned_n, turned_e, dc, ds = after_east - east, north - after_north, c - after_c, s - after_s
    for j in range(STATES):
        p[CURRENT_N, j] += turned_n * p[HEADING, j] + dc * p[WATER_SPEED, j] - ds * p[SWAY, j]
        p[CURRENT_E, j] += turned_e * p[HEADING, j] + ds * p[WATER_SPEED, j] + dc * p[SWAY, j]
    for i in range(STATES):
        p[i, CURRENT_N] += turned_n * p[i, HEADING] + dc * p[i, WATER_SPEED] - ds * p[i, SWAY]
        p[i, CURRENT_E] += turned_e * p[i, HEADING] + ds * p[i, WATER_SPEED] + dc * p[i, SWAY]


@lean_kernel
def _pair_nll(a: float, b: float, s_aa: float, s_ab: float, s_bb: float) -> tuple[float, float]:
    """(NIS, −log density) of a residual (a, b)."""
    determinant = max(s_aa * s_bb - s_ab * s_ab, 1e-300)
    nis = (a * a * s_bb - 2.0 * a * b * s_ab + b * b * s_aa) / determinant
    return nis, 0.5 * (nis + math.log(determinant)) + math.log(2.0 * math.pi)


@lean_kernel
def _pair_covariance(p: Floats, hn: Floats, he: Floats, variance: float) -> tuple[float, float, float]:
    """Covariance (north, both, east) of two numbers with the rows hn and he (21,) of their Jacobian, and noise."""
    s_nn, s_ne, s_ee = variance, 0.0, variance
    for i in range(STATES):
        if hn[i] == 0.0 and he[i] == 0.0:
            continue
        for j in range(STATES):
            s_nn += hn[i] * p[i, j] * hn[j]
            s_ne += hn[i] * p[i, j] * he[j]
            s_ee += he[i] * p[i, j] * he[j]
    return s_nn, s_ne, s_ee


@lean_kernel
def _seen_pair(p: Floats, hn: Floats, he: Floats, a: float, b: float, variance: float) -> tuple[float, float]:
    """(NIS, −log density) of a residual (a, b) of two numbers with the rows hn and he (21,) of their Jacobian."""
    s_nn, s_ne, s_ee = _pair_covariance(p, hn, he, variance)
    return _pair_nll(a, b, s_nn, s_ne, s_ee)


@lean_kernel
def _position_rows(x: Floats, pivot: float, hn: Floats, he: Floats) -> tuple[float, float]:
    """Predicted position north and east of the receiver's fix, m; hn and he (21,) become the rows of its Jacobian."""
    c, s = math.cos(x[HEADING]), math.sin(x[HEADING])
    hn[NORTH] = hn[ERROR_N] = he[EAST] = he[ERROR_E] = 1.0
    hn[HEADING], he[HEADING] = pivot * s, -pivot * c
    return x[NORTH] + x[ERROR_N] - pivot * c, x[EAST] + x[ERROR_E] - pivot * s


@lean_kernel
def _velocity_rows(x: Floats, pivot: float, hn: Floats, he: Floats) -> tuple[float, float]:
    """The receiver's velocity over ground, north and east, m/s; hn and he (21,) become the rows of its Jacobian."""
    c, s, u, sway = math.cos(x[HEADING]), math.sin(x[HEADING]), x[WATER_SPEED], x[SWAY] - pivot * x[YAW_RATE]
    hn[CURRENT_N] = he[CURRENT_E] = 1.0
    hn[WATER_SPEED], he[WATER_SPEED] = c, s
    hn[SWAY], he[SWAY] = -s, c
    hn[HEADING], he[HEADING] = -u * s - sway * c, u * c - sway * s
    hn[YAW_RATE], he[YAW_RATE] = pivot * s, -pivot * c
    return u * c - sway * s + x[CURRENT_N], u * s + sway * c + x[CURRENT_E]


@kernel
def velocity_of(x: Floats, p: Floats, pivot: float) -> tuple[float, float, float, float]:
    """The receiver's velocity over ground, north and east, and the 1σ along and across this velocity, m/s."""
    hn, he = np.zeros(STATES), np.zeros(STATES)
    north, east = _velocity_rows(x, pivot, hn, he)
    nn, ne, ee = _pair_covariance(p, hn, he, 0.0)
    cog = math.atan2(east, north)
    c, s = math.cos(cog), math.sin(cog)
    along = c * c * nn + 2.0 * c * s * ne + s * s * ee
    across = s * s * nn - 2.0 * c * s * ne + c * c * ee
    return north, east, math.sqrt(max(along, 0.0)), math.sqrt(max(across, 0.0))


@lean_kernel
def _log_sum(values: Floats, weights: Floats) -> float:
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
    pivot: float,
) -> tuple[int, float]:
    """(GOOD, MANOEUVRED or REFUSED; NIS of the most probable hypothesis) of a fix; all hypotheses are corrected.

    states (m, 21), covariances (m, 21, 21) and log weights (m,) are changed in place. interval: s since the fix before.
    speed (m/s) and rate (rad/s): size of a manoeuvre that no order explains. pivot: see `Response`. The most probable
    explanation is used: the motion as predicted, such a manoeuvre, or an outlier.
    """
    m = len(states)
    variance = std * std
    costs, wide = np.empty(m), np.empty(m)
    added = (0.5 * speed * min(max(interval, 0.5), 3.0)) ** 2
    gain, hn, he = np.empty(STATES), np.zeros(STATES), np.zeros(STATES)
    best, nis = 0, 0.0
    rare = math.log(min(max(interval, 0.01) / MANOEUVRES, 0.5))
    for k in range(m):
        x, p = states[k], covariances[k]
        at_north, at_east = _position_rows(x, pivot, hn, he)
        a, b = north - at_north, east - at_east
        this, costs[k] = _seen_pair(p, hn, he, a, b, variance)
        _, wide[k] = _seen_pair(p, hn, he, a, b, variance + added)
        if weights[k] >= weights[best]:
            best, nis = k, this
    fits, manoeuvre = _log_sum(costs, weights), _log_sum(wide, weights) + rare
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
    for k in range(m):
        x, p = states[k], covariances[k]
        weights[k] -= costs[k] + fits if kind == GOOD else costs[k] + manoeuvre - rare
        _correct_scalar(x, p, hn, north - _position_rows(x, pivot, hn, he)[0], variance, gain)
        _correct_scalar(x, p, he, east - _position_rows(x, pivot, hn, he)[1], variance, gain)
    return kind, nis


@kernel
def take_velocity(
    states: Floats, covariances: Floats, weights: Floats, north: float, east: float, std: float, pivot: float
) -> bool:
    """Correct all hypotheses by a velocity over ground (m/s) if it fits the likeliest one. Returns whether it does."""
    m = len(states)
    variance = std * std
    gain, hn, he = np.empty(STATES), np.zeros(STATES), np.zeros(STATES)
    costs = np.empty(m)
    best, nis = 0, 0.0
    for k in range(m):
        x = states[k]
        of_north, of_east = _velocity_rows(x, pivot, hn, he)
        this, costs[k] = _seen_pair(covariances[k], hn, he, north - of_north, east - of_east, variance)
        if weights[k] >= weights[best]:
            best, nis = k, this
    if nis > 16.0:
        return False
    fits = _log_sum(costs, weights)
    for k in range(m):
        x, p = states[k], covariances[k]
        weights[k] -= costs[k] + fits
        _correct_scalar(x, p, hn, north - _velocity_rows(x, pivot, hn, he)[0], variance, gain)
        _correct_scalar(x, p, he, east - _velocity_rows(x, pivot, hn, he)[1], variance, gain)
    return True


@kernel
def take_number(states: Floats, covariances: Floats, weights: Floats, number: float, std: float, what: int) -> float:
    """Correct all hypotheses by HEADING (rad), YAW_RATE (rad/s) or WATER_SPEED (m/s). Returns the NIS of the best."""
    m = len(states)
    gain, h = np.empty(STATES), np.zeros(STATES)
    h[what] = 1.0
    error = DEVIATION if what == HEADING else GYRO if what == YAW_RATE else -1
    if error >= 0:
        h[error] = 1.0
    costs = np.empty(m)
    best, nis = 0, 0.0
    for k in range(m):
        p = covariances[k]
        spread, residual = p[what, what] + std * std, number - states[k, what]
        if error >= 0:
            spread += 2.0 * p[what, error] + p[error, error]
            residual -= states[k, error]
        if what == HEADING:
            residual = wrap(residual)
        this = residual * residual / spread
        if weights[k] >= weights[best]:
            best, nis = k, this
        costs[k] = 0.5 * (this + math.log(spread))
        _correct_scalar(states[k], covariances[k], h, residual, std * std, gain)
    fits = _log_sum(costs, weights)
    for k in range(m):
        weights[k] -= costs[k] + fits
    return nis


@kernel
def fold(states: Floats, covariances: Floats, linear: float, slow: float) -> None:
    """Wrap headings to [−π, π), and turn a boat that clearly moves astern round, so that it moves ahead. A speed astern
    below `slow` (m/s) is that of a boat at rest. Gains and time constants are limited. So is the damping of the yaw
    rate, whose declared value is `linear`: otherwise a boat that does not answer orders would be estimated as unstable.
    """
    for k in range(len(states)):
        x, p = states[k], covariances[k]
        if x[WATER_SPEED] < -max(slow, _ASTERN * math.sqrt(p[WATER_SPEED, WATER_SPEED])):
            x[WATER_SPEED] = -x[WATER_SPEED]
            x[HEADING] += math.pi
            x[SWAY] = -x[SWAY]
            for k in (WATER_SPEED, SWAY):
                for j in range(STATES):
                    p[k, j] = -p[k, j]
                    p[j, k] = -p[j, k]
        x[HEADING] = wrap(x[HEADING])
        x[GAIN] = min(_LARGEST_GAIN, max(1.0 / _LARGEST_GAIN, x[GAIN]))
        x[SPEED_GAIN] = min(_LARGEST_GAIN, max(1.0 / _LARGEST_GAIN, x[SPEED_GAIN]))
        x[TIME] = min(_LONGEST, max(_SHORTEST, x[TIME]))
        x[SLIP] = min(_LONGEST_SLIP, max(0.0, x[SLIP]))
        x[DAMPING] = linear * min(_LARGEST_GAIN - 1.0, max(1.0 / _LARGEST_GAIN - 1.0, x[DAMPING] / linear))
