"""A mode relative to another: means as an error at an origin, covariances in its frame."""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.inference.model import COURSE, SPEED
from steerway.estimation.inference.motion import turn_pair

_STEADY = 3.0
"""Speed in its standard deviations, or in those across the course, above which velocities are compared, averaged and
corrected as speeds and courses, not as vectors. Chosen: the course is then known to a third of a radian, or the speed
to a third of itself and the course within a radian."""


@lean_kernel
def is_steady(speed, along, across):
    """Whether velocities near this one, of these variances (m²/s²), are compared as speeds and courses.

    A turn leaves the speed as it is: as vectors, velocities that differ by their courses alone have a slower mean.
    """
    way = speed * speed
    return way > _STEADY**2 * across or way > max(_STEADY**2 * along, across)


@called_kernel
def from_likeliest(x, p, probability, d):
    """All modes as errors d (m, n) at the likeliest, their covariances in its frame. Returns it, and `is_steady`."""
    m = x.shape[0]
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
        turned(p, k, difference(x, k, x[reference], steady, d[k]))
    return reference, steady


@called_kernel
def difference(x, k, origin, steady, out):
    """x[k] − origin (n,) as an error at `origin`. Returns the angle by which the covariance of x[k] turns."""
    n = x.shape[1]
    for i in range(n):
        out[i] = x[k, i] - origin[i]
    bend = wrap(x[k, COURSE] - origin[COURSE])
    if steady:
        out[COURSE] = origin[SPEED] * bend
        return 0.0
    out[SPEED] = x[k, SPEED] * math.cos(bend) - origin[SPEED]
    out[COURSE] = x[k, SPEED] * math.sin(bend)
    return bend


@called_kernel
def shifted(origin, error, steady, x, p, k):
    """x[k] ← origin + error (n,), with p[k] given at `origin`."""
    n = x.shape[1]
    along, across = origin[SPEED] + error[SPEED], error[COURSE]
    for i in range(n):
        if i != SPEED and i != COURSE:
            x[k, i] = origin[i] + error[i]
    if steady and along > 0.0:
        x[k, SPEED] = along
        x[k, COURSE] = wrap(origin[COURSE] + across / origin[SPEED])
        return
    angle = math.atan2(across, along)
    x[k, SPEED] = math.hypot(along, across)
    x[k, COURSE] = wrap(origin[COURSE] + angle)
    turn_pair(p, k, SPEED, math.cos(angle), -math.sin(angle))
    for i in range(n):
        for j in range(i):
            p[k, i, j] = p[k, j, i]


@called_kernel
def turned(p, k, angle):
    """The covariance p[k] in a body frame turned back by an angle."""
    if angle != 0.0:
        turn_pair(p, k, SPEED, math.cos(angle), math.sin(angle))
        for i in range(p.shape[1]):
            for j in range(i):
                p[k, i, j] = p[k, j, i]
