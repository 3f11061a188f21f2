"""Forecast by given numbers: mean and covariance of the position after a while, in closed form.

Course diffuses without bound, so that linearisation fails within minutes: its long thin ellipse across the course is
in truth a crescent, then a disc. Here speed and course are Gaussian processes whose mean and covariance at any two
times are known in closed form, and the first two moments of the position are integrals of E[U e^{iχ}] and
E[U(s) U(t) e^{i(χ(s) ± χ(t))}] over one and two times. Acceleration persists for its time, a turn for 1/α2; a vessel
without a course drifts, slower than steerageway.

Voyages drawn as for structures that were inferred (`filter.voyages`) lie farther off by this many numbers: on AIS
of the Solent 104 m in place of 86 two minutes ahead (median), since a drawn speed does not fall below zero, or returns
to what it was; and they take 40 times as long.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats, Records
from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.filter.bank import add_second_moments, average, take_covariance
from steerway.estimation.filter.discrete import decaying
from steerway.estimation.filter.fuse import COURSE_STD
from steerway.estimation.filter.model import (
    COURSE,
    EAST,
    MODE,
    NORTH,
    ON_ACCELERATION,
    ON_COURSE,
    PROCESS,
    RATE,
    SPEED,
    Bank,
    Mode,
    Model,
    empty_bank,
    room_to_keep,
)
from steerway.estimation.filter.relative import from_likeliest, shifted
from steerway.estimation.filter.row import Asked, Rows, recall
from steerway.estimation.log.course import run_model
from steerway.estimation.log.place import MOMENTS

NODES = 48
"""Points of the midpoint rule: with 96, mean and covariance of the voyages of `tests/test_prediction.py`, which
compares them with Monte Carlo, change by less than 10⁻⁴ of the spread."""
SPEED_SHARE, SPEED_ROOM = 0.5, 1.0
"""1σ that accelerations add to a speed in the long run: a share of it, and m/s. A vessel keeps about its speed, where a
random walk would lead away without bound. Chosen on the Solent: with 0.3 and 0.5 m/s the 95 % ellipses ten minutes
ahead hold 94 % of the vessels of even MMSI at 2.5 m/s and more and 88 % of the odd ones, with these 96 and 95 %."""
DRIFT_TIME = 200.0
"""s, time constant of the velocity of a drifting vessel. Chosen: some minutes, as gusts and eddies last."""
_NONE = np.empty(0)
_NO_PROCESS = np.zeros(1, PROCESS)


class Outlook(NamedTuple):
    """How a vessel moves in the long run."""

    mode: Records  # (1,) MODE
    acceleration: Records  # (1,) PROCESS, of variance 0 for none
    deviation: Records  # (1,) PROCESS that waves make of the course, of variance 0 for none


def forecasts(
    record: Rows, model: Model, on_average: Model, horizons: Floats, rows: Sequence[int] | None = None
) -> Floats:
    """(rows, horizons, MOMENTS) in the plane `horizons` seconds after these rows of a record, or after the last.

    model: of the filter. on_average: the one of one mode that disperses as far in the long run, with the same states:
    future changes of mode are unknown. NaN before the first fix.
    """
    bank = empty_bank(model)
    kept = room_to_keep(0 if rows is None else len(record.time), model)
    run_model(record, model, bank, Asked(np.empty((0, 0)), _NONE, kept, 0))
    outlook = _outlook_of(on_average)
    out = np.full((1 if rows is None else len(rows), len(horizons), MOMENTS), np.nan)
    for k, moments in enumerate(out):
        if rows is not None:
            recall(kept, rows[k], bank)
        if bank.run[0].started and not math.isnan(bank.probability[0]):
            look_ahead(bank, outlook, np.asarray(horizons, float), moments)
    return out


def _outlook_of(model: Model) -> Outlook:
    def acting(on: int) -> Records:
        found = model.processes[model.processes["acts_on"] == on]
        return found if len(found) else _NO_PROCESS

    return Outlook(model.modes.view(MODE), acting(ON_ACCELERATION), acting(ON_COURSE))


@kernel
def look_ahead(bank: Bank, outlook: Outlook, horizons: Floats, out: Floats) -> None:
    """Fill `out` (horizons, MOMENTS); uses the modes of the bank up."""
    n = bank.x.shape[1]
    x, p = np.empty(n), np.empty((n, n))
    combine(bank, x, p)
    if outlook.deviation[0].variance > 0.0:
        follow_mean(x, p, outlook.deviation[0].state)
    speed, across = x[SPEED], p[COURSE, COURSE]
    lost = across > (COURSE_STD * speed) ** 2 or speed < outlook.mode[0].drift_speed
    for k in range(len(horizons)):
        if lost:
            drift(x, p, outlook, horizons[k], out[k])
        else:
            sail(x, p, outlook, horizons[k], out[k])


@kernel
def combine(bank: Bank, x: Floats, p: Floats) -> None:
    """Mean and covariance of all modes, into x (n,) and p (n, n); uses them up."""
    m, mean = len(bank.x), bank.moments[len(bank.x)]
    reference, steady = from_likeliest(bank.x, bank.p, bank.probability, bank.moments)
    for k in range(m):
        add_second_moments(bank.moments[k], bank.p[k])
    average(bank.probability, bank.moments, mean)
    take_covariance(mean, p)
    shifted(bank.x[reference], mean, steady, x, p)


@lean_kernel
def follow_mean(x: Floats, p: Floats, d: int) -> None:
    """The mean course for the course, of which state d is the deviation, and its rate, of which nothing is known."""
    x[COURSE] -= x[d]
    speed = x[SPEED]
    for i in range(len(x)):
        p[COURSE, i] -= speed * p[d, i]
    for i in range(len(x)):
        p[i, COURSE] -= speed * p[i, d]


@lean_kernel
def drift(x: Floats, p: Floats, outlook: Outlook, horizon: float, out: Floats) -> None:
    """Velocity decays to a stationary standard deviation of half of steerageway."""
    rate, c, s = 1.0 / DRIFT_TIME, math.cos(x[COURSE]), math.sin(x[COURSE])
    _, reach, _ = decaying(rate, horizon)
    spread = 2.0 * rate * (0.5 * outlook.mode[0].drift_speed) ** 2 * integral_moments(rate, horizon)[0]
    vnn = c * c * p[2, 2] - 2.0 * c * s * p[2, 3] + s * s * p[3, 3]
    vne = c * s * (p[2, 2] - p[3, 3]) + (c * c - s * s) * p[2, 3]
    vee = s * s * p[2, 2] + 2.0 * c * s * p[2, 3] + c * c * p[3, 3]
    out[0], out[1] = x[NORTH] + reach * x[SPEED] * c, x[EAST] + reach * x[SPEED] * s
    out[2] = p[0, 0] + reach * (2.0 * (c * p[0, 2] - s * p[0, 3]) + reach * vnn) + spread
    out[3] = p[0, 1] + reach * (s * p[0, 2] + c * p[0, 3] + c * p[1, 2] - s * p[1, 3] + reach * vne)
    out[4] = p[1, 1] + reach * (2.0 * (s * p[1, 2] + c * p[1, 3]) + reach * vee) + spread


@lean_kernel
def integral_moments(rate: float, t: float) -> tuple[float, float]:
    """Variance of the integral after t of a process that decays at `rate` and starts from 0, under unit white noise.

    And the covariance of that integral with the process. Times S_ω: of course, and of course and course rate.
    """
    _, once, twice = decaying(rate, t)
    both = 0.5 * once * once
    if rate * t < 0.02:
        return t**3 / 3.0 * (1.0 - 0.75 * rate * t), both
    return (twice - both) / rate, both


@lean_kernel
def course_covariance(
    p: Floats, speed: float, gain: float, later_gain: float, mode: Mode, t: float, later: float
) -> float:
    """Covariance of χ at t and at t + later."""
    area, mixed = integral_moments(mode.rate_decay, t)
    known = p[COURSE, COURSE] / speed**2 + (gain + later_gain) * p[COURSE, RATE] / speed
    known += gain * later_gain * p[RATE, RATE]
    return known + mode.rate_noise * (area + decaying(mode.rate_decay, later)[1] * mixed)


@kernel
def sail(x: Floats, p: Floats, outlook: Outlook, horizon: float, out: Floats) -> None:
    """Moments of ∫ U e^{iχ} by midpoints that are close at first and wide later, where the integrand is smooth."""
    s, w = np.empty(NODES), np.empty(NODES)
    speed, left, gain = np.empty(NODES), np.empty(NODES), np.empty(NODES)
    course, course_gain, course_variance = np.empty(NODES), np.empty(NODES), np.empty(NODES)
    mode, lasting = outlook.mode[0], outlook.acceleration[0]
    a, known = lasting.state, max(x[SPEED], 1e-3)
    push, most = 2.0 * lasting.decay * lasting.variance, (SPEED_SHARE * x[SPEED] + SPEED_ROOM) ** 2
    kept = np.empty(NODES)
    north = east = north_u = east_u = 0.0
    for k in range(NODES):
        u = (k + 0.5) / NODES
        s[k], w[k] = horizon * u * u, 2.0 * horizon * u / NODES
        left[k] = decaying(mode.speed_decay, s[k])[0]
        gain[k] = decaying(lasting.decay, s[k])[1] if a else 0.0
        kept[k] = 1.0 / math.sqrt(1.0 + push * integral_moments(lasting.decay, s[k])[0] / most) if a else 1.0
        speed[k] = max(x[SPEED] * left[k] + gain[k] * x[a] * (a > 0), 0.0)
        course_gain[k] = decaying(mode.rate_decay, s[k])[1]
        course[k] = x[COURSE] + course_gain[k] * x[RATE]
        course_variance[k] = course_covariance(p, known, course_gain[k], course_gain[k], mode, s[k], 0.0)
        weight = w[k] * math.exp(-0.5 * course_variance[k])
        c, e = weight * math.cos(course[k]), weight * math.sin(course[k])
        north_u += c * left[k]
        east_u += e * left[k]
        north += c * speed[k]
        east += e * speed[k]
    place_n, place_e = p[0, 3] / known, p[1, 3] / known
    nn = p[0, 0] + 2.0 * (p[0, 2] * north_u - place_n * east) - north * north
    ne = p[0, 1] + p[0, 2] * east_u + place_n * north + p[1, 2] * north_u - place_e * east - north * east
    ee = p[1, 1] + 2.0 * (p[1, 2] * east_u + place_e * north) - east * east
    for j in range(NODES):
        for i in range(j + 1):
            later = s[j] - s[i]
            squares = speed[i] * speed[j] + p[SPEED, SPEED] * left[i] * left[j]
            spread = mode.speed_noise * decaying(2.0 * mode.speed_decay, s[i])[1]
            squares += spread * decaying(mode.speed_decay, later)[0]
            if a:
                squares += p[SPEED, a] * (left[i] * gain[j] + left[j] * gain[i]) + p[a, a] * gain[i] * gain[j]
                area, mixed = integral_moments(lasting.decay, s[i])
                squares += push * kept[i] * kept[j] * (area + decaying(lasting.decay, later)[1] * mixed)
            squares *= w[i] * w[j] if i == j else 2.0 * w[i] * w[j]
            shared = course_covariance(p, known, course_gain[i], course_gain[j], mode, s[i], later)
            mean = 0.5 * (course_variance[i] + course_variance[j])
            apart = squares * math.exp(shared - mean) * math.cos(course[i] - course[j])
            along = squares * math.exp(-shared - mean)
            nn += 0.5 * (apart + along * math.cos(course[i] + course[j]))
            ee += 0.5 * (apart - along * math.cos(course[i] + course[j]))
            ne += 0.5 * along * math.sin(course[i] + course[j])
    out[0], out[1], out[2], out[3], out[4] = x[NORTH] + north, x[EAST] + east, nn, ne, ee
