"""A position update that rotates with the course: the left-invariant form on SE(2).

A. Barrau and S. Bonnabel, IEEE Trans. Automatic Control 62(4), 2017. An error of the course does not turn into one of
the speed. Error states of the receiver rotate too, so that their sum with the position stays as certain as it was.
"""

import math

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.course.motion.layout import COURSE

_SMALL_ANGLE = 1e-6
"""rad below which (1 − cos a)/a is a/2 to double precision."""


@called_kernel
def rotate_correction(x: Floats, p: Floats, before: Floats, g: int, pairs: int) -> None:
    """Turn a linear correction of the state `before` into x and P into one of a pose in the plane."""
    angle = x[COURSE] - before[COURSE]
    c, s = math.cos(angle), math.sin(angle)
    along, across = (s / angle, (1.0 - c) / angle) if abs(angle) > _SMALL_ANGLE else (1.0, 0.5 * angle)
    for pair in range(1 + pairs if g else 1):  # the position, and the errors of the receiver
        _rotate_pair(x, p, before, g + 2 * (pair - 1) if pair else 0, c, s, along, across)


@lean_kernel
def _rotate_pair(x, p, before, a, c, s, along, across):
    """The states a and a + 1 of `rotate_correction`."""
    north, east = x[a] - before[a], x[a + 1] - before[a + 1]
    x[a] = before[a] + along * north - across * east
    x[a + 1] = before[a + 1] + across * north + along * east
    rotate_covariance(p, a, c, s)


@lean_kernel
def rotate_covariance(p, a, c, s):
    """P ← J P Jᵀ in place, J a rotation of the states a and a + 1."""
    b = a + 1
    for i in range(a):
        p[i, a], p[i, b] = c * p[i, a] - s * p[i, b], s * p[i, a] + c * p[i, b]
    for j in range(a + 2, p.shape[1]):
        p[a, j], p[b, j] = c * p[a, j] - s * p[b, j], s * p[a, j] + c * p[b, j]
    aa, ab, bb = p[a, a], p[a, b], p[b, b]
    p[a, a] = c * c * aa - 2.0 * c * s * ab + s * s * bb
    p[a, b] = c * s * (aa - bb) + (c * c - s * s) * ab
    p[b, b] = s * s * aa + 2.0 * c * s * ab + c * c * bb
