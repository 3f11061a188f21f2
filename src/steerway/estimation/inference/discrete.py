"""Exact discretisation: what a prediction needs that depends on its length alone.

All driving processes are first-order, real or complex, with pole p = −λ + iν (0 for a random walk). For the response
to a unit a time s before: φ0 = e^{ps}, its integral φ1, and the integral of that φ2.
"""

import cmath
import math

from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.inference.model import (
    ACTS_ON,
    DECAY,
    FREQUENCY,
    MODES,
    ON_COURSE,
    ON_FIX,
    ON_RATE,
    ON_SPEED,
    RATE,
    RATE_DECAY,
    RATE_NOISE,
    SIDEWAYS,
    SPEED_NOISE,
    STATE,
    VARIANCE,
)

(
    WAY,  # way along the course, of a unit of a state on speed
    GAIN,  # change of speed
    TURN,  # change of course, of a unit of a state on course rate
    LEAN,  # mean change of course over the step
    LEFT,  # what is left of the state: real part
    SPUN,  # … imaginary part
    WITH_WAY,  # covariance of new noise: of the state and the way along (or, for each m/s, across) the course
    WITH_GAIN,  # … and the speed (or the course)
    ADDED,  # variance of the new noise
) = range(9)
"""Rows of a step."""
DT, Q_LL, Q_LU, Q_UU, Q_SIDEWAYS = (WAY, 0), (WITH_WAY, 0), (WITH_WAY, 1), (WITH_WAY, 2), (WITH_WAY, 3)
Q_YY, Q_YX, Q_XX = (WITH_GAIN, 0), (WITH_GAIN, 1), (WITH_GAIN, 2)
S_LL, S_LU, S_UU = (ADDED, 0), (ADDED, 1), (ADDED, 2)
"""Places in the columns of the first four states, which have no rows of their own: the step itself; covariance of way
along the course and speed; of way across and course, for each m/s; of held speed alone."""

_NODES = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss and Legendre's rule with three nodes on an interval of length 1."""


@lean_kernel
def responses(pole, s):
    """φ0, φ1, φ2 at lag s."""
    a = pole * s
    if abs(a.real) + abs(a.imag) < 0.1:
        second = 0.5 + a * (1.0 / 6.0 + a * (1.0 / 24.0 + a * (1.0 / 120.0 + a * (1.0 / 720.0 + a / 5040.0))))
        first = 1.0 + a * second
        return 1.0 + a * first, s * first, s * s * second
    whole = cmath.exp(a)
    first = (whole - 1.0) / pole
    return whole, first, (first - s) / pole


@called_kernel
def add_process(step, j, pole, density, oscillates, acts_on, dt):
    """One process with first state j: its deterministic response over dt, and the noise of density it takes up."""
    whole, first, second = responses(pole, dt)
    step[LEFT, j] = whole.real
    if oscillates:
        step[SPUN, j] = whole.imag
    if acts_on == ON_SPEED:
        step[GAIN, j], step[WAY, j] = whole.real - 1.0, first.real - dt
        if oscillates:
            step[GAIN, j + 1], step[WAY, j + 1] = -whole.imag, -first.imag
    elif acts_on == ON_COURSE:
        step[TURN, j], step[LEAN, j] = whole.real - 1.0, first.real / dt - 1.0
        if oscillates:
            step[TURN, j + 1], step[LEAN, j + 1] = -whole.imag, -first.imag / dt
    else:
        step[TURN, j], step[LEAN, j] = first.real, second.real / dt
        if oscillates:
            step[TURN, j + 1], step[LEAN, j + 1] = -first.imag, -second.imag / dt
    ww = wg = gg = sw = sg = ss = tw = tg = 0.0
    for i in range(3):
        whole, first, second = responses(pole, dt * _NODES[i])
        if acts_on == ON_RATE:
            way, gain = second, first
        else:
            way, gain = first, whole
        weight = density * dt * _WEIGHTS[i]
        ww += weight * way.real * way.real
        wg += weight * way.real * gain.real
        gg += weight * gain.real * gain.real
        sw += weight * whole.real * way.real
        sg += weight * whole.real * gain.real
        ss += weight * whole.real * whole.real
        if oscillates:
            ww += weight * way.imag * way.imag
            wg += weight * way.imag * gain.imag
            gg += weight * gain.imag * gain.imag
            sw += weight * whole.imag * way.imag
            sg += weight * whole.imag * gain.imag
            ss += weight * whole.imag * whole.imag
            tw += weight * (whole.imag * way.real - whole.real * way.imag)
            tg += weight * (whole.imag * gain.real - whole.real * gain.imag)
    step[WITH_WAY, j], step[WITH_GAIN, j], step[ADDED, j] = sw, sg, ss
    if oscillates:
        step[WITH_WAY, j + 1], step[WITH_GAIN, j + 1], step[ADDED, j + 1] = tw, tg, ss
    return ww, wg, gg


@called_kernel
def set_steps(steps, change, power, dt, model):
    """Fill the step of every mode, and the probabilities of change between modes over dt > 0 seconds."""
    modes, filters = model.modes, model.filters
    m, n = steps.shape[0], steps.shape[2]
    step = steps[0]
    for i in range(step.shape[0]):
        for j in range(n):
            step[i, j] = 0.0
    ll = lu = uu = yy = yx = xx = 0.0
    for f in range(len(filters)):
        j, decay, frequency = int(filters[f, STATE]), filters[f, DECAY], filters[f, FREQUENCY]
        density, acts_on = 2.0 * decay * filters[f, VARIANCE], int(filters[f, ACTS_ON])
        if acts_on == ON_SPEED or acts_on == ON_RATE or acts_on == ON_COURSE:
            a, b, c = add_process(step, j, complex(-decay, frequency), density, frequency > 0.0, acts_on, dt)
            if acts_on == ON_SPEED:
                ll, lu, uu = ll + a, lu + b, uu + c
            else:
                yy, yx, xx = yy + a, yx + b, xx + c
            continue
        left = math.exp(-decay * dt)
        for k in range(j, j + 2 if acts_on == ON_FIX or frequency > 0.0 else j + 1):
            step[LEFT, k] = left * math.cos(frequency * dt)
            step[ADDED, k] = filters[f, VARIANCE] * (1.0 - left * left)
        step[SPUN, j] = left * math.sin(frequency * dt)
    for i in range(1, m):
        for a in range(step.shape[0]):
            for b in range(n):
                steps[i, a, b] = step[a, b]
    for i in range(m):
        step = steps[i]
        step[DT] = dt
        density = modes[i, SPEED_NOISE]
        step[S_LL], step[S_LU], step[S_UU] = density * dt**3 / 3.0, density * dt * dt / 2.0, density * dt
        step[Q_LL], step[Q_LU], step[Q_UU] = ll + step[S_LL], lu + step[S_LU], uu + step[S_UU]
        step[Q_SIDEWAYS] = modes[i, SIDEWAYS]
        alike = 0
        while alike < i and modes[alike, RATE_DECAY] != modes[i, RATE_DECAY]:
            alike += 1
        if alike == i:
            pole = complex(-modes[i, RATE_DECAY], 0.0)
            step[Q_YY], step[Q_YX], step[Q_XX] = add_process(step, RATE, pole, 1.0, False, ON_RATE, dt)
        else:
            for a in range(step.shape[0]):
                step[a, RATE] = steps[alike, a, RATE]
            step[Q_YY], step[Q_YX], step[Q_XX] = steps[alike][Q_YY], steps[alike][Q_YX], steps[alike][Q_XX]
    for i in range(m):
        step, density = steps[i], modes[i, RATE_NOISE]
        for a in (WITH_WAY, WITH_GAIN, ADDED):
            step[a, RATE] *= density
        step[Q_YY], step[Q_YX], step[Q_XX] = (
            yy + density * step[Q_YY],
            yx + density * step[Q_YX],
            xx + density * step[Q_XX],
        )
    exponential(change, power, model.generator, dt)


@called_kernel
def exponential(out, power, generator, dt):
    """out = e^{G dt} of a generator (m, m): Taylor's series of a fraction of dt, then squared; power (≥ 2m, m)."""
    m = MODES
    fastest = 0.0
    for i in range(m):
        fastest = max(fastest, -generator[i, i] * dt)
    halvings = 0
    while fastest > 0.25:
        fastest *= 0.5
        halvings += 1
    scale = dt / 2.0**halvings
    for i in range(m):
        for j in range(m):
            power[i, j] = out[i, j] = 1.0 if i == j else 0.0
    for order in range(1, 8):
        for i in range(m):
            for j in range(m):
                total = 0.0
                for k in range(m):
                    total += power[i, k] * generator[k, j]
                power[m + i, j] = total * scale / order
        for i in range(m):
            for j in range(m):
                power[i, j] = power[m + i, j]
                out[i, j] += power[i, j]
    for _ in range(halvings):
        for i in range(m):
            for j in range(m):
                total = 0.0
                for k in range(m):
                    total += out[i, k] * out[k, j]
                power[i, j] = total
        for i in range(m):
            for j in range(m):
                out[i, j] = power[i, j]
