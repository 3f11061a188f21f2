"""Prediction: motion along an arc at the mean speed and course rate of a step.

The five-state model, (11)–(15) of `filter.five_state`, with further states (shaping filters) that drive it.
"""

import math
from typing import NamedTuple

from steerway.core.angles import sinc
from steerway.core.arrays import Floats, Records
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.filter.model import COURSE, EAST, NORTH, RATE, SPEED, Step

_SLOW = 1e-6
"""Least speed, m/s, in the ratio of speeds by which a prediction scales the velocity across the course."""
_SPINS_BELOW = 2.0
"""Speed, m/s, above which the noise of the course rate in an emergency is reduced. Otherwise it would accelerate a
vessel more across the course than along it. The value is `structures.EMERGENCY_ACCELERATION` over `EMERGENCY_YAW`."""


class Arc(NamedTuple):
    """The motion of a step."""

    north: float  # chord, m
    east: float
    speed: float  # at the end, m/s
    turn: float  # change of course, rad
    c: float  # cosine and sine of the direction of the chord
    s: float
    ratio: float  # ratio of the length of the chord to that of the arc
    bend: float  # derivative of the length of the chord by the turn, m/rad


@called_kernel
def predict(x: Floats, p: Floats, step: Step, responses: Records, driving: int, rows: Floats) -> None:
    """Predict a mode, x (n,) and p (n, n), over a step in place; the first `driving` states drive the motion.

    P ← F P Fᵀ + Q with F in two factors: the response of position, speed and course to all driving states, then the
    decay of every process. responses: (n,). rows: workspace (8, n).
    """
    arc = arc_of(x, responses, step, driving)
    rates = rows[:4]
    set_rates(rates, x[SPEED], arc, responses, step, driving)
    x[NORTH] += arc.north
    x[EAST] += arc.east
    x[SPEED] = arc.speed
    x[COURSE] += arc.turn
    propagate(p, rates, rows[4:], driving)
    decay_processes(x, p, responses)
    take_noise(p, step, responses, arc)
    if arc.speed < 0.0:
        reverse(x, p)
    fill_lower(p)


@lean_kernel
def arc_of(x: Floats, responses: Records, step: Step, driving: int) -> Arc:
    """The motion of a step from a state (n,)."""
    way, speed, turn, lean = x[SPEED] * step.way, x[SPEED] * step.left, 0.0, 0.0
    for j in range(RATE, driving):
        response = responses[j]
        way += response.way * x[j]
        speed += response.gain * x[j]
        turn += response.turn * x[j]
        lean += response.lean * x[j]
    c, s = math.cos(x[COURSE] + lean), math.sin(x[COURSE] + lean)
    ratio, slope = sinc(0.5 * turn)
    return Arc(way * ratio * c, way * ratio * s, speed, turn, c, s, ratio, 0.5 * slope * way)


@lean_kernel
def set_rates(rates: Floats, was: float, arc: Arc, responses: Records, step: Step, driving: int) -> None:
    """Fill the rows (4, n) of F − I for north, east and the velocity along and across; columns 0 and 1 are not set.

    was: speed (m/s) at the beginning of the step.
    """
    north, east, along, across = rates[0], rates[1], rates[2], rates[3]
    way = step.way * arc.ratio
    north[SPEED], east[SPEED], along[SPEED], across[SPEED] = way * arc.c, way * arc.s, step.left - 1.0, 0.0
    along[COURSE] = 0.0
    if was > _SLOW and arc.speed > _SLOW:
        north[COURSE], east[COURSE], across[COURSE] = -arc.east / was, arc.north / was, arc.speed / was - 1.0
    else:
        north[COURSE], east[COURSE], across[COURSE] = -way * arc.s, way * arc.c, step.left - 1.0
    for j in range(RATE, driving):
        response = responses[j]
        way = response.way * arc.ratio
        north[j] = way * arc.c - arc.east * response.lean + arc.bend * arc.c * response.turn
        east[j] = way * arc.s + arc.north * response.lean + arc.bend * arc.s * response.turn
        along[j] = response.gain
        across[j] = arc.speed * response.turn


@lean_kernel
def propagate(p: Floats, rates: Floats, moved: Floats, driving: int) -> None:
    """P ← F P Fᵀ (upper triangle) with the rows of `set_rates`; moved: workspace (4, n)."""
    n = len(p)
    north, east, along, across = moved[0], moved[1], moved[2], moved[3]
    for i in range(n):
        north[i] = east[i] = along[i] = across[i] = 0.0
    for j in range(SPEED, driving):
        a, b, c, d = rates[0, j], rates[1, j], rates[2, j], rates[3, j]
        for i in range(n):
            value = p[j, i]
            north[i] += a * value
            east[i] += b * value
            along[i] += c * value
            across[i] += d * value
    for a in range(4):
        row, n_, e_, u_, s_ = moved[a], north[a], east[a], along[a], across[a]
        for j in range(SPEED, driving):
            n_ += row[j] * rates[0, j]
            e_ += row[j] * rates[1, j]
            u_ += row[j] * rates[2, j]
            s_ += row[j] * rates[3, j]
        p[a, 0] += row[0] + n_
        p[a, 1] += row[1] + e_
        p[a, 2] += row[2] + u_
        p[a, 3] += row[3] + s_
        for j in range(RATE, n):
            p[a, j] += row[j]


@called_kernel
def decay_processes(x: Floats, p: Floats, responses: Records) -> None:
    """Decay every process, and its covariances (upper triangle)."""
    n = len(x)
    for j in range(RATE, n):
        left, spun = responses[j].left, responses[j].spun
        if spun != 0.0:
            x[j], x[j + 1] = left * x[j] - spun * x[j + 1], spun * x[j] + left * x[j + 1]
            turn_pair(p, j, left, spun)
        elif left != 1.0 and responses[j - 1].spun == 0.0:
            x[j] *= left
            for i in range(j + 1):
                p[i, j] *= left
            for i in range(j, n):
                p[j, i] *= left


@called_kernel
def turn_pair(p: Floats, a: int, c: float, s: float) -> None:
    """P ← J P Jᵀ in place (upper triangle), J = [[c, −s], [s, c]] on the states a and a + 1."""
    b = a + 1
    for i in range(a):
        p[i, a], p[i, b] = c * p[i, a] - s * p[i, b], s * p[i, a] + c * p[i, b]
    for j in range(a + 2, len(p)):
        p[a, j], p[b, j] = c * p[a, j] - s * p[b, j], s * p[a, j] + c * p[b, j]
    aa, ab, bb = p[a, a], p[a, b], p[b, b]
    p[a, a] = c * c * aa - 2.0 * c * s * ab + s * s * bb
    p[a, b] = c * s * (aa - bb) + (c * c - s * s) * ab
    p[b, b] = s * s * aa + 2.0 * c * s * ab + c * c * bb


@called_kernel
def take_noise(p: Floats, step: Step, responses: Records, arc: Arc) -> None:
    """Add the noise over a step (upper triangle).

    A vessel at rest is pushed in any direction: a share of the noise of the held speed also acts across the course. The
    share falls with the fourth power of the speed, to `sideways` of the mode. In an emergency, where `sideways` is 1,
    the noise of the course rate falls with the speed.
    """
    c, s, speed, was = arc.c, arc.s, arc.speed, arc.speed / step.left
    slowness = (speed / step.drift_speed) ** 2
    sideways = max(1.0 / (1.0 + slowness * slowness), step.sideways)
    spins = spin_share(step, speed)
    yy = spins * was * was * step.yy + sideways * step.held_ll
    ys = spins * was * speed * step.yx + sideways * step.held_lu
    ss = spins * speed * speed * step.xx + sideways * step.held_uu
    p[0, 0] += c * c * step.ll + s * s * yy
    p[0, 1] += c * s * (step.ll - yy)
    p[1, 1] += s * s * step.ll + c * c * yy
    p[0, 2] += c * step.lu
    p[1, 2] += s * step.lu
    p[2, 2] += step.uu
    p[0, 3] -= s * ys
    p[1, 3] += c * ys
    p[3, 3] += ss
    for j in range(RATE, len(p)):
        response = responses[j]
        if response.turn != 0.0:
            p[j, j] += spins * response.added
            p[0, j] -= s * spins * was * response.with_way
            p[1, j] += c * spins * was * response.with_way
            p[3, j] += spins * speed * response.with_gain
            continue
        p[j, j] += response.added
        if response.gain != 0.0:
            p[0, j] += c * response.with_way
            p[1, j] += s * response.with_way
            p[2, j] += response.with_gain


@lean_kernel
def spin_share(step: Step, speed: float) -> float:
    """Share of the noise of the course rate that acts at a speed (m/s): less than 1 in an emergency."""
    return 1.0 / (1.0 + step.sideways * (speed / _SPINS_BELOW) ** 2)


@called_kernel
def reverse(x: Floats, p: Floats) -> None:
    """Turn a negative speed into a positive one on the opposite course (upper triangle)."""
    x[SPEED] = -x[SPEED]
    x[COURSE] += math.pi
    for i in range(SPEED):
        p[i, 2] = -p[i, 2]
        p[i, 3] = -p[i, 3]
    for j in range(RATE, len(x)):
        p[2, j] = -p[2, j]
        p[3, j] = -p[3, j]
