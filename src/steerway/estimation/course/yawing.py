"""Yawing: a vessel steered back to the course she holds, and past it, as a sea swings her to and fro.

ω̇ = −α2 ω − κ d + w2 and ḋ = ω − β d, where d is how far the course is from the one held, which follows it slowly:
course rate is white noise through the second-order shaping filter by which T. I. Fossen (Handbook of Marine Craft
Hydrodynamics and Motion Control, 2nd ed., §10.2) describes motion in waves, with natural frequency √κ. The five-state
prediction stays as it is: half of what d does to the rate goes before it and half after (G. Strang, SIAM J. Numerical
Analysis 5(3), 1968), and over the step itself the course held stands still. The push is what gives the oscillation
its true period whatever the step.
"""

import math

from steerway.core.compiled import lean_kernel
from steerway.estimation.course.acceleration import give, predict_accelerating
from steerway.estimation.course.model import COURSE, DT, RATE, YAWING_DECAY, YAWING_STATE, YAWING_STIFFNESS


@lean_kernel
def predict_underway(x, p, step, model):
    """`five_state.predict`, with acceleration and yawing where the model has them."""
    d = int(model[YAWING_STATE])
    if d:
        push, left = pushes(step, model)
        give(x, p, RATE, d, push)
        fade(x, p, d, left)
        exchange(x, p, d)
    predict_accelerating(x, p, step, model)
    if d:
        exchange(x, p, d)
        fade(x, p, d, left)
        give(x, p, RATE, d, push)


@lean_kernel
def pushes(step, model):
    """In half a step: what a unit of d gives to the course rate, and what is left of d."""
    half = 0.5 * step[DT]
    if half == 0.0:
        return 0.0, 1.0
    return -(math.sin(math.sqrt(model[YAWING_STIFFNESS]) * half) ** 2) / half, math.exp(-model[YAWING_DECAY] * half)


@lean_kernel
def exchange(x, p, d):
    """d ← χ − d: the course held for the deviation from it, or the reverse (upper triangle of P)."""
    p[d, d] += p[COURSE, COURSE] - 2.0 * p[COURSE, d]
    x[d] = x[COURSE] - x[d]
    for i in range(d):
        p[i, d] = p[min(i, COURSE), max(i, COURSE)] - p[i, d]
    for j in range(d + 1, len(x)):
        p[d, j] = p[COURSE, j] - p[d, j]


@lean_kernel
def fade(x, p, d, left):
    """d ← left · d."""
    x[d] *= left
    for i in range(d + 1):
        p[i, d] *= left
    for j in range(d, len(x)):
        p[d, j] *= left


@lean_kernel
def yaw_transition(f, push, left, d):
    """F of `predict_underway` in place, from that of what it does between the two halves (n, n)."""
    for i in range(len(f)):
        f[i, COURSE] += f[i, d]
        f[i, d] = push * f[i, RATE] - left * f[i, d]
    for j in range(len(f)):
        f[d, j] = left * (f[COURSE, j] - f[d, j])
        f[RATE, j] += push * f[d, j]
