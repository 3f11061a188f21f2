"""Where a vessel will be: mean and covariance of her position after a while, under the filter's own model of motion.

Course diffuses without bound, so that linearisation fails within minutes: what it would draw as a long thin ellipse
across the course is a crescent, then a disc. Here speed and course are Gaussian processes whose mean and covariance
at any two moments are known in closed form, and the first two moments of the position are integrals of
E[U e^{iχ}] and E[U(s) U(t) e^{i(χ(s) ± χ(t))}] over one and two moments of the way. Acceleration lasts
`acceleration_time`, a turn 1/α2, and a vessel without way drifts about, slower than steerageway.
"""

import math

import numpy as np

from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.course.acceleration import give
from steerway.estimation.course.five_state import decay, turn_response
from steerway.estimation.course.model import (
    ACCELERATION_STATE,
    COURSE,
    EXTRAS,
    MODE,
    RATE,
    RATE_DECAY,
    RATE_NOISE,
    SPEED,
    SPEED_DECAY,
    SPEED_NOISE,
    STEERAGEWAY,
    UNDERWAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
    YAWING_DECAY,
    YAWING_STATE,
    YAWING_STIFFNESS,
)
from steerway.estimation.course.way import GATHERED, velocity_to_course

NODES = 48
DRIFT_TIME = 200.0
"""s for which a vessel without way goes on drifting one way."""


@kernel
def forecast(memory, model, horizon):
    """Mean way north and east from the filter's position, and the covariance there: (ΔN, ΔE, Σ_NN, Σ_NE, Σ_EE), m, m².

    Args:
        memory: of a filter that has had a fix, (n + 2, n) or more. model: its parameters. horizon: > 0 s.
    """
    n = memory.shape[1]
    x, p, mode = memory[n].copy(), memory[:n].copy(), memory[n + 1, MODE]
    if mode != UNDERWAY:
        speed = math.hypot(x[VELOCITY_NORTH], x[VELOCITY_EAST])
        if speed < max(GATHERED * math.sqrt(0.5 * (p[2, 2] + p[3, 3])), model[STEERAGEWAY]):
            return _adrift(x, p, model, horizon)
        velocity_to_course(x, p)
        x[RATE] = 0.0
        for i in range(RATE):
            p[i, RATE] = 0.0
    if model[YAWING_STATE]:
        model = _held_course(x, p, model)
    return _underway(x, p, model, horizon)


@kernel
def _held_course(x, p, model):
    """Of a vessel that yaws the course she holds, in place, and a model under which it wanders as far in the long run.

    Seen over more than a swing d is white noise, of the density of w2 over (κ + α2 β)², and the course held follows it.
    """
    d, follows, loss = int(model[YAWING_STATE]), model[YAWING_DECAY], model[RATE_DECAY]
    give(x, p, COURSE, d, -1.0)
    x[RATE] = 0.0
    for i in range(RATE):
        p[i, RATE] = 0.0
    held = model.copy()
    held[RATE_DECAY] = loss + follows
    held[RATE_NOISE] *= (follows * (loss + follows) / (model[YAWING_STIFFNESS] + loss * follows)) ** 2
    p[RATE, RATE] = 0.5 * held[RATE_NOISE] / held[RATE_DECAY]
    return held


@lean_kernel
def walked(rate, t):
    """Of a process that decays at `rate` towards 0 and is driven by unit white noise from 0 on: the variance of its
    integral after t, and the covariance of that integral with the process itself.

    With S_ω in front: of course, and of course and course rate.
    """
    _, once, twice = turn_response(rate, t)
    both = 0.5 * once * once
    if rate * t < 0.02:
        return t**3 / 3.0 * (1.0 - 0.75 * rate * t), both
    return (twice - both) / rate, both


@lean_kernel
def _adrift(x, p, model, horizon):
    """Velocity decays to nothing and wanders by half of steerageway."""
    rate = 1.0 / DRIFT_TIME
    reach = decay(rate, horizon)[1]
    spread = 2.0 * rate * (0.5 * model[STEERAGEWAY]) ** 2 * walked(rate, horizon)[0]
    north = p[0, 0] + reach * (2.0 * p[0, 2] + reach * p[2, 2]) + spread
    east = p[1, 1] + reach * (2.0 * p[1, 3] + reach * p[3, 3]) + spread
    both = p[0, 1] + reach * (p[0, 3] + p[1, 2] + reach * p[2, 3])
    return reach * x[VELOCITY_NORTH], reach * x[VELOCITY_EAST], north, both, east


@kernel
def _underway(x, p, model, horizon):
    """Moments of ∫ U e^{iχ} by midpoints that lie close at first and wide later, where little hangs on them."""
    s, w = np.empty(NODES), np.empty(NODES)
    speed, speed_left, speed_gain = np.empty(NODES), np.empty(NODES), np.empty(NODES)
    course, course_gain, course_variance = np.empty(NODES), np.empty(NODES), np.empty(NODES)
    lasting = int(model[ACCELERATION_STATE])
    loss, bend = model[SPEED_DECAY], model[RATE_DECAY]
    push, push_loss, push_noise = 0.0, 0.0, 0.0
    if lasting:
        push = x[lasting]
        push_loss, push_noise = model[EXTRAS + 3 * (lasting - 5)], model[EXTRAS + 3 * (lasting - 5) + 1]
    north = east = north_u = east_u = 0.0
    for k in range(NODES):
        u = (k + 0.5) / NODES
        s[k], w[k] = horizon * u * u, 2.0 * horizon * u / NODES
        speed_left[k] = decay(loss, s[k])[0]
        speed_gain[k] = decay(push_loss, s[k])[1]
        speed[k] = max(x[SPEED] * speed_left[k] + push * speed_gain[k], 0.0)
        course_gain[k] = decay(bend, s[k])[1]
        course[k] = x[COURSE] + course_gain[k] * x[RATE]
        course_variance[k] = _course_covariance(p, course_gain[k], course_gain[k], model[RATE_NOISE], bend, s[k], 0.0)
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
            squares += model[SPEED_NOISE] * decay(2.0 * loss, s[i])[1] * decay(loss, later)[0]
            if lasting:
                squares += p[SPEED, lasting] * (speed_left[i] * speed_gain[j] + speed_left[j] * speed_gain[i])
                squares += p[lasting, lasting] * speed_gain[i] * speed_gain[j]
                area, mixed = walked(push_loss, s[i])
                squares += push_noise * (area + decay(push_loss, later)[1] * mixed)
            shared = _course_covariance(p, course_gain[i], course_gain[j], model[RATE_NOISE], bend, s[i], later)
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
    area, mixed = walked(rate, t)
    known = p[COURSE, COURSE] + (gain + later_gain) * p[COURSE, RATE] + gain * later_gain * p[RATE, RATE]
    return known + noise * (area + decay(rate, later)[1] * mixed)
