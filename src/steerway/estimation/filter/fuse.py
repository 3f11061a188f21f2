"""What all modes together say: mean and spread of the mixture, and the motion that fixes do not resolve."""

import math

from steerway.core.angles import wrap
from steerway.core.arrays import Floats, Records
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.filter.model import COURSE, EAST, NORTH, ON_COURSE, ON_RATE, ON_SPEED, RATE, SPEED, Mode, Model

SOG_VARIANCE, COURSE_VARIANCE, RATE_VARIANCE = 5, 6, 7
"""Columns of `fuse`."""
COURSE_STD = 0.6
"""rad; a course that is known worse is not stated. Chosen: a third of that of uniform directions, π/√3."""
QUICK_SPEED, QUICK_SPEED_TIME, QUICK_RATE, QUICK_RATE_TIME = 0.02, 6.0, 0.5 * math.pi / 180.0, 3.0
"""Small changes of speed (m/s) and course rate (rad/s) that a vessel makes at any time, and how long they last (s):
medians of the priors of wander, for a craft of 1.5 m/s."""


@called_kernel
def rate_weights(processes: Records, h: Floats) -> None:
    """What each state contributes to the course rate, into h (n,)."""
    for i in range(len(h)):
        h[i] = 0.0
    h[RATE] = 1.0
    for f in range(len(processes)):
        process = processes[f]
        if process.acts_on == ON_RATE:
            h[process.state] = 1.0
        elif process.acts_on == ON_COURSE:
            h[process.state] = -process.decay
            if process.frequency > 0.0:
                h[process.state + 1] = -process.frequency


@lean_kernel
def course_rate(x: Floats, p: Floats, h: Floats) -> tuple[float, float]:
    """Course rate of a mode, held and shaped, and its variance; h as of `rate_weights`."""
    rate = variance = 0.0
    for i in range(RATE, len(x)):
        if h[i] != 0.0:
            rate += h[i] * x[i]
            for j in range(RATE, len(x)):
                variance += h[i] * h[j] * p[i, j]
    return rate, variance


@lean_kernel
def mean_speed(x: Floats, p: Floats, mode: Mode) -> float:
    """Mean of the speed in a mode: where its velocity may lie in any direction, that of Rayleigh's distribution."""
    speed, across = x[SPEED], p[3, 3]
    if mode.manoeuvres or across < speed * speed or across < _VAGUE**2:
        return speed
    return math.sqrt(speed * speed + 0.25 * math.pi * (p[2, 2] + across))


_VAGUE = 0.4
"""m/s; a velocity that is known better and has no direction is that of a vessel at rest. Chosen: little
above `course.STEERAGEWAY`."""
LEAST_COUNTED = 0.003
"""Probability of a mode below which it is left out of the spread; of pairs of modes as many times less as there are
more of them. An interval is to hold 95 %, and modes so improbable would widen it alone: in the scene `circles` the
deviation of the rate would be 1.5 times as large. With 0.01 it holds 78 % of the rates in the scene `spins`, with this
90 %."""


@called_kernel
def fuse(x: Floats, p: Floats, probability: Floats, model: Model, h: Floats, out: Floats) -> None:
    """Mean and spread of all modes, or of pairs of modes, into `out` (FUSED); h is workspace (n,).

    A pair's number is m times that of its second mode and that of its first, which it is like.
    """
    modes = model.modes
    rate_weights(model.processes, h)
    likeliest = 0
    for k in range(1, len(probability)):
        if probability[k] > probability[likeliest]:
            likeliest = k
    reference = x[likeliest, COURSE]
    north = east = u = across = w = 0.0
    for k in range(len(probability)):
        if probability[k] == 0.0:
            continue
        weight, bend = probability[k], wrap(x[k, COURSE] - reference)
        rate, _ = course_rate(x[k], p[k], h)
        north += weight * x[k, NORTH]
        east += weight * x[k, EAST]
        u += weight * mean_speed(x[k], p[k], modes[k % len(modes)])
        across += weight * bend
        w += weight * rate
    p_u = p_w = p_place = p_s = counted = 0.0
    least = LEAST_COUNTED * len(modes) / len(probability)
    for k in range(len(probability)):
        if probability[k] < least:
            continue
        counted += probability[k]
        weight, bend = probability[k], wrap(x[k, COURSE] - reference)
        rate, variance = course_rate(x[k], p[k], h)
        p_u += weight * (p[k, 2, 2] + (mean_speed(x[k], p[k], modes[k % len(modes)]) - u) ** 2)
        p_s += weight * (p[k, 3, 3] + (x[k, SPEED] * (bend - across)) ** 2)
        p_w += weight * (variance + (rate - w) ** 2)
        p_place += weight * 0.5 * (p[k, 0, 0] + p[k, 1, 1] + (x[k, 0] - north) ** 2 + (x[k, 1] - east) ** 2)
    p_u, p_s, p_w, p_place = p_u / counted, p_s / counted, p_w / counted, p_place / counted
    out[0], out[1], out[2], out[3], out[4] = north, east, u, wrap(reference + across), w
    out[5], out[6], out[7], out[8] = p_u, p_s / max(u * u, 1e-12), p_w, p_place


@called_kernel
def add_unresolved_speed(processes: Records, apart: float, out: Floats) -> None:
    """Add to the variance of the speed in `out` (FUSED) the motion that is faster than fixes `apart` s.

    The wander of a structure is fitted to what the fixes resolve. Of that which changes between them they tell nothing,
    and it is as usual: see QUICK_SPEED and QUICK_RATE.
    """
    out[SOG_VARIANCE] += unresolved_variance(processes, ON_SPEED, apart, QUICK_SPEED * out[2], QUICK_SPEED_TIME)


@called_kernel
def add_unresolved_rate(processes: Records, apart: float, out: Floats) -> None:
    """As `add_unresolved_speed`, of the course rate."""
    out[RATE_VARIANCE] += unresolved_variance(processes, ON_RATE, apart, QUICK_RATE, QUICK_RATE_TIME)


@lean_kernel
def unresolved_variance(processes: Records, acts_on: int, apart: float, usual: float, usual_time: float) -> float:
    """Variance of usual wander that fixes `apart` s do not resolve, as far as that of a structure does not hold it.

    0 of a vessel that does not wander.
    """
    held, wanders = 0.0, False
    for f in range(len(processes)):
        if processes[f].acts_on == acts_on and processes[f].frequency == 0.0:
            held += processes[f].variance * unresolved(apart * processes[f].decay)
            wanders = True
    return max(usual * usual * unresolved(apart / usual_time) - held, 0.0) if wanders else 0.0


@lean_kernel
def unresolved(interval: float) -> float:
    """Share of the variance of a first-order process that means over an interval, in its time constants, lack."""
    a = max(interval, 1e-3)
    return 1.0 - 2.0 * (a - 1.0 + math.exp(-a)) / (a * a)
