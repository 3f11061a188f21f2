"""One estimate from all modes: mean and variance of the mixture, plus the variance of motion too fast for the fixes."""

import math

from steerway.core.angles import wrap
from steerway.core.arrays import Floats, Records
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.filter.model import COURSE, EAST, NORTH, ON_COURSE, ON_RATE, ON_SPEED, RATE, SPEED, Mode, Model

SOG_VARIANCE, COURSE_VARIANCE, RATE_VARIANCE = 5, 6, 7
"""Columns of `fuse`."""
COURSE_STD = 0.6
"""Largest 1σ, rad, of a course that is output. Uniform directions have three times this σ, π/√3."""
QUICK_SPEED, QUICK_SPEED_TIME, QUICK_RATE, QUICK_RATE_TIME = 0.02, 6.0, 0.5 * math.pi / 180.0, 3.0
"""Wander of any vessel: σ of the speed relative to the speed, its time constant (s), σ of the course rate (rad/s) and
its time constant. Medians of the priors, for a craft of 1.5 m/s."""


@called_kernel
def rate_weights(processes: Records, h: Floats) -> None:
    """h ← Jacobian (n,) of the course rate: the held rate, and the processes that act on rate or course."""
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
    """Course rate of a mode (rad/s) and its variance; h: see `rate_weights`."""
    rate = variance = 0.0
    for i in range(RATE, len(x)):
        if h[i] != 0.0:
            rate += h[i] * x[i]
            for j in range(RATE, len(x)):
                variance += h[i] * h[j] * p[i, j]
    return rate, variance


@lean_kernel
def mean_speed(x: Floats, p: Floats, mode: Mode) -> float:
    """Mean speed (m/s) of a mode; where the velocity may have any direction, the mean of a Rayleigh distribution."""
    speed, across = x[SPEED], p[3, 3]
    if mode.manoeuvres or across < speed * speed or across < _VAGUE**2:
        return speed
    return math.sqrt(speed * speed + 0.25 * math.pi * (p[2, 2] + across))


_VAGUE = 0.4
"""1σ, m/s, below which a velocity without direction is that of a vessel at rest: just above `STEERAGEWAY`."""
LEAST_COUNTED = 0.003
"""Least probability of a mode that counts in the variances; for m² pairs of modes, 1/m of this value. A 95 % interval
need not contain less probable modes: if they count, the σ of the rate is 1.5 times as large in the scene `circles`. In
the scene `spins`, the interval contains 78 % of the rates with 0.01, and 90 % with 0.003."""


@called_kernel
def fuse(x: Floats, p: Floats, probability: Floats, model: Model, h: Floats, out: Floats) -> None:
    """out (FUSED) ← mean and variances of all modes, or of pairs of modes; h: workspace (n,).

    Pair i + m j consists of modes i and j, and moves as mode i does.
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
    """Add to the variance of the speed in `out` (FUSED) that of motion which fixes `apart` (s) do not resolve.

    The fit sees only wander slow enough for the fixes to resolve. Faster wander is assumed to have its usual size
    (QUICK_SPEED); the part that the structure's own wander contributes is subtracted.
    """
    out[SOG_VARIANCE] += unresolved_variance(processes, ON_SPEED, apart, QUICK_SPEED * out[2], QUICK_SPEED_TIME)


@called_kernel
def add_unresolved_rate(processes: Records, apart: float, out: Floats) -> None:
    """Do the same as `add_unresolved_speed` for the course rate."""
    out[RATE_VARIANCE] += unresolved_variance(processes, ON_RATE, apart, QUICK_RATE, QUICK_RATE_TIME)


@lean_kernel
def unresolved_variance(processes: Records, acts_on: int, apart: float, usual: float, usual_time: float) -> float:
    """Variance of the usual wander that fixes `apart` (s) do not resolve, less that of the structure's own wander.

    At least 0, and 0 for a structure without wander. usual, usual_time: σ and time constant (s) of the usual wander.
    """
    held, wanders = 0.0, False
    for f in range(len(processes)):
        if processes[f].acts_on == acts_on and processes[f].frequency == 0.0:
            held += processes[f].variance * unresolved(apart * processes[f].decay)
            wanders = True
    return max(usual * usual * unresolved(apart / usual_time) - held, 0.0) if wanders else 0.0


@lean_kernel
def unresolved(interval: float) -> float:
    """Share of the variance of a first-order process that averages over an interval (in time constants) lack."""
    a = max(interval, 1e-3)
    return 1.0 - 2.0 * (a - 1.0 + math.exp(-a)) / (a * a)
