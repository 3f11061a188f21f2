"""Motion of the five-state extended Kalman filter, states [x^n y^n U χ ω_χ].

S. Fossen and T. I. Fossen, Sensors 21, 2021, 7910, (11)–(15) and Table 1. Where the paper steps by Euler's
method and adds h² Q_d, this integrates the turn exactly (constant turn rate over a step) and takes spectral densities,
so that the rate at which it runs changes nothing. States beyond the five (errors of the receiver, biases of aids) are
first-order Gauss–Markov; without them their loops are empty. Of a covariance only the upper triangle is kept and read.
"""

import math

from steerway.core.angles import sinc
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.course.motion.layout import (
    ADDED,
    COURSE,
    DT,
    EAST,
    EXTRAS,
    LEAN,
    LEFT,
    LONGEST_STEP,
    NORTH,
    Q_LL,
    Q_LU,
    Q_UU,
    Q_WW,
    Q_XW,
    Q_XX,
    Q_YW,
    Q_YX,
    Q_YY,
    RATE,
    RATE_DECAY,
    RATE_LEFT,
    RATE_NOISE,
    SPEED,
    SPEED_DECAY,
    SPEED_INTEGRAL,
    SPEED_LEFT,
    SPEED_NOISE,
    START_RATE_VARIANCE,
    TURN,
)

LARGEST_START_RATE_STD = math.radians(20.0)
"""rad/s of course rate at the start: a small craft in a hard turn; a stationary value may be infinite. Chosen."""
_LONGEST_STEP = 1.0
"""s: with a course rate of up to a third of a radian a second the turn of a step stays well below a radian."""


def pack(profile, row, add_state) -> bool:
    """Fill a row of parameters."""
    row[SPEED_NOISE], row[SPEED_DECAY] = profile.speed_noise, profile.speed_decay
    row[RATE_NOISE], row[RATE_DECAY] = profile.course_rate_noise, profile.course_rate_decay
    row[LONGEST_STEP] = _LONGEST_STEP
    stationary = math.inf
    if profile.course_rate_decay > 0.0:
        stationary = math.sqrt(profile.course_rate_noise / (2.0 * profile.course_rate_decay))
    row[START_RATE_VARIANCE] = min(stationary, LARGEST_START_RATE_STD) ** 2
    return True


def gauss_markov(std, time) -> tuple[float, float, float]:
    """Decay rate, noise density and stationary variance of a first-order process."""
    return 1.0 / time, 2.0 * std**2 / time, std**2


@lean_kernel
def decay(rate, dt):
    """A decaying state after dt for each unit before, and its integral: e^{−α dt}, (1 − e^{−α dt})/α."""
    if rate == 0.0:
        return 1.0, dt
    lost = -math.expm1(-rate * dt)
    return 1.0 - lost, lost / rate


@lean_kernel
def turn_response(rate_decay, dt):
    """Course rate, course and integral of the course, dt after a unit of course rate: e^{−α2 dt} and its integrals."""
    a = rate_decay * dt
    if abs(a) < 0.02:
        area = 1.0 / 2.0 - a * (1.0 / 6.0 - a * (1.0 / 24.0 - a * (1.0 / 120.0 - a * (1.0 / 720.0))))
        turn = 1.0 - a * area
        return 1.0 - a * turn, dt * turn, dt * dt * area
    lost = -math.expm1(-a)
    turn = lost / rate_decay
    return 1.0 - lost, turn, (dt - turn) / rate_decay


@lean_kernel
def chord(
    speed: float, course: float, rate: float, step: Floats
) -> tuple[float, float, float, float, float, float, float, float]:
    """Displacement over ground and its derivatives by U and ω_χ; by χ it rotates: dN/dχ = −dE, dE/dχ = dN.

    Returns (c, s, dN, dE, dN/dU, dE/dU, dN/dω, dE/dω), with (c, s) the direction of the mean course.
    """
    mean_course = course + step[LEAN] * rate
    c, s = math.cos(mean_course), math.sin(mean_course)
    ratio, slope = sinc(0.5 * step[TURN] * rate)
    per_speed = step[SPEED_INTEGRAL] * ratio
    length = speed * per_speed
    along = 0.5 * step[TURN] * slope * speed * step[SPEED_INTEGRAL]
    across = step[LEAN] * length
    return (
        c,
        s,
        length * c,
        length * s,
        per_speed * c,
        per_speed * s,
        along * c - across * s,
        along * s + across * c,
    )


@lean_kernel
def turn_noise(rate_decay, dt):
    """What a unit of S_ω adds in dt to the covariance of (ω, χ, ∫χ): q_ωω, q_χω, q_χχ, q_yω, q_yχ, q_yy.

    Gauss–Legendre quadrature of the response to noise at three moments: exact for α2 = 0, and positive semidefinite
    whatever α2 and dt. A step that is long beside 1 s and 1/α2 takes the integrals in closed form, which cancel in
    shorter ones.
    """
    if dt > _LONGEST_STEP and rate_decay * dt > _LONG_DECAY:
        return long_turn_noise(rate_decay, dt)
    ww = xw = xx = yw = yx = yy = 0.0
    for k in range(-1, 2):
        w, x, y = turn_response(rate_decay, dt * (0.5 + k * _NODE))
        weight = dt * (_CENTRE_WEIGHT if k == 0 else _SIDE_WEIGHT)
        ww += weight * w * w
        xw += weight * x * w
        xx += weight * x * x
        yw += weight * y * w
        yx += weight * y * x
        yy += weight * y * y
    return ww, xw, xx, yw, yx, yy


@lean_kernel
def long_turn_noise(rate_decay, dt):
    """`turn_noise` in closed form, with the responses (w, x, y) of `turn_response`: ẏ = x, ẋ = w = 1 − α2 x."""
    w, x, y = turn_response(rate_decay, dt)
    xx = (dt - 2.0 * x + 0.5 * (1.0 - w * w) / rate_decay) / rate_decay**2
    area = (0.5 * dt * dt - y) / rate_decay  # ∫ y
    yx = 0.5 * y * y
    yy = (dt**3 / 3.0 - 2.0 * (dt * y - area) + xx) / rate_decay**2
    return 0.5 * (1.0 - w * w) / rate_decay, 0.5 * x * x, xx, area - rate_decay * yx, yx, yy


_LONG_DECAY = 0.5
"""α2 dt at which the quadrature errs by 1e-4 of its numbers, and the closed form by 1e-14."""
_NODE, _CENTRE_WEIGHT, _SIDE_WEIGHT = math.sqrt(0.15), 4.0 / 9.0, 5.0 / 18.0
"""Gauss and Legendre's rule with three nodes on an interval of length 1."""


@called_kernel
def set_step(step: Floats, dt: float, parameters: Floats) -> None:
    """Fill `step` (3, n) with what a prediction over dt ≥ 0 seconds needs that depends on dt alone."""
    speed_noise, rate_noise = parameters[SPEED_NOISE], parameters[RATE_NOISE]
    step[DT] = dt
    uu, lu, ll, _, _, _ = turn_noise(parameters[SPEED_DECAY], dt)  # speed and way decay as course rate and course
    step[SPEED_LEFT], step[SPEED_INTEGRAL] = decay(parameters[SPEED_DECAY], dt)
    step[RATE_LEFT], step[TURN], area = turn_response(parameters[RATE_DECAY], dt)
    step[LEAN] = area / dt if dt > 0.0 else 0.0
    step[Q_UU], step[Q_LU], step[Q_LL] = speed_noise * uu, speed_noise * lu, speed_noise * ll
    ww, xw, xx, yw, yx, yy = turn_noise(parameters[RATE_DECAY], dt)
    step[Q_WW], step[Q_XW], step[Q_XX] = rate_noise * ww, rate_noise * xw, rate_noise * xx
    step[Q_YW], step[Q_YX], step[Q_YY] = rate_noise * yw, rate_noise * yx, rate_noise * yy
    for j in range(5, step.shape[1]):
        rate, density = parameters[EXTRAS + 3 * (j - 5)], parameters[EXTRAS + 3 * (j - 5) + 1]
        left, integral = decay(rate, dt)
        step[LEFT, j], step[ADDED, j] = left, 0.5 * density * integral * (1.0 + left)


@lean_kernel
def predict(x: Floats, p: Floats, step: Floats, parameters: Floats) -> None:
    """State and covariance predictor of Table 1 over a step, in place: x ← f(x), P ← F P Fᵀ + Q.

    p: (n, n) or wider; columns beyond n are multiplied by F alone (see `motion.models`).
    Q follows from S_U through speed to position along the course, from S_ω through rate and course to position across.
    """
    u, w = x[SPEED], x[RATE]
    c, s, north, east, north_u, east_u, north_w, east_w = chord(u, x[COURSE], w, step)
    speed_left, rate_left, turn = step[SPEED_LEFT], step[RATE_LEFT], step[TURN]
    x[NORTH] += north
    x[EAST] += east
    x[SPEED] = u * speed_left
    x[COURSE] += turn * w
    x[RATE] = w * rate_left

    uu, ux, uw, xx, xw, ww = p[2, 2], p[2, 3], p[2, 4], p[3, 3], p[3, 4], p[4, 4]
    nu, nx, nw, eu, ex, ew = p[0, 2], p[0, 3], p[0, 4], p[1, 2], p[1, 3], p[1, 4]
    n0 = p[0, 0] + north_u * nu - east * nx + north_w * nw
    n1 = p[0, 1] + north_u * eu - east * ex + north_w * ew
    n2 = nu + north_u * uu - east * ux + north_w * uw
    n3 = nx + north_u * ux - east * xx + north_w * xw
    n4 = nw + north_u * uw - east * xw + north_w * ww
    e1 = p[1, 1] + east_u * eu + north * ex + east_w * ew
    e2 = eu + east_u * uu + north * ux + east_w * uw
    e3 = ex + east_u * ux + north * xx + east_w * xw
    e4 = ew + east_u * uw + north * xw + east_w * ww
    x3 = xx + turn * xw
    x4 = xw + turn * ww

    across, across_x, across_w = u * u * step[Q_YY], u * step[Q_YX], u * step[Q_YW]
    p[0, 0] = n0 + north_u * n2 - east * n3 + north_w * n4 + c * c * step[Q_LL] + s * s * across
    p[0, 1] = n1 + east_u * n2 + north * n3 + east_w * n4 + c * s * (step[Q_LL] - across)
    p[0, 2] = n2 * speed_left + c * step[Q_LU]
    p[0, 3] = n3 + turn * n4 - s * across_x
    p[0, 4] = n4 * rate_left - s * across_w
    p[1, 1] = e1 + east_u * e2 + north * e3 + east_w * e4 + s * s * step[Q_LL] + c * c * across
    p[1, 2] = e2 * speed_left + s * step[Q_LU]
    p[1, 3] = e3 + turn * e4 + c * across_x
    p[1, 4] = e4 * rate_left + c * across_w
    p[2, 2] = uu * speed_left**2 + step[Q_UU]
    p[2, 3] = (ux + turn * uw) * speed_left
    p[2, 4] = uw * speed_left * rate_left
    p[3, 3] = x3 + turn * x4 + step[Q_XX]
    p[3, 4] = x4 * rate_left + step[Q_XW]
    p[4, 4] = ww * rate_left**2 + step[Q_WW]
    for j in range(5, p.shape[1]):
        p[0, j] += north_u * p[2, j] - east * p[3, j] + north_w * p[4, j]
        p[1, j] += east_u * p[2, j] + north * p[3, j] + east_w * p[4, j]
        p[2, j] *= speed_left
        p[3, j] += turn * p[4, j]
        p[4, j] *= rate_left
    predict_extras(x, p, step)


@lean_kernel
def predict_extras(x, p, step):
    """The states beyond the five decay and take up noise; their covariance with the five has had its F already."""
    n = len(x)
    for j in range(5, n):
        left = step[LEFT, j]
        x[j] *= left
        for i in range(j + 1):
            p[i, j] *= left
        for i in range(j, p.shape[1]):
            p[j, i] *= left
        p[j, j] += step[ADDED, j]
