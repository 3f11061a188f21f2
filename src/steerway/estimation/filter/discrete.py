"""Exact discretisation: the numbers of a prediction that depend on its length alone.

All driving processes are first-order, real or complex, with pole p = −λ + iν (0 for a random walk). A unit of a process
becomes φ0 = e^{ps} after a time s; φ1 is the integral of φ0 over s, and φ2 that of φ1.
"""

import cmath
import math
from typing import NamedTuple

from steerway.core.arrays import Floats, Records
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.linear_algebra import multiply
from steerway.estimation.filter.model import (
    ON_ACCELERATION,
    ON_COURSE,
    ON_FIX,
    ON_RATE,
    ON_SPEED,
    RATE,
    Bank,
    Mode,
    Model,
    Response,
    Step,
)

_NODES = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss–Legendre rule with three nodes on an interval of length 1."""
_SHORT = 0.1
"""Length of a step times |pole| up to which the rule is used. There the rule errs by 4e-6, the closed form by 1e-10."""


@lean_kernel
def decaying(rate: float, t: float) -> tuple[float, float, float]:
    """φ0, φ1 and φ2 after a time t (s) for a real state that decays at a rate (1/s)."""
    a = rate * t
    if abs(a) < 0.1:
        area = 0.5 - a * (1.0 / 6.0 - a * (1.0 / 24.0 - a * (1.0 / 120.0 - a * (1.0 / 720.0 - a / 5040.0))))
        first = 1.0 - a * area
        return 1.0 - a * first, t * first, t * t * area
    first = -math.expm1(-a) / rate
    return math.exp(-a), first, (t - first) / rate


class Noise(NamedTuple):
    """Covariance that noise of density 1 adds to a decaying rate w, to its integral x and to the integral y of x."""

    ww: float
    xw: float
    xx: float
    yw: float
    yx: float
    yy: float


@called_kernel
def noise(decay: float, h: float) -> Noise:
    """Noise over h seconds, in closed form; in short steps, where that would cancel, by quadrature."""
    if decay * h > _SHORT:
        w, x, y = decaying(decay, h)
        xx = (h - 2.0 * x + 0.5 * (1.0 - w * w) / decay) / decay**2
        area = (0.5 * h * h - y) / decay  # the integral of y
        yx = 0.5 * y * y
        yy = (h**3 / 3.0 - 2.0 * (h * y - area) + xx) / decay**2
        return Noise(0.5 * (1.0 - w * w) / decay, 0.5 * x * x, xx, area - decay * yx, yx, yy)
    ww = xw = xx = yw = yx = yy = 0.0
    for i in range(3):
        w, x, y = decaying(decay, h * _NODES[i])
        weight = h * _WEIGHTS[i]
        ww += weight * w * w
        xw += weight * x * w
        xx += weight * x * x
        yw += weight * y * w
        yx += weight * y * x
        yy += weight * y * y
    return Noise(ww, xw, xx, yw, yx, yy)


@lean_kernel
def phi(pole: complex, s: float) -> tuple[complex, complex, complex]:
    """φ0, φ1, φ2 at lag s."""
    a = pole * s
    if abs(a.real) + abs(a.imag) < 0.1:
        second = 0.5 + a * (1.0 / 6.0 + a * (1.0 / 24.0 + a * (1.0 / 120.0 + a * (1.0 / 720.0 + a / 5040.0))))
        first = 1.0 + a * second
        return 1.0 + a * first, s * first, s * s * second
    whole = cmath.exp(a)
    first = (whole - 1.0) / pole
    return whole, first, (first - s) / pole


@lean_kernel
def together(a: complex, b: complex) -> float:
    """Real part of a b*."""
    return a.real * b.real + a.imag * b.imag


@lean_kernel
def respond(response: Response, acts_on: int, change: float, mean: float, dt: float) -> None:
    """Set the effect of a unit of a driving state: the change of speed or course, and its mean over dt."""
    if acts_on == ON_SPEED or acts_on == ON_ACCELERATION:
        response.gain, response.way = change, dt * mean
    else:
        response.turn, response.lean = change, mean


@called_kernel
def add_process(
    responses: Records, j: int, pole: complex, density: float, acts_on: int, dt: float
) -> tuple[float, float, float]:
    """Set the responses of a process with first state j over dt (s), and the noise of this density that it takes up.

    Returns what this noise adds to three numbers: the variance of the distance along the course (or, for every m/s,
    across it); its covariance with the speed (or the course); the variance of the speed (or the course).
    """
    whole, first, second = phi(pole, dt)
    complex_, integrates = pole.imag != 0.0, acts_on == ON_RATE or acts_on == ON_ACCELERATION
    change, mean = (first, second / dt) if integrates else (whole - 1.0, first / dt - 1.0)
    respond(responses[j], acts_on, change.real, mean.real, dt)
    responses[j].left = whole.real
    if complex_:
        respond(responses[j + 1], acts_on, -change.imag, -mean.imag, dt)
        responses[j].spun = whole.imag
    sums = taken_up(pole, integrates, dt)
    response = responses[j]
    response.with_way, response.with_gain = density * sums.with_way.real, density * sums.with_gain.real
    response.added = density * sums.added
    if complex_:
        response = responses[j + 1]
        response.with_way, response.with_gain = density * sums.with_way.imag, density * sums.with_gain.imag
        response.added = density * sums.added
    return density * sums.ww, density * sums.wg, density * sums.gg


class TakenUp(NamedTuple):
    """Integrals over a step of products of responses to noise of density 1: state z, speed or course g, distance w."""

    ww: float  # |w|²
    wg: float  # w g*, real part
    gg: float  # |g|²
    with_way: complex  # z w*
    with_gain: complex  # z g*
    added: float  # |z|²


@lean_kernel
def taken_up(pole: complex, integrates: bool, dt: float) -> TakenUp:
    """Noise of density 1 over a step, in closed form; in short steps, where that would cancel, by quadrature."""
    if abs(pole) * dt > _SHORT:
        return over_a_long_step(pole, integrates, dt)
    ww = wg = gg = added = 0.0
    with_way = with_gain = complex(0.0, 0.0)
    for i in range(3):
        whole, first, second = phi(pole, dt * _NODES[i])
        way, gain = (second, first) if integrates else (first, whole)
        weight = dt * _WEIGHTS[i]
        ww += weight * together(way, way)
        wg += weight * together(way, gain)
        gg += weight * together(gain, gain)
        added += weight * together(whole, whole)
        with_way += weight * whole * way.conjugate()
        with_gain += weight * whole * gain.conjugate()
    return TakenUp(ww, wg, gg, with_way, with_gain, added)


@lean_kernel
def over_a_long_step(pole: complex, integrates: bool, dt: float) -> TakenUp:
    """Closed form of `taken_up`, from the integrals of |φ0|², φ0, s φ0 and powers of s."""
    whole, once, _ = phi(pole, dt)
    other = pole.conjugate()
    size = together(pole, pole)
    late = (dt * whole - once) / pole  # the integral of s φ0
    added = 0.5 * math.expm1(2.0 * pole.real * dt) / pole.real if pole.real != 0.0 else dt
    first = (added - once) / other  # φ0 φ1*
    both = (added - 2.0 * once.real + dt) / size  # |φ1|²
    if not integrates:
        return TakenUp(both, first.real, added, first, complex(added, 0.0), added)
    second = (added - once - other * late) / (other * other)  # φ0 φ2*
    between = (added - once - other * late - once.conjugate() + dt + 0.5 * other * dt * dt) / (pole * other * other)
    ways = added + dt + size * dt**3 / 3.0 - 2.0 * once.real - 2.0 * together(late, pole) + pole.real * dt * dt
    return TakenUp(ways / (size * size), between.real, both, second, first, added)


@called_kernel
def set_steps(bank: Bank, model: Model, dt: float) -> None:
    """Fill the steps and responses of all modes, and the probabilities of a change of mode, for dt > 0 seconds."""
    steps, responses, modes, units = bank.steps, bank.responses, model.modes, bank.moments
    set_processes(steps[0], responses[0], model.processes, dt)
    for i in range(1, len(modes)):
        steps[i] = steps[0]
        for j in range(RATE, responses.shape[1]):
            responses[i, j] = responses[0, j]
    for i in range(len(modes)):
        hold_rate(responses, modes, units, i, dt)
    for i in range(len(modes)):
        set_noise(steps[i], responses[i, RATE], modes[i], units[i])
    exponential(bank.change, bank.product, model.generator, dt)


@called_kernel
def set_processes(step: Step, responses: Records, processes: Records, dt: float) -> None:
    """Set a step and responses (n,) for the processes, which all modes have in common."""
    step.dt = dt
    step.ll = step.lu = step.uu = step.yy = step.yx = step.xx = 0.0
    for j in range(len(responses)):
        response = responses[j]
        response.way = response.gain = response.turn = response.lean = response.left = response.spun = 0.0
        response.with_way = response.with_gain = response.added = 0.0
    for f in range(len(processes)):
        process = processes[f]
        j, decay, frequency, acts_on = process.state, process.decay, process.frequency, process.acts_on
        along = acts_on == ON_SPEED or acts_on == ON_ACCELERATION
        if along or acts_on == ON_RATE or acts_on == ON_COURSE:
            pole, noise = complex(-decay, frequency), 2.0 * decay * process.variance
            a, b, c = add_process(responses, j, pole, noise, acts_on, dt)
            if along:
                step.ll, step.lu, step.uu = step.ll + a, step.lu + b, step.uu + c
            else:
                step.yy, step.yx, step.xx = step.yy + a, step.yx + b, step.xx + c
            continue
        left = math.exp(-decay * dt)
        for k in range(j, j + 2 if acts_on == ON_FIX or frequency > 0.0 else j + 1):
            responses[k].left = left * math.cos(frequency * dt)
            responses[k].added = process.variance * (1.0 - left * left)
        responses[j].spun = left * math.sin(frequency * dt)


@lean_kernel
def hold_rate(responses: Records, modes: Records, units: Floats, i: int, dt: float) -> None:
    """Set the response of the held rate of mode i for noise of density 1; units[i] ← the return of `add_process`."""
    alike = 0
    while modes[alike].rate_decay != modes[i].rate_decay:
        alike += 1
    if alike == i:
        units[i, 0], units[i, 1], units[i, 2] = add_process(
            responses[i], RATE, complex(-modes[i].rate_decay, 0.0), 1.0, ON_RATE, dt
        )
        return
    responses[i, RATE] = responses[alike, RATE]
    for a in range(3):
        units[i, a] = units[alike, a]


@lean_kernel
def set_noise(step: Step, rate: Response, mode: Mode, unit: Floats) -> None:
    """Add the noise of a mode to its step and to `rate`, the response of the held rate. unit: see `hold_rate`."""
    step.sideways, step.drift_speed = mode.sideways, mode.drift_speed
    hold_speed(step, mode.speed_decay, mode.speed_noise)
    step.ll, step.lu, step.uu = step.ll + step.held_ll, step.lu + step.held_lu, step.uu + step.held_uu
    density = mode.rate_noise
    step.yy, step.yx, step.xx = step.yy + density * unit[0], step.yx + density * unit[1], step.xx + density * unit[2]
    rate.with_way, rate.with_gain = density * rate.with_way, density * rate.with_gain
    rate.added = density * rate.added


@lean_kernel
def hold_speed(step: Step, decay: float, density: float) -> None:
    """Set in a step what remains of a unit of speed, the distance that it covers, and the noise of the held speed."""
    step.left, step.way, _ = decaying(decay, step.dt)
    unit = noise(decay, step.dt)  # speed and distance have the equations of rate and course
    step.held_ll, step.held_lu, step.held_uu = density * unit.xx, density * unit.xw, density * unit.ww


@called_kernel
def exponential(out: Floats, product: Floats, generator: Floats, dt: float) -> None:
    """out ← e^{G dt} of a generator (m, m): Taylor's series of a fraction, squared repeatedly; product: workspace."""
    m, fastest = len(generator), 0.0
    for i in range(m):
        fastest = max(fastest, -generator[i, i] * dt)
    halvings = 0
    while fastest > 0.25:
        fastest *= 0.5
        halvings += 1
    scale = dt / 2.0**halvings
    for i in range(m):
        for j in range(m):
            out[i, j] = generator[i, j] * scale / 7.0
        out[i, i] += 1.0
    for order in range(6, 0, -1):  # I + A (I + A/2 (I + A/3 (…)))
        multiply(generator, out, product)
        for i in range(m):
            for j in range(m):
                out[i, j] = product[i, j] * scale / order
            out[i, i] += 1.0
    for _ in range(halvings):
        multiply(out, out, product)
        for i in range(m):
            for j in range(m):
                out[i, j] = product[i, j]
