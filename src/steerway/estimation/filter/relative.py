"""A mode relative to another: means as an error at an origin, covariances in its frame."""

import math

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.filter.model import COURSE, SPEED
from steerway.estimation.filter.motion import turn_pair

_STEADY = 3.0
"""Speed in its standard deviations, or in those across the course, above which velocities are compared, averaged and
corrected as speeds and courses, not as vectors. Chosen: the course is then known to a third of a radian, or the speed
to a third of itself and the course within a radian."""
_ROUND, _SMALL = 0.5, 5.0
"""Ratio of the variances along and across the course above which a velocity is known as a vector, as after a start,
rather than as speed and course; of such a one, deviations across above which the two differ too little to matter.
Chosen: the angle is then a fifth of a radian, and what a turn adds to a vector a tenth of a deviation."""


@lean_kernel
def is_steady(speed: float, along: float, across: float) -> bool:
    """Whether velocities near this one, of these variances (m²/s²), are compared as speeds and courses.

    A turn leaves the speed as it is: as vectors, velocities that differ by their courses alone have a slower mean.
    """
    way = speed * speed
    return way > _STEADY**2 * across or way > max(_STEADY**2 * along, across)


@called_kernel
def from_likeliest(x: Floats, p: Floats, probability: Floats, errors: Floats) -> tuple[int, bool]:
    """All modes as errors (m, ≥ n) at the likeliest, their covariances in its frame. Returns it, and `is_steady`."""
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
    """x − origin (n,) as an error at `origin`. Returns the angle by which the covariance of x turns."""
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
    """The covariance p in a body frame turned back by an angle."""
    if angle != 0.0:
        turn_pair(p, SPEED, math.cos(angle), math.sin(angle))
        fill_lower(p)


@called_kernel
def corrected(x: Floats, p: Floats, error: Floats, alone: bool) -> None:
    """x ← x + error (n,), which has p: its velocity as a turn where a vessel has way, else as a vector.

    The fixes after a start tell a velocity, not a speed and a course: turned without its covariance, such a one would
    no longer be the line through them.
    alone: whether there is no other mode. What is known of the course then stays as it is when the speed is corrected,
    as in the five-state filter, and of the velocity across changes with the speed. Modes that are mixed keep what they
    know of the velocity: with five of them courses in turns are better by 4 % so, after an emergency stop by 8 %.
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
    """Scale the velocity across the course in a covariance."""
    for i in range(len(p)):
        p[i, COURSE] *= factor
    for i in range(len(p)):
        p[COURSE, i] *= factor
