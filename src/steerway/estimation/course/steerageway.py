"""Steerageway: below it course is not defined, and the filter estimates velocity along two axes instead.

Phases of a filter: at first and at low speed the state is [x^n y^n v_N v_E ω_χ] (see `motion.low_speed`). When the
velocity exceeds a multiple of its standard deviation the vessel is under way, with the state [x^n y^n U χ ω_χ].
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.kalman import place_by_fix
from steerway.estimation.course.motion.layout import (
    COURSE,
    EAST,
    ERROR_PAIRS,
    ERROR_STATE,
    EXTRAS,
    FIRST,
    LOST_COURSE_VARIANCE,
    LOW_SPEED,
    MOTION_STATES,
    NORTH,
    PHASE,
    POSITION_VARIANCE,
    RATE,
    SPEED,
    START_RATE_VARIANCE,
    START_SPEED_VARIANCE,
    STARTING,
    STEERAGEWAY,
    UNDER_WAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
)

COURSE_GAINED = 4.0
"""Standard deviations of a velocity above zero at which course is defined: it is then known to a quarter of a radian,
where the linearised course is in error by 3 % of that."""
COURSE_LOST = 2.0
"""Standard deviations below which it no longer is; the gap to `COURSE_GAINED` keeps the phase from alternating. Chosen:
half of it."""
KNOWN_VELOCITY_STD = 0.5
"""m/s: with a velocity known this well and not above `COURSE_GAINED` the start is over, at low speed. Chosen: a
vessel of 2 m/s would have a course."""


@called_kernel
def start(x, p, flags, north, east, variance_scale, parameters):
    """Start from one fix: its position, and a diffuse velocity."""
    n = len(x)
    for i in range(n):
        x[i] = 0.0
        for j in range(i, n):
            p[i, j] = 0.0
    for j in range(5, n):
        p[j, j] = parameters[EXTRAS + 3 * (j - 5) + 2]
    set_position(x, p, north, east, variance_scale, parameters)
    p[2, 2] = p[3, 3] = parameters[START_SPEED_VARIANCE]
    p[4, 4] = parameters[START_RATE_VARIANCE]
    flags[PHASE] = FIRST


@called_kernel
def set_position(x, p, north, east, variance_scale, parameters):
    """Set the position to one fix, and keep all other states."""
    g, pairs = int(parameters[ERROR_STATE]), int(parameters[ERROR_PAIRS])
    x[NORTH], x[EAST] = north, east
    if g:
        for i in range(g, g + 2 * pairs, 2):
            x[NORTH] -= x[i]
            x[EAST] -= x[i + 1]
    variance = variance_scale * parameters[POSITION_VARIANCE]
    place_by_fix(p, variance, variance, g, pairs)


@lean_kernel
def transform_velocity(p, a, b, c, d):
    """P ← J P Jᵀ in place, J = [[a, b], [c, d]] on the third and fourth state."""
    n = p.shape[1]
    for i in range(2):
        p[i, 2], p[i, 3] = a * p[i, 2] + b * p[i, 3], c * p[i, 2] + d * p[i, 3]
    for j in range(4, n):
        p[2, j], p[3, j] = a * p[2, j] + b * p[3, j], c * p[2, j] + d * p[3, j]
    p22, p23, p33 = p[2, 2], p[2, 3], p[3, 3]
    p[2, 2] = a * a * p22 + 2.0 * a * b * p23 + b * b * p33
    p[2, 3] = a * c * p22 + (a * d + b * c) * p23 + b * d * p33
    p[3, 3] = c * c * p22 + 2.0 * c * d * p23 + d * d * p33


@lean_kernel
def velocity_to_course(x, p):
    """(v_N, v_E) → (U, χ) in place."""
    north, east = x[VELOCITY_NORTH], x[VELOCITY_EAST]
    speed = math.hypot(north, east)
    c, s = north / speed, east / speed
    x[SPEED], x[COURSE] = speed, math.atan2(east, north)
    transform_velocity(p, c, s, -s / speed, c / speed)


@lean_kernel
def course_to_velocity(x, p):
    """(U, χ) → (v_N, v_E) in place."""
    speed, c, s = x[SPEED], math.cos(x[COURSE]), math.sin(x[COURSE])
    x[VELOCITY_NORTH], x[VELOCITY_EAST] = speed * c, speed * s
    transform_velocity(p, c, -speed * s, s, speed * c)


@lean_kernel
def reset_manoeuvre(x, p, parameters):
    """Course rate and the states of the motion model beyond it become zero with their initial variances."""
    reset_state(x, p, RATE, 0.0, parameters[START_RATE_VARIANCE])
    for k in range(int(parameters[MOTION_STATES]), len(x)):
        reset_state(x, p, k, 0.0, parameters[EXTRAS + 3 * (k - 5) + 2])


@lean_kernel
def reset_state(x, p, k, value, variance):
    """State k becomes a value with a variance, independent of the others."""
    x[k] = value
    for i in range(k):
        p[i, k] = 0.0
    for j in range(k + 1, len(x)):
        p[k, j] = 0.0
    p[k, k] = variance


@lean_kernel
def fold(x, p):
    """U ≥ 0 and χ in [−π, π): a negative speed is a positive one on the opposite course."""
    if x[SPEED] < 0.0:
        x[SPEED] = -x[SPEED]
        x[COURSE] += math.pi
        for i in range(SPEED):
            p[i, SPEED] = -p[i, SPEED]
        for j in range(SPEED + 1, len(x)):
            p[SPEED, j] = -p[SPEED, j]
    x[COURSE] = wrap(x[COURSE])


@lean_kernel
def update_phase(x, p, flags, parameters):
    """Change between low speed and under way, after an update or a prediction."""
    if flags[PHASE] == UNDER_WAY:
        lost = p[3, 3] > LOST_COURSE_VARIANCE
        slow = x[SPEED] < max(COURSE_LOST * math.sqrt(p[2, 2]), 0.5 * parameters[STEERAGEWAY])
        if lost or slow:
            course_to_velocity(x, p)
            reset_manoeuvre(x, p, parameters)
            if lost:
                for i in range(VELOCITY_NORTH, VELOCITY_EAST + 1):
                    reset_state(x, p, i, x[i], parameters[START_SPEED_VARIANCE])
            flags[PHASE] = LOW_SPEED
        return
    variance = 0.5 * (p[2, 2] + p[3, 3])
    if flags[PHASE] == FIRST:
        # Two fixes make a velocity of any outlier; a third has to agree with it.
        if variance < 0.5 * parameters[START_SPEED_VARIANCE]:
            flags[PHASE] = STARTING
        return
    speed_squared = x[VELOCITY_NORTH] ** 2 + x[VELOCITY_EAST] ** 2
    if speed_squared > max(COURSE_GAINED**2 * variance, parameters[STEERAGEWAY] ** 2):
        velocity_to_course(x, p)
        reset_manoeuvre(x, p, parameters)
        flags[PHASE] = UNDER_WAY
    elif variance < KNOWN_VELOCITY_STD**2:
        flags[PHASE] = LOW_SPEED
