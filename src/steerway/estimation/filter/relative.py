"""One mode relative to another: its mean as a difference from the other's mean, its covariance in the other's frame."""

import math

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.filter.model import COURSE, SPEED
from steerway.estimation.filter.motion import turn_pair

_STEADY = 3.0
"""Speed over its σ, or over the σ across the course, above which velocities are compared, averaged and corrected as
speeds and courses, not as vectors. At this limit the course has a σ of a third of a radian."""
_ROUND, _SMALL = 0.5, 5.0
"""First: ratio of the variances along and across the course above which a velocity is corrected as a vector, as after a
start. Second: speed over its σ across the course above which it is nevertheless corrected as speed and course. The
course then has a σ of a fifth of a radian, and the two corrections differ by a tenth of a σ."""


@lean_kernel
def is_steady(speed: float, along: float, across: float) -> bool:
    """Whether velocities near this one are compared as speeds and courses, not as vectors.

    The mean of velocity vectors of one speed on different courses is slower. along, across: variances (m²/s²).
    """
    way = speed * speed
    return way > _STEADY**2 * across or way > max(_STEADY**2 * along, across)


@called_kernel
def from_likeliest(x: Floats, p: Floats, probability: Floats, errors: Floats) -> tuple[int, bool]:
    """errors (m, ≥ n) ← all modes relative to the likeliest; p ← their covariances in its frame.

    Returns the number of the likeliest mode, and `is_steady` of the mixture.
    """
    m = len(x)
    reference = 0
    for k in range(1, m):
        if probability[k] > probability[reference]:
            reference = k
    across = along = 0.0
    for k in range(m):
        bend = wrap(x[k, COURSE] - x[reference, COURSE])
        across += probability[k] * (p[k, 3, 3] + (x[k, SPEED] * bend) ** 2)
        along += probability[k] * (p[k, 2, 2] + (x[k, SPEED] - x[reference, SPEED]) ** 2)
    steady = is_steady(x[reference, SPEED], along, across)
    for k in range(m):
        turned(p[k], difference(x[k], x[reference], steady, errors[k]))
    return reference, steady


@called_kernel
def difference(x: Floats, origin: Floats, steady: bool, error: Floats) -> float:
    """error ← x − origin (n,), in the frame of `origin`. Returns the angle (rad) by which the covariance of x turns."""
    for i in range(len(x)):
        error[i] = x[i] - origin[i]
    bend = wrap(x[COURSE] - origin[COURSE])
    if steady:
        error[COURSE] = origin[SPEED] * bend
        return 0.0
    error[SPEED] = x[SPEED] * math.cos(bend) - origin[SPEED]
    error[COURSE] = x[SPEED] * math.sin(bend)
    return bend


@called_kernel
def shifted(origin: Floats, error: Floats, steady: bool, x: Floats, p: Floats) -> None:
    """x ← origin + error (n,), with p given at `origin`."""
    along, across = origin[SPEED] + error[SPEED], error[COURSE]
    for i in range(len(x)):
        if i != SPEED and i != COURSE:
            x[i] = origin[i] + error[i]
    if steady and along > 0.0:
        x[SPEED] = along
        x[COURSE] = wrap(origin[COURSE] + across / origin[SPEED])
        return
    angle = math.atan2(across, along)
    x[SPEED] = math.hypot(along, across)
    x[COURSE] = wrap(origin[COURSE] + angle)
    turn_pair(p, SPEED, math.cos(angle), -math.sin(angle))
    fill_lower(p)


@called_kernel
def turned(p: Floats, angle: float) -> None:
    """p ← covariance in a frame that is turned back by an angle (rad)."""
    if angle != 0.0:
        turn_pair(p, SPEED, math.cos(angle), math.sin(angle))
        fill_lower(p)


@called_kernel
def corrected(x: Floats, p: Floats, error: Floats, alone: bool) -> None:
    """x ← x + error (n,) with p, its covariance: the velocity by speed and course under way, else as a vector.

    The first fixes determine a velocity vector. Corrected by speed and course, with its covariance not turned, it would
    leave the line through these fixes.

    alone: whether there is no other mode. If so, a corrected speed keeps the variance of the course, as in the
    five-state filter, and scales that of the velocity across. With several modes, the variance of the velocity is kept:
    errors of the course are then 4 % smaller in turns and 8 % after an emergency stop (five modes).
    """
    speed, along, across = x[SPEED], error[SPEED], error[COURSE]
    for i in range(len(x)):
        if i != SPEED and i != COURSE:
            x[i] += error[i]
    furthest = max(p[3, 3], across * across)
    steady = is_steady(speed, max(p[2, 2], along * along), furthest)
    if p[2, 2] > _ROUND * p[3, 3]:
        steady = speed * speed > _SMALL**2 * furthest
    if steady and speed > 0.0 and speed + along > 0.0:
        x[SPEED] = speed + along
        x[COURSE] = wrap(x[COURSE] + across / speed)
        if alone:
            widen(p, (speed + along) / speed)
        return
    angle = math.atan2(across, speed + along)
    x[SPEED] = math.hypot(speed + along, across)
    x[COURSE] = wrap(x[COURSE] + angle)
    turn_pair(p, SPEED, math.cos(angle), -math.sin(angle))
    fill_lower(p)


@lean_kernel
def widen(p: Floats, factor: float) -> None:
    """Scale the velocity across the course in a covariance by a factor."""
    for i in range(len(p)):
        p[i, COURSE] *= factor
    for i in range(len(p)):
        p[COURSE, i] *= factor
