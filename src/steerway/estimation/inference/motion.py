"""Prediction: motion along an arc at the mean speed and course rate of the step, in place.

The five-state model of P0 (11)–(15) integrated exactly (constant turn rate over a step), driven by shaping filters.
"""

import math

from steerway.core.angles import sinc
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.inference.discrete import (
    ADDED,
    DT,
    GAIN,
    LEAN,
    LEFT,
    Q_LL,
    Q_LU,
    Q_SIDEWAYS,
    Q_UU,
    Q_XX,
    Q_YX,
    Q_YY,
    S_LL,
    S_LU,
    S_UU,
    SPUN,
    TURN,
    WAY,
    WITH_GAIN,
    WITH_WAY,
)
from steerway.estimation.inference.model import COURSE, EAST, NORTH, RATE, SPEED

_SLOW = 1e-6
"""m/s: below it a change of speed does not scale the velocity across: it is divided by."""
_SPINS_BELOW = 2.0
"""m/s above which a vessel in an emergency spins less: its noise of the course rate would be a larger acceleration
across than is expected along (`structures.EMERGENCY_ACCELERATION` over `EMERGENCY_YAW`)."""


@called_kernel
def predict(x, p, k, step, motion_states, drift_speed, work):
    """Predict mode k of x (m, n) and p (m, n, n) over a step; states from `motion_states` on do not drive the motion.

    P ← F P Fᵀ + Q with F in two factors: pose and speed by all states that drive them, then every process by itself.
    work: (≥ 9, n).
    """
    n = x.shape[1]
    dt = step[DT]
    way = x[k, SPEED] * dt
    speed, turn, lean = x[k, SPEED], 0.0, 0.0
    for j in range(RATE, motion_states):
        way += step[WAY, j] * x[k, j]
        speed += step[GAIN, j] * x[k, j]
        turn += step[TURN, j] * x[k, j]
        lean += step[LEAN, j] * x[k, j]
    mean_course = x[k, COURSE] + lean
    c, s = math.cos(mean_course), math.sin(mean_course)
    ratio, slope = sinc(0.5 * turn)
    north, east = way * ratio * c, way * ratio * s
    bend_n, bend_e = 0.5 * slope * way * c, 0.5 * slope * way * s
    was = x[k, SPEED]
    if was > _SLOW and speed > _SLOW:
        across_n, across_e, across_s = -east / was, north / was, speed / was - 1.0
    else:
        across_n, across_e, across_s = -dt * ratio * s, dt * ratio * c, 0.0
    f_n, f_e, f_u, f_s = work[0], work[1], work[2], work[3]
    f_n[SPEED], f_e[SPEED], f_u[SPEED], f_s[SPEED] = dt * ratio * c, dt * ratio * s, 0.0, 0.0
    f_n[COURSE], f_e[COURSE], f_u[COURSE], f_s[COURSE] = across_n, across_e, 0.0, across_s
    for j in range(RATE, motion_states):
        along = step[WAY, j] * ratio
        f_n[j] = along * c - east * step[LEAN, j] + bend_n * step[TURN, j]
        f_e[j] = along * s + north * step[LEAN, j] + bend_e * step[TURN, j]
        f_u[j] = step[GAIN, j]
        f_s[j] = speed * step[TURN, j]
    x[k, NORTH] += north
    x[k, EAST] += east
    x[k, SPEED] = speed
    x[k, COURSE] += turn

    w_n, w_e, w_u, w_s = work[4], work[5], work[6], work[7]
    for i in range(n):
        value = p[k, SPEED, i]
        w_n[i], w_e[i], w_u[i], w_s[i] = f_n[SPEED] * value, f_e[SPEED] * value, 0.0, 0.0
    for i in range(n):
        value = p[k, COURSE, i]
        w_n[i] += f_n[COURSE] * value
        w_e[i] += f_e[COURSE] * value
        w_s[i] += f_s[COURSE] * value
    for j in range(RATE, motion_states):
        a, b, d, e = f_n[j], f_e[j], f_u[j], f_s[j]
        for i in range(n):
            value = p[k, j, i]
            w_n[i] += a * value
            w_e[i] += b * value
            w_u[i] += d * value
            w_s[i] += e * value
    nn = ne = nu = ns = ee = eu = es = uu = us = ss = 0.0
    for j in range(SPEED, motion_states):
        nn += w_n[j] * f_n[j]
        ne += w_n[j] * f_e[j]
        nu += w_n[j] * f_u[j]
        ns += w_n[j] * f_s[j]
        ee += w_e[j] * f_e[j]
        eu += w_e[j] * f_u[j]
        es += w_e[j] * f_s[j]
        uu += w_u[j] * f_u[j]
        us += w_u[j] * f_s[j]
        ss += w_s[j] * f_s[j]
    p[k, 0, 0] += 2.0 * w_n[0] + nn
    p[k, 0, 1] += w_n[1] + w_e[0] + ne
    p[k, 0, 2] += w_n[2] + w_u[0] + nu
    p[k, 0, 3] += w_n[3] + w_s[0] + ns
    p[k, 1, 1] += 2.0 * w_e[1] + ee
    p[k, 1, 2] += w_e[2] + w_u[1] + eu
    p[k, 1, 3] += w_e[3] + w_s[1] + es
    p[k, 2, 2] += 2.0 * w_u[2] + uu
    p[k, 2, 3] += w_u[3] + w_s[2] + us
    p[k, 3, 3] += 2.0 * w_s[3] + ss
    for j in range(RATE, n):
        p[k, 0, j] += w_n[j]
        p[k, 1, j] += w_e[j]
        p[k, 2, j] += w_u[j]
        p[k, 3, j] += w_s[j]
    decay_processes(x, p, k, step)
    take_noise(p, k, step, speed, c, s, drift_speed)
    if speed < 0.0:
        reverse(x, p, k)
    for i in range(n):
        for j in range(i):
            p[k, i, j] = p[k, j, i]


@called_kernel
def decay_processes(x, p, k, step):
    """Every process beyond the pose and speed by itself (upper triangle)."""
    n = x.shape[1]
    for j in range(RATE, n):
        left, spun = step[LEFT, j], step[SPUN, j]
        if spun != 0.0:
            x[k, j], x[k, j + 1] = left * x[k, j] - spun * x[k, j + 1], spun * x[k, j] + left * x[k, j + 1]
            turn_pair(p, k, j, left, spun)
        elif left != 1.0 and step[SPUN, j - 1] == 0.0:
            x[k, j] *= left
            for i in range(j + 1):
                p[k, i, j] *= left
            for i in range(j, n):
                p[k, j, i] *= left


@called_kernel
def turn_pair(p, k, a, c, s):
    """P ← J P Jᵀ in place (upper triangle), J = [[c, −s], [s, c]] on the states a and a + 1."""
    b = a + 1
    for i in range(a):
        p[k, i, a], p[k, i, b] = c * p[k, i, a] - s * p[k, i, b], s * p[k, i, a] + c * p[k, i, b]
    for j in range(a + 2, p.shape[2]):
        p[k, a, j], p[k, b, j] = c * p[k, a, j] - s * p[k, b, j], s * p[k, a, j] + c * p[k, b, j]
    aa, ab, bb = p[k, a, a], p[k, a, b], p[k, b, b]
    p[k, a, a] = c * c * aa - 2.0 * c * s * ab + s * s * bb
    p[k, a, b] = c * s * (aa - bb) + (c * c - s * s) * ab
    p[k, b, b] = s * s * aa + 2.0 * c * s * ab + c * c * bb


@called_kernel
def take_noise(p, k, step, speed, c, s, drift_speed):
    """What the processes take up in a step (upper triangle); (c, s) is the direction of the way.

    At rest a vessel is pushed about in any direction: of the noise of the held speed a share that falls with the
    fourth power of speed acts across the course as well. Where all of it does (an emergency), the noise of the course
    rate adds no more than that at speed.
    """
    n = p.shape[2]
    slowness = (speed / drift_speed) ** 2
    sideways = max(1.0 / (1.0 + slowness * slowness), step[Q_SIDEWAYS])
    ll, lu, uu = step[Q_LL], step[Q_LU], step[Q_UU]
    spins = spin_share(step, speed)
    turned = spins * speed * speed
    yy = turned * step[Q_YY] + sideways * step[S_LL]
    ys = turned * step[Q_YX] + sideways * step[S_LU]
    ss = turned * step[Q_XX] + sideways * step[S_UU]
    p[k, 0, 0] += c * c * ll + s * s * yy
    p[k, 0, 1] += c * s * (ll - yy)
    p[k, 1, 1] += s * s * ll + c * c * yy
    p[k, 0, 2] += c * lu
    p[k, 1, 2] += s * lu
    p[k, 2, 2] += uu
    p[k, 0, 3] -= s * ys
    p[k, 1, 3] += c * ys
    p[k, 3, 3] += ss
    for j in range(RATE, n):
        if step[TURN, j] != 0.0:
            p[k, j, j] += spins * step[ADDED, j]
            p[k, 0, j] -= s * spins * speed * step[WITH_WAY, j]
            p[k, 1, j] += c * spins * speed * step[WITH_WAY, j]
            p[k, 3, j] += spins * speed * step[WITH_GAIN, j]
            continue
        p[k, j, j] += step[ADDED, j]
        if step[GAIN, j] != 0.0:
            p[k, 0, j] += c * step[WITH_WAY, j]
            p[k, 1, j] += s * step[WITH_WAY, j]
            p[k, 2, j] += step[WITH_GAIN, j]


@lean_kernel
def spin_share(step, speed):
    """Share of its noise of the course rate that a mode has at a speed: less than 1 in an emergency."""
    return 1.0 / (1.0 + step[Q_SIDEWAYS] * (speed / _SPINS_BELOW) ** 2)


@called_kernel
def reverse(x, p, k):
    """A vessel that runs backwards runs forwards on the opposite course (upper triangle)."""
    x[k, SPEED] = -x[k, SPEED]
    x[k, COURSE] += math.pi
    n = x.shape[1]
    for i in range(SPEED):
        p[k, i, 2] = -p[k, i, 2]
        p[k, i, 3] = -p[k, i, 3]
    for j in range(RATE, n):
        p[k, 2, j] = -p[k, 2, j]
        p[k, 3, j] = -p[k, 3, j]
