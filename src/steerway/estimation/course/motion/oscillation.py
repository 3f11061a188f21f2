"""Wave-induced yaw: the course oscillates about a mean course that the vessel is steered back to.

ω̇ = −α2 ω − κ d + w2 and ḋ = ω − β d, where d is the deviation from the mean course, which follows slowly: course rate
is white noise through the second-order shaping filter by which T. I. Fossen (Handbook of Marine Craft Hydrodynamics
and Motion Control, 2nd ed., §10.2) describes motion in waves, with natural frequency √κ. The prediction is Strang's
splitting (SIAM J. Numerical Analysis 5(3), 1968): half of what d does to the rate before the prediction without it,
half after; over the step itself the mean course is constant. The factor `pushes` makes the period exact for any step.
"""

import math

from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.estimation.course.motion.acceleration import add_share
from steerway.estimation.course.motion.acceleration import predict as predict_accelerating
from steerway.estimation.course.motion.five_state import LARGEST_START_RATE_STD
from steerway.estimation.course.motion.five_state import predict as predict_five_states
from steerway.estimation.course.motion.layout import (
    ACCELERATION_STATE,
    COURSE,
    DT,
    LONGEST_STEP,
    OSCILLATION_DECAY,
    OSCILLATION_STATE,
    OSCILLATION_STIFFNESS,
    RATE,
    RATE_DECAY,
    RATE_NOISE,
    START_RATE_VARIANCE,
)

_LONGEST_STEP = 0.5
"""s: a sixth of the shortest period, in which an oscillation turns by a radian."""


def pack(profile, row, add_state) -> bool:
    """Fill a row of parameters; False for a profile without wave-induced yaw."""
    if profile.yawing_period == 0.0:
        return False
    stiffness, follows = (2.0 * math.pi / profile.yawing_period) ** 2, 1.0 / profile.yawing_time
    decay = profile.course_rate_decay
    # Stationary variances of the deviation and of the course rate, from the Lyapunov equation.
    per_deviation = stiffness + (decay + follows) * follows
    deviation = profile.course_rate_noise / (2.0 * (stiffness * follows + decay * per_deviation))
    row[OSCILLATION_STATE] = add_state(0.0, 0.0, deviation)
    row[OSCILLATION_STIFFNESS], row[OSCILLATION_DECAY] = stiffness, follows
    row[START_RATE_VARIANCE] = min(math.sqrt(per_deviation * deviation), LARGEST_START_RATE_STD) ** 2
    row[LONGEST_STEP] = _LONGEST_STEP
    return True


@called_kernel
def predict(x, p, step, parameters):
    """x ← f(x), P ← F P Fᵀ + Q in place."""
    d = int(parameters[OSCILLATION_STATE])
    push, left = pushes(step, parameters)
    add_share(x, p, RATE, d, push)
    scale(x, p, d, left)
    exchange(x, p, d)
    if parameters[ACCELERATION_STATE]:
        predict_accelerating(x, p, step, parameters)
    else:
        predict_five_states(x, p, step, parameters)
    exchange(x, p, d)
    scale(x, p, d, left)
    add_share(x, p, RATE, d, push)


@lean_kernel
def pushes(step, parameters):
    """In half a step: what a unit of d adds to the course rate, and what is left of d."""
    half = 0.5 * step[DT]
    if half == 0.0:
        return 0.0, 1.0
    swing = math.sin(math.sqrt(parameters[OSCILLATION_STIFFNESS]) * half)
    return -(swing**2) / half, math.exp(-parameters[OSCILLATION_DECAY] * half)


@lean_kernel
def exchange(x, p, d):
    """d ← χ − d: the mean course for the deviation from it, or the reverse (upper triangle of P)."""
    p[d, d] += p[COURSE, COURSE] - 2.0 * p[COURSE, d]
    x[d] = x[COURSE] - x[d]
    for i in range(d):
        p[i, d] = p[min(i, COURSE), max(i, COURSE)] - p[i, d]
    for j in range(d + 1, p.shape[1]):
        p[d, j] = p[COURSE, j] - p[d, j]


@lean_kernel
def scale(x, p, d, left):
    """d ← left · d."""
    x[d] *= left
    for i in range(d + 1):
        p[i, d] *= left
    for j in range(d, p.shape[1]):
        p[d, j] *= left


@kernel
def long_run(x, p, parameters):
    """Parameters of the five-state model that disperses as far over many periods; x and P become those of its course.

    Over more than a period d is white noise, of the density of w2 over (κ + α2 β)², and the mean course follows it.
    """
    d, follows, loss = int(parameters[OSCILLATION_STATE]), parameters[OSCILLATION_DECAY], parameters[RATE_DECAY]
    add_share(x, p, COURSE, d, -1.0)
    x[RATE] = 0.0
    for i in range(RATE):
        p[i, RATE] = 0.0
    mean = parameters.copy()
    mean[RATE_DECAY] = loss + follows
    mean[RATE_NOISE] *= (follows * (loss + follows) / (parameters[OSCILLATION_STIFFNESS] + loss * follows)) ** 2
    p[RATE, RATE] = 0.5 * mean[RATE_NOISE] / mean[RATE_DECAY]
    return mean
