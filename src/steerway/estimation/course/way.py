"""Way: whether the vessel has any. Below steerageway course means nothing, and the filter says so.

Adrift, the state is [x^n y^n v_N v_E ω_χ]: a linear filter, which no speed can mislead. From a diffuse velocity it is
the straight-line fit through the first fixes; at a standstill it has no course to lose. When the velocity stands four
of its standard deviations above zero the vessel is under way and the state is [x^n y^n U χ ω_χ] of P0.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import lean_kernel
from steerway.estimation.course.five_state import predict_extras
from steerway.estimation.course.model import (
    ACCELERATION_STATE,
    ADRIFT,
    COURSE,
    DT,
    EAST,
    ERROR_PAIRS,
    ERROR_STATE,
    EXTRAS,
    FIRST,
    LOST_COURSE_VARIANCE,
    MODE,
    NORTH,
    POSITION_VARIANCE,
    RATE,
    SPEED,
    SPEED_INTEGRAL,
    SPEED_LEFT,
    SPEED_NOISE,
    START_RATE_VARIANCE,
    START_SPEED_VARIANCE,
    STARTING,
    STEERAGEWAY,
    UNDERWAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
    YAWING_STATE,
)
from steerway.estimation.course.position_update import place_by_fix

GATHERED = 4.0
"""Standard deviations above zero at which a velocity has a direction."""
LOST = 2.0
"""Standard deviations above zero below which it has none any more."""
GATHERING_TIME = 10.0
"""s in which a vessel at rest may gather steerageway: adrift, its velocity walks so fast whatever S_U is."""
TOLD = 0.5
"""m/s: a velocity known so well is known, and if it has no direction then the vessel has no way."""


@lean_kernel
def start(x, p, book, north, east, doubt, model):
    """Begin from one fix: at its place, with a velocity about which nothing is known."""
    n = len(x)
    for i in range(n):
        x[i] = 0.0
        for j in range(i, n):
            p[i, j] = 0.0
    for j in range(5, n):
        p[j, j] = model[EXTRAS + 3 * (j - 5) + 2]
    take_place(x, p, north, east, doubt, model)
    p[2, 2] = p[3, 3] = model[START_SPEED_VARIANCE]
    p[4, 4] = model[START_RATE_VARIANCE]
    book[MODE] = FIRST


@lean_kernel
def take_place(x, p, north, east, doubt, model):
    """Take the position from one fix, and keep what is known of everything else."""
    g, pairs = int(model[ERROR_STATE]), int(model[ERROR_PAIRS])
    x[NORTH], x[EAST] = north, east
    if g:
        for i in range(g, g + 2 * pairs, 2):
            x[NORTH] -= x[i]
            x[EAST] -= x[i + 1]
    variance = doubt * model[POSITION_VARIANCE]
    place_by_fix(p, variance, variance, g, pairs)


@lean_kernel
def predict_adrift(x, p, step, model):
    """Velocity as a random walk along either axis; the course rate is not carried."""
    n = len(x)
    dt, left, integral = step[DT], step[SPEED_LEFT], step[SPEED_INTEGRAL]
    density = model[SPEED_NOISE] + model[STEERAGEWAY] ** 2 / GATHERING_TIME
    x[NORTH] += integral * x[VELOCITY_NORTH]
    x[EAST] += integral * x[VELOCITY_EAST]
    x[VELOCITY_NORTH] *= left
    x[VELOCITY_EAST] *= left
    p[0, 0] += integral * (2.0 * p[0, 2] + integral * p[2, 2]) + density * dt**3 / 3.0
    p[1, 1] += integral * (2.0 * p[1, 3] + integral * p[3, 3]) + density * dt**3 / 3.0
    p[0, 1] += integral * (p[0, 3] + p[1, 2] + integral * p[2, 3])
    p[0, 2] = left * (p[0, 2] + integral * p[2, 2]) + 0.5 * density * dt * dt
    p[1, 3] = left * (p[1, 3] + integral * p[3, 3]) + 0.5 * density * dt * dt
    p[0, 3] = left * (p[0, 3] + integral * p[2, 3])
    p[1, 2] = left * (p[1, 2] + integral * p[2, 3])
    p[2, 2] = left * left * p[2, 2] + density * dt
    p[3, 3] = left * left * p[3, 3] + density * dt
    p[2, 3] *= left * left
    for j in range(5, n):
        p[0, j] += integral * p[2, j]
        p[1, j] += integral * p[3, j]
        p[2, j] *= left
        p[3, j] *= left
    predict_extras(x, p, step)


@lean_kernel
def mix_velocity(p, a, b, c, d):
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
    mix_velocity(p, c, s, -s / speed, c / speed)


@lean_kernel
def course_to_velocity(x, p):
    """(U, χ) → (v_N, v_E) in place."""
    speed, c, s = x[SPEED], math.cos(x[COURSE]), math.sin(x[COURSE])
    x[VELOCITY_NORTH], x[VELOCITY_EAST] = speed * c, speed * s
    mix_velocity(p, c, -speed * s, s, speed * c)


@lean_kernel
def forget_manoeuvre(x, p, model):
    """Course rate, acceleration and yawing are zero, give or take what a vessel does."""
    forget(x, p, RATE, model[START_RATE_VARIANCE])
    for k in (int(model[ACCELERATION_STATE]), int(model[YAWING_STATE])):
        if k:
            forget(x, p, k, model[EXTRAS + 3 * (k - 5) + 2])


@lean_kernel
def forget(x, p, k, variance):
    """State k is zero, give or take, and has nothing to do with the others."""
    x[k] = 0.0
    for i in range(k):
        p[i, k] = 0.0
    for j in range(k + 1, len(x)):
        p[k, j] = 0.0
    p[k, k] = variance


@lean_kernel
def fold(x, p):
    """U ≥ 0 and χ in [−π, π): a vessel that runs backwards runs forwards on the opposite course."""
    if x[SPEED] < 0.0:
        x[SPEED] = -x[SPEED]
        x[COURSE] += math.pi
        for i in range(SPEED):
            p[i, SPEED] = -p[i, SPEED]
        for j in range(SPEED + 1, len(x)):
            p[SPEED, j] = -p[SPEED, j]
    x[COURSE] = wrap(x[COURSE])


@lean_kernel
def judge(x, p, book, model):
    """Gain or lose way after an update or a prediction."""
    if book[MODE] == UNDERWAY:
        speed_too_low = x[SPEED] < max(LOST * math.sqrt(p[2, 2]), 0.5 * model[STEERAGEWAY])
        if p[3, 3] > LOST_COURSE_VARIANCE:
            course_to_velocity(x, p)
            forget_manoeuvre(x, p, model)
            forget_velocity(x, p, model)
            book[MODE] = ADRIFT
        elif speed_too_low:
            course_to_velocity(x, p)
            forget_manoeuvre(x, p, model)
            book[MODE] = ADRIFT
        return
    variance = 0.5 * (p[2, 2] + p[3, 3])
    if book[MODE] == FIRST:
        # Two fixes make a velocity of any outlier; a third has to agree with it.
        if variance < 0.5 * model[START_SPEED_VARIANCE]:
            book[MODE] = STARTING
        return
    speed_squared = x[VELOCITY_NORTH] ** 2 + x[VELOCITY_EAST] ** 2
    if speed_squared > max(GATHERED**2 * variance, model[STEERAGEWAY] ** 2):
        velocity_to_course(x, p)
        forget_manoeuvre(x, p, model)
        book[MODE] = UNDERWAY
    elif variance < TOLD**2:
        book[MODE] = ADRIFT


@lean_kernel
def forget_velocity(x, p, model):
    """Nothing is known of the velocity (its last value stays the best guess)."""
    for k in (VELOCITY_NORTH, VELOCITY_EAST):
        for i in range(k):
            p[i, k] = 0.0
        for j in range(k + 1, len(x)):
            p[k, j] = 0.0
        p[k, k] = model[START_SPEED_VARIANCE]
