"""Forecast: mean and covariance of the position after a while, under the filter's own motion model.

Course diffuses without bound, so that linearisation fails within minutes: its long thin ellipse across the course is
in truth a crescent, then a disc. Here speed and course are Gaussian processes whose mean and covariance at any two
times are known in closed form, and the first two moments of the position are integrals of E[U e^{iχ}] and
E[U(s) U(t) e^{i(χ(s) ± χ(t))}] over one and two times. Acceleration persists for `acceleration_time`, a turn for 1/α2;
at low speed the vessel drifts, slower than steerageway.
"""

import math

import numpy as np

from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.course.motion.five_state import decay, turn_response
from steerway.estimation.course.motion.layout import (
    ACCELERATION_STATE,
    COURSE,
    EXTRAS,
    PHASE,
    RATE,
    RATE_DECAY,
    RATE_NOISE,
    SPEED,
    SPEED_DECAY,
    SPEED_NOISE,
    STEERAGEWAY,
    UNDER_WAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
)
from steerway.estimation.course.motion.models import long_run
from steerway.estimation.course.steerageway import COURSE_GAINED, velocity_to_course

NODES = 48
"""Of the midpoint rule: with 96 mean and covariance of the voyages of `tests/test_prediction.py` change by less than
10⁻⁴ of the spread (that test with this number changed); it compares them with Monte Carlo."""
DRIFT_TIME = 200.0
"""s, time constant of the velocity of a drifting vessel. Chosen: some minutes, as gusts and eddies last."""


@kernel
def forecast(block, parameters, horizon):
    """Mean displacement north and east, and the covariance then: (ΔN, ΔE, Σ_NN, Σ_NE, Σ_EE), m, m².

    Args:
        block: covariance, state and flags of a filter that has had a fix, (n + 2, n) or more. parameters: (k,) of one
            mode. horizon: > 0 s.
    """
    n = block.shape[1]
    x, p = block[n].copy(), block[:n].copy()
    if block[n + 1, PHASE] != UNDER_WAY:
        speed = math.hypot(x[VELOCITY_NORTH], x[VELOCITY_EAST])
        if speed < max(COURSE_GAINED * math.sqrt(0.5 * (p[2, 2] + p[3, 3])), parameters[STEERAGEWAY]):
            return _low_speed(x, p, parameters, horizon)
        velocity_to_course(x, p)
        x[RATE] = 0.0
        for i in range(RATE):
            p[i, RATE] = 0.0
    return _under_way(x, p, long_run(x, p, parameters), horizon)


@lean_kernel
def integral_moments(rate, t):
    """Variance of the integral after t of a process that decays at `rate` and starts from 0, under unit white noise.

    And the covariance of that integral with the process. Times S_ω: of course, and of course and course rate.
    """
    _, once, twice = turn_response(rate, t)
    both = 0.5 * once * once
    if rate * t < 0.02:
        return t**3 / 3.0 * (1.0 - 0.75 * rate * t), both
    return (twice - both) / rate, both


@lean_kernel
def _low_speed(x, p, parameters, horizon):
    """Velocity decays to a stationary standard deviation of half of steerageway."""
    rate = 1.0 / DRIFT_TIME
    reach = decay(rate, horizon)[1]
    spread = 2.0 * rate * (0.5 * parameters[STEERAGEWAY]) ** 2 * integral_moments(rate, horizon)[0]
    north = p[0, 0] + reach * (2.0 * p[0, 2] + reach * p[2, 2]) + spread
    east = p[1, 1] + reach * (2.0 * p[1, 3] + reach * p[3, 3]) + spread
    both = p[0, 1] + reach * (p[0, 3] + p[1, 2] + reach * p[2, 3])
    return reach * x[VELOCITY_NORTH], reach * x[VELOCITY_EAST], north, both, east


@kernel
def _under_way(x, p, parameters, horizon):
    """Moments of ∫ U e^{iχ} by midpoints that are close at first and wide later, where the integrand is smooth."""
    s, w = np.empty(NODES), np.empty(NODES)
    speed, speed_left, speed_gain = np.empty(NODES), np.empty(NODES), np.empty(NODES)
    course, course_gain, course_variance = np.empty(NODES), np.empty(NODES), np.empty(NODES)
    a = int(parameters[ACCELERATION_STATE])
    loss, bend, rate_noise = parameters[SPEED_DECAY], parameters[RATE_DECAY], parameters[RATE_NOISE]
    push, push_loss, push_noise = 0.0, 0.0, 0.0
    if a:
        push = x[a]
        push_loss, push_noise = parameters[EXTRAS + 3 * (a - 5)], parameters[EXTRAS + 3 * (a - 5) + 1]
    north = east = north_u = east_u = 0.0
    for k in range(NODES):
        u = (k + 0.5) / NODES
        s[k], w[k] = horizon * u * u, 2.0 * horizon * u / NODES
        speed_left[k] = decay(loss, s[k])[0]
        speed_gain[k] = decay(push_loss, s[k])[1]
        speed[k] = max(x[SPEED] * speed_left[k] + push * speed_gain[k], 0.0)
        course_gain[k] = decay(bend, s[k])[1]
        course[k] = x[COURSE] + course_gain[k] * x[RATE]
        course_variance[k] = _course_covariance(p, course_gain[k], course_gain[k], rate_noise, bend, s[k], 0.0)
        weight = w[k] * math.exp(-0.5 * course_variance[k])
        c, e = weight * math.cos(course[k]), weight * math.sin(course[k])
        north_u += c * speed_left[k]
        east_u += e * speed_left[k]
        north += c * speed[k]
        east += e * speed[k]
    nn = p[0, 0] + 2.0 * (p[0, 2] * north_u - p[0, 3] * east) - north * north
    ne = p[0, 1] + p[0, 2] * east_u + p[0, 3] * north + p[1, 2] * north_u - p[1, 3] * east - north * east
    ee = p[1, 1] + 2.0 * (p[1, 2] * east_u + p[1, 3] * north) - east * east
    for j in range(NODES):
        for i in range(j + 1):
            both = w[i] * w[j] if i == j else 2.0 * w[i] * w[j]
            later = s[j] - s[i]
            squares = speed[i] * speed[j] + p[SPEED, SPEED] * speed_left[i] * speed_left[j]
            squares += parameters[SPEED_NOISE] * decay(2.0 * loss, s[i])[1] * decay(loss, later)[0]
            if a:
                squares += p[SPEED, a] * (speed_left[i] * speed_gain[j] + speed_left[j] * speed_gain[i])
                squares += p[a, a] * speed_gain[i] * speed_gain[j]
                area, mixed = integral_moments(push_loss, s[i])
                squares += push_noise * (area + decay(push_loss, later)[1] * mixed)
            shared = _course_covariance(p, course_gain[i], course_gain[j], rate_noise, bend, s[i], later)
            mean = 0.5 * (course_variance[i] + course_variance[j])
            apart = both * squares * math.exp(shared - mean) * math.cos(course[i] - course[j])
            along = both * squares * math.exp(-shared - mean)
            nn += 0.5 * (apart + along * math.cos(course[i] + course[j]))
            ee += 0.5 * (apart - along * math.cos(course[i] + course[j]))
            ne += 0.5 * along * math.sin(course[i] + course[j])
    return north, east, nn, ne, ee


@lean_kernel
def _course_covariance(p, gain, later_gain, noise, rate, t, later):
    """Of χ at t and at t + later."""
    area, mixed = integral_moments(rate, t)
    known = p[COURSE, COURSE] + (gain + later_gain) * p[COURSE, RATE] + gain * later_gain * p[RATE, RATE]
    return known + noise * (area + decay(rate, later)[1] * mixed)
