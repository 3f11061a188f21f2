"""What a fix does to one mode: innovation, density, correction.

A fix is the position, plus the states of the receiver's errors, plus the antenna's way athwart, plus the way that is
made good until it is measured, plus white noise; or it is an outlier. Both are weighed (probabilistic data association:
Y. Bar-Shalom and X. R. Li, Multitarget-Multisensor Tracking, 1995, §3.4): the correction is the mean of both and its
covariance holds their spread.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel
from steerway.estimation.inference.model import (
    ACTS_ON,
    COURSE,
    EAST,
    NORTH,
    ON_ANTENNA,
    ON_FIX,
    ON_TIME,
    SPEED,
    STATE,
)
from steerway.estimation.inference.motion import turn_pair
from steerway.estimation.inference.relative import is_steady

_ROUND, _SMALL = 0.5, 5.0
"""Ratio of the variances along and across the course above which a velocity is known as a vector, as after a start,
rather than as speed and course; of such a one, deviations across above which the two differ too little to matter.
Chosen: the angle is then a fifth of a radian, and what a turn adds to a vector a tenth of a deviation."""


@called_kernel
def project(x, p, k, filters, c, s, out_n, out_e):
    """Predicted fix (north, east) of mode k; its covariance with the state, P Hᵀ, into two vectors (n,).

    (c, s): cosine and sine of its course.
    """
    n = x.shape[1]
    north, east = x[k, NORTH], x[k, EAST]
    for i in range(n):
        out_n[i] = p[k, NORTH, i]
        out_e[i] = p[k, EAST, i]
    for f in range(len(filters)):
        j = int(filters[f, STATE])
        if filters[f, ACTS_ON] == ON_FIX:
            north += x[k, j]
            east += x[k, j + 1]
            for i in range(n):
                out_n[i] += p[k, j, i]
                out_e[i] += p[k, j + 1, i]
        elif filters[f, ACTS_ON] == ON_ANTENNA:
            north -= s * x[k, j]
            east += c * x[k, j]
            for i in range(n):
                out_n[i] -= s * p[k, j, i]
                out_e[i] += c * p[k, j, i]
        elif filters[f, ACTS_ON] == ON_TIME:
            v_n, v_e = x[k, SPEED] * c, x[k, SPEED] * s
            north += v_n * x[k, j]
            east += v_e * x[k, j]
            for i in range(n):
                out_n[i] += v_n * p[k, j, i]
                out_e[i] += v_e * p[k, j, i]
    return north, east


@called_kernel
def of_fix(speed, filters, c, s, vector_n, vector_e):
    """(H v_n)_N, (H v_n)_E, (H v_e)_E of two vectors over the states: the covariance of a predicted fix.

    (c, s): cosine and sine of the course.
    """
    nn, ne, ee = vector_n[NORTH], vector_n[EAST], vector_e[EAST]
    for f in range(len(filters)):
        j = int(filters[f, STATE])
        if filters[f, ACTS_ON] == ON_FIX:
            nn += vector_n[j]
            ne += vector_n[j + 1]
            ee += vector_e[j + 1]
        elif filters[f, ACTS_ON] == ON_ANTENNA:
            nn -= s * vector_n[j]
            ne += c * vector_n[j]
            ee += c * vector_e[j]
        elif filters[f, ACTS_ON] == ON_TIME:
            v_n, v_e = speed * c, speed * s
            nn += v_n * vector_n[j]
            ne += v_e * vector_n[j]
            ee += v_e * vector_e[j]
    return nn, ne, ee


@called_kernel
def correct(x, p, k, pc_n, pc_e, m_nn, m_ne, m_ee, s_n, s_e):
    """Correct mode k: x ← x + C s and P ← P − C M Cᵀ, with C = [pc_n pc_e] (n, 2) of `project`."""
    n = x.shape[1]
    for i in range(n):
        a, b = pc_n[i] * m_nn + pc_e[i] * m_ne, pc_n[i] * m_ne + pc_e[i] * m_ee
        for j in range(n):
            p[k, i, j] -= a * pc_n[j] + b * pc_e[j]
    along = pc_n[SPEED] * s_n + pc_e[SPEED] * s_e
    across = pc_n[COURSE] * s_n + pc_e[COURSE] * s_e
    for i in range(n):
        if i != SPEED and i != COURSE:
            x[k, i] += pc_n[i] * s_n + pc_e[i] * s_e
    if turn_velocity(x, p, k, along, across):
        for i in range(n):
            for j in range(i):
                p[k, i, j] = p[k, j, i]


@called_kernel
def turn_velocity(x, p, k, along, across):
    """Add (along, across) to the velocity: as a turn where a vessel has way, else as a vector (upper triangle).

    The fixes after a start tell a velocity, not a speed and a course: turned without its covariance, such a one would
    no longer be the line through them.

    Returns whether the covariance has turned.
    """
    speed = x[k, SPEED]
    furthest = max(p[k, 3, 3], across * across)
    steady = is_steady(speed, max(p[k, 2, 2], along * along), furthest)
    if p[k, 2, 2] > _ROUND * p[k, 3, 3]:
        steady = speed * speed > _SMALL**2 * furthest
    if steady and speed > 0.0 and speed + along > 0.0:
        x[k, SPEED] = speed + along
        x[k, COURSE] = wrap(x[k, COURSE] + across / speed)
        return False
    angle = math.atan2(across, speed + along)
    x[k, SPEED] = math.hypot(speed + along, across)
    x[k, COURSE] = wrap(x[k, COURSE] + angle)
    turn_pair(p, k, SPEED, math.cos(angle), -math.sin(angle))
    return True
