"""The five-state extended Kalman filter of P0 Table 1, states [x^n y^n U χ ω_χ] of (11)–(15).

Where the paper steps by Euler's method and adds h² Q_d, this integrates the turn exactly (constant turn rate over a
step) and takes spectral densities, so that the rate at which it runs changes nothing. States beyond the five (errors
of the receiver, biases of aids) are first-order Gauss–Markov and ride along; without them their loops are empty.
Of a covariance only the upper triangle is kept and read.
"""

import math

from steerway.compiled import kernel
from steerway.estimation.model import (
    EAST,
    EXTRAS,
    NORTH,
    RATE,
    RATE_DECAY,
    RATE_NOISE,
    SPEED,
    SPEED_DECAY,
    SPEED_NOISE,
)


@kernel
def decay(rate, dt):
    """A decaying state after dt for each unit before, and its integral: e^{−α dt}, (1 − e^{−α dt})/α."""
    if rate == 0.0:
        return 1.0, dt
    lost = -math.expm1(-rate * dt)
    return 1.0 - lost, lost / rate


@kernel
def turn_response(rate_decay, dt):
    """Course rate, course and integral of the course, dt after a unit of course rate: e^{−α2 dt} and its integrals."""
    a = rate_decay * dt
    if a < 0.02:
        left = 1.0 - a * (1.0 - a * (1.0 / 2.0 - a * (1.0 / 6.0 - a / 24.0)))
        turn = dt * (1.0 - a * (1.0 / 2.0 - a * (1.0 / 6.0 - a * (1.0 / 24.0 - a / 120.0))))
        area = dt * dt * (1.0 / 2.0 - a * (1.0 / 6.0 - a * (1.0 / 24.0 - a * (1.0 / 120.0 - a / 720.0))))
        return left, turn, area
    lost = -math.expm1(-a)
    turn = lost / rate_decay
    return 1.0 - lost, turn, (dt - turn) / rate_decay


@kernel
def sinc(angle):
    """(sin a)/a and its derivative."""
    if abs(angle) < 1e-3:
        square = angle * angle
        return 1.0 - square / 6.0, -angle / 3.0
    ratio = math.sin(angle) / angle
    return ratio, (math.cos(angle) - ratio) / angle


@kernel
def chord(speed, course, rate, dt, model):
    """The step over ground and its partial derivatives by U and ω_χ; by χ it turns: dN/dχ = −dE, dE/dχ = dN.

    Returns (c, s, dN, dE, dN/dU, dE/dU, dN/dω, dE/dω, e^{−α1 dt}, e^{−α2 dt}, ∫e^{−α2 t}), with (c, s) the mean course.
    """
    speed_left, speed_integral = decay(model[SPEED_DECAY], dt)
    rate_left, turn, area = turn_response(model[RATE_DECAY], dt)
    lean = area / dt
    ratio, slope = sinc(0.5 * turn * rate)
    c, s = math.cos(course + lean * rate), math.sin(course + lean * rate)
    per_speed = speed_integral * ratio
    length = speed * per_speed
    along = 0.5 * turn * slope * speed * speed_integral
    across = lean * length
    return (
        c,
        s,
        length * c,
        length * s,
        per_speed * c,
        per_speed * s,
        along * c - across * s,
        along * s + across * c,
        speed_left,
        rate_left,
        turn,
    )


@kernel
def turn_noise(rate_decay, dt):
    """What a unit of S_ω adds in dt to the covariance of (ω, χ, ∫χ): q_ωω, q_χω, q_χχ, q_yω, q_yχ, q_yy.

    Gauss–Legendre quadrature of the response to noise at three moments: exact for α2 = 0, and positive semidefinite
    whatever α2 and dt.
    """
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


_NODE = math.sqrt(0.15)
_CENTRE_WEIGHT, _SIDE_WEIGHT = 4.0 / 9.0, 5.0 / 18.0


@kernel
def predict(x, p, dt, model):
    """State and covariance predictor of Table 1 over dt, in place: x ← f(x), P ← F P Fᵀ + Q.

    Q follows from S_U through speed to position along the course, from S_ω through rate and course to position across.
    """
    n = len(x)
    u = x[SPEED]
    c, s, north, east, north_u, east_u, north_w, east_w, speed_left, rate_left, turn = chord(
        u, x[3], x[RATE], dt, model
    )
    x[NORTH] += north
    x[EAST] += east
    x[SPEED] = u * speed_left
    x[3] += turn * x[RATE]
    x[RATE] *= rate_left

    n0 = p[0, 0] + north_u * p[0, 2] - east * p[0, 3] + north_w * p[0, 4]
    n1 = p[0, 1] + north_u * p[1, 2] - east * p[1, 3] + north_w * p[1, 4]
    n2 = p[0, 2] + north_u * p[2, 2] - east * p[2, 3] + north_w * p[2, 4]
    n3 = p[0, 3] + north_u * p[2, 3] - east * p[3, 3] + north_w * p[3, 4]
    n4 = p[0, 4] + north_u * p[2, 4] - east * p[3, 4] + north_w * p[4, 4]
    e1 = p[1, 1] + east_u * p[1, 2] + north * p[1, 3] + east_w * p[1, 4]
    e2 = p[1, 2] + east_u * p[2, 2] + north * p[2, 3] + east_w * p[2, 4]
    e3 = p[1, 3] + east_u * p[2, 3] + north * p[3, 3] + east_w * p[3, 4]
    e4 = p[1, 4] + east_u * p[2, 4] + north * p[3, 4] + east_w * p[4, 4]
    x3 = p[3, 3] + turn * p[3, 4]
    x4 = p[3, 4] + turn * p[4, 4]

    speed_noise, rate_noise = model[SPEED_NOISE], model[RATE_NOISE]
    along = speed_noise * dt**3 / 3.0
    along_u = 0.5 * speed_noise * dt * dt
    q_ww, q_xw, q_xx, q_yw, q_yx, q_yy = turn_noise(model[RATE_DECAY], dt)
    across = u * u * rate_noise * q_yy
    across_x = u * rate_noise * q_yx
    across_w = u * rate_noise * q_yw
    p[0, 0] = n0 + north_u * n2 - east * n3 + north_w * n4 + c * c * along + s * s * across
    p[0, 1] = n1 + east_u * n2 + north * n3 + east_w * n4 + c * s * (along - across)
    p[1, 1] = e1 + east_u * e2 + north * e3 + east_w * e4 + s * s * along + c * c * across
    p[0, 2] = n2 * speed_left + c * along_u
    p[1, 2] = e2 * speed_left + s * along_u
    p[0, 3] = n3 + turn * n4 - s * across_x
    p[1, 3] = e3 + turn * e4 + c * across_x
    p[0, 4] = n4 * rate_left - s * across_w
    p[1, 4] = e4 * rate_left + c * across_w
    p[2, 3] = (p[2, 3] + turn * p[2, 4]) * speed_left
    p[2, 2] = p[2, 2] * speed_left**2 + speed_noise * dt
    p[2, 4] *= speed_left * rate_left
    p[3, 3] = x3 + turn * x4 + rate_noise * q_xx
    p[3, 4] = x4 * rate_left + rate_noise * q_xw
    p[4, 4] = p[4, 4] * rate_left**2 + rate_noise * q_ww
    for j in range(5, n):
        p[0, j] += north_u * p[2, j] - east * p[3, j] + north_w * p[4, j]
        p[1, j] += east_u * p[2, j] + north * p[3, j] + east_w * p[4, j]
        p[2, j] *= speed_left
        p[3, j] += turn * p[4, j]
        p[4, j] *= rate_left
    predict_extras(x, p, dt, model)


@kernel
def predict_extras(x, p, dt, model):
    """The states beyond the five decay and take up noise; their covariance with the five has had its F already."""
    n = len(x)
    for j in range(5, n):
        rate, density = model[EXTRAS + 3 * (j - 5)], model[EXTRAS + 3 * (j - 5) + 1]
        left, integral = decay(rate, dt)
        x[j] *= left
        for i in range(j + 1):
            p[i, j] *= left
        for i in range(j, n):
            p[j, i] *= left
        p[j, j] += 0.5 * density * integral * (1.0 + left)
