"""Monte Carlo forecast: mean and covariance of the positions of many voyages, drawn from the modes of a filter.

Within minutes, the course spreads over all directions and modes change many times, which a Gaussian for every mode does
not represent. A voyage has a mode, a motion and noise as in the model.

The held speed of the model is a random walk, which has no bound over minutes. A voyage therefore returns to one of the
speeds of the record so far (an Ornstein–Uhlenbeck process), at a rate that gives it the variance of these speeds.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats, Ints, Records
from steerway.core.compiled import called_kernel, kernel
from steerway.estimation.filter.discrete import set_steps
from steerway.estimation.filter.forecast import MOMENTS
from steerway.estimation.filter.model import COURSE, EAST, NORTH, RATE, SPEED, Bank, Model, Step, empty_bank
from steerway.estimation.filter.motion import spin_share
from steerway.estimation.filter.row import outputs, recall, run_record
from steerway.estimation.log.course import SOG
from steerway.estimation.log.run import Track
from steerway.estimation.vessel.flat import Weighed

VOYAGES = 500
"""Number of voyages, which all structures share. σ errs by 3 %, the mean by 4 % of σ, and a forecast of ten minutes
takes 0.04 s."""
STEP = 1.0
"""Longest step of a voyage, s. A step is straight, at its mean speed and course. Short yaws last about as long."""
SHORTEST_RETURN = 60.0
"""Least time constant, s, of the return to a speed of the record. On the developing half of the logs of `steerway study
unseen-logs`, 95 % regions five minutes ahead contain 88 % of the positions without this limit and 92 % with it."""
RECORD_TIME = 600.0
"""Weight of the prior of the speed to which voyages return, expressed as the length of a record, s. The prior is
uniform between rest and twice the present speed. With half an hour, coverages change by less than 1 %."""


def forecasts(
    track: Track, structures: Sequence[Weighed], horizons: Floats, rows: Sequence[int] | None = None
) -> Floats:
    """Forecasts (rows, horizons, MOMENTS) in the plane, `horizons` (s, ascending) after these rows, or the last one."""
    horizons, weights, outs = np.asarray(horizons, float), [], []
    record = track.record
    wanted = [len(record.time) - 1] if rows is None else rows
    parts = np.diff(horizons, prepend=0.0)
    counts = np.ceil(parts / STEP).astype(int)
    for each in structures:
        model = each.model
        bank = empty_bank(model)
        found = outputs(model, len(record.time), 0 if rows is None else len(record.time))
        run_record(record, model, bank, found)
        speeds, elapsed, returns = usual_speeds(record.time, found.out[:, SOG], wanted, spread_rate(model))
        stages = stages_of(model, parts, counts)
        out = np.empty((len(wanted), len(horizons), MOMENTS))
        voyages = math.ceil(VOYAGES / len(structures))
        for row, slowly, moments in zip(wanted, returns, out, strict=True):
            if rows is not None:
                recall(found.kept, row, bank)
            past, rng = slice(row + 1), np.random.default_rng(0)
            draw_voyages(bank, stages, Past(speeds[past], elapsed[past], slowly), voyages, rng, moments)
        weights.append(each.weight)
        outs.append(out)
    return mixed(np.stack(outs), np.array(weights))


def mixed(moments: Floats, weights: Floats) -> Floats:
    """(…, MOMENTS) of the mixture of structures (s, …, MOMENTS) with these weights (s,)."""
    mean = np.tensordot(weights, moments, 1)
    apart = moments[..., :2] - mean[..., :2]
    mean[..., 2] += np.tensordot(weights, apart[..., 0] ** 2, 1)
    mean[..., 3] += np.tensordot(weights, apart[..., 0] * apart[..., 1], 1)
    mean[..., 4] += np.tensordot(weights, apart[..., 1] ** 2, 1)
    return mean


class Stages(NamedTuple):
    """The steps of voyages from each horizon to the next: the number of steps, and the numbers of a single step."""

    counts: Ints  # (horizons,)
    steps: Records  # (horizons, m) STEP
    responses: Records  # (horizons, m, driving states) RESPONSE
    change: Floats  # (horizons, m, m)


def stages_of(model: Model, parts: Floats, counts: Ints) -> Stages:
    """Stages of `parts` seconds, in `counts` steps of equal length."""
    bank, stages = empty_bank(model), []
    for part, count in zip(parts, counts, strict=True):
        if count:
            set_steps(bank, model, part / count)
        stages.append([bank.steps.copy(), bank.responses[:, : model.driving].copy(), bank.change.copy()])
    return Stages(counts, *map(np.stack, zip(*stages, strict=True)))


class Past(NamedTuple):
    """Speeds of a vessel so far, see `usual_speeds`."""

    speeds: Floats  # (rows,) m/s
    elapsed: Floats  # (rows,) s for which a speed was known, up to each row
    returns: float  # 1/s, rate at which voyages return to one of the speeds


def spread_rate(model: Model) -> float:
    """Mean density of the noise of the held speed (m²/s³), by the stationary probabilities of the modes."""
    m = len(model.modes)
    equations = np.vstack([model.generator.T, np.ones(m)])
    shares = np.linalg.lstsq(equations, np.append(np.zeros(m), 1.0), rcond=None)[0]
    return float(shares @ model.modes["speed_noise"])


def usual_speeds(time: Floats, speed: Floats, rows: Sequence[int], spread: float) -> tuple[Floats, Floats, Floats]:
    """`speeds` (n,) and `elapsed` (n,) of `Past`, and `returns` from each of `rows`; spread: see `spread_rate`."""
    known = np.isfinite(speed)
    speed = np.where(known, speed, 0.0)
    lasted = np.where(known, np.minimum(np.diff(time, prepend=time[0]), SHORTEST_RETURN), 0.0)
    elapsed = np.cumsum(lasted)
    now, whole = speed[rows], elapsed[rows] + RECORD_TIME
    mean = (np.cumsum(lasted * speed)[rows] + RECORD_TIME * now) / whole
    square = (np.cumsum(lasted * speed**2)[rows] + RECORD_TIME * 4.0 / 3.0 * now**2) / whole
    variance = np.maximum(square - mean**2, 0.0)
    return speed, elapsed, 1.0 / np.maximum(2.0 * variance / spread, SHORTEST_RETURN)


@kernel
def draw_voyages(bank: Bank, stages: Stages, past: Past, voyages: int, rng: np.random.Generator, out: Floats) -> None:
    """Fill `out` (horizons, MOMENTS) with the moments of this many voyages from a bank."""
    m, n = stages.responses.shape[1], stages.responses.shape[2]
    x, z, roots = np.empty(n), np.empty(n), np.empty((m, n, n))
    for k in range(m):
        square_root(bank.p[k], roots[k])
    out[:] = 0.0
    for _ in range(voyages):
        mode = one_of(bank.probability, rng.random())
        for a in range(n):
            z[a] = rng.standard_normal()
        draw_start(bank.x[mode], roots[mode], stages.responses[0, mode], z, x)
        if rng.random() * (past.elapsed[-1] + RECORD_TIME) < RECORD_TIME:
            usual = 2.0 * past.speeds[-1] * rng.random()
        else:
            usual = past.speeds[np.searchsorted(past.elapsed, past.elapsed[-1] * rng.random())]
        for j in range(len(stages.counts)):
            for _ in range(stages.counts[j]):
                mode = one_of(stages.change[j, mode], rng.random())
                for a in range(n):
                    z[a] = rng.standard_normal()
                step, responses = stages.steps[j, mode], stages.responses[j, mode]
                step_voyage(x, step, responses, past.returns, usual, rng.standard_normal(), z)
            add_place(x[NORTH] - bank.x[0, NORTH], x[EAST] - bank.x[0, EAST], 1.0 / voyages, out[j])
    for j in range(len(out)):
        north, east = out[j, 0], out[j, 1]
        out[j, 2] -= north * north
        out[j, 3] -= north * east
        out[j, 4] -= east * east
        out[j, 0] += bank.x[0, NORTH]
        out[j, 1] += bank.x[0, EAST]


@called_kernel
def add_place(north: float, east: float, weight: float, out: Floats) -> None:
    """Add a position (m) to sums of positions and of their squares and products, with a weight."""
    out[0] += weight * north
    out[1] += weight * east
    out[2] += weight * north * north
    out[3] += weight * north * east
    out[4] += weight * east * east


@called_kernel
def one_of(probability: Floats, u: float) -> int:
    """Index drawn by these probabilities (m,), for u uniform in [0, 1)."""
    k, below = 0, probability[0]
    while u > below and k < len(probability) - 1:
        k += 1
        below += probability[k]
    return k


@called_kernel
def square_root(p: Floats, out: Floats) -> None:
    """out (k, k) ← Cholesky factor L of the first k rows and columns of P; columns of states without variance are 0."""
    for i in range(len(out)):
        for j in range(i + 1):
            value = p[i, j]
            for k in range(j):
                value -= out[i, k] * out[j, k]
            if i == j:
                out[i, i] = math.sqrt(max(value, 0.0))
            else:
                out[i, j] = value / out[j, j] if out[j, j] > 0.0 else 0.0


@called_kernel
def draw_start(mean: Floats, root: Floats, responses: Records, z: Floats, x: Floats) -> None:
    """x (n,) ← first state of a voyage, from the mean and the root of the covariance of a mode; z: standard normal."""
    for i in range(len(x)):
        x[i] = 0.0 if i == COURSE else mean[i]
        for j in range(i + 1):
            x[i] += root[i, j] * z[j]
    swing = swing_of(x, responses)
    along, across = x[SPEED] - swing, x[COURSE]
    x[SPEED], x[COURSE] = math.hypot(along, across) + swing, mean[COURSE] + math.atan2(across, along)


@called_kernel
def swing_of(x: Floats, responses: Records) -> float:
    """Deviation of the speed from the held speed (m/s): the sum of the processes that act on it (wander, waves)."""
    swing, i = 0.0, RATE
    while i < len(x):
        if responses[i].gain != 0.0:
            swing += x[i]
        i += 2 if responses[i].spun != 0.0 else 1
    return swing


@called_kernel
def step_voyage(
    x: Floats, step: Step, responses: Records, returns: float, usual: float, sideways: float, z: Floats
) -> None:
    """One step of a voyage, straight at its mean speed and course; z (n,) and `sideways` are standard normal.

    The noise of the processes is drawn first, then that of the course, given the former. The speed has a sign, since
    waves may move a vessel backwards for a moment; a negative held speed reverses the course.
    """
    before, held = x[SPEED], x[SPEED] - swing_of(x, responses)
    spins = math.sqrt(spin_share(step, held))
    turn, own_turn = 0.0, step.xx
    i = RATE
    while i < len(x):
        pair = 2 if responses[i].spun != 0.0 else 1
        acts_on_course = responses[i].turn != 0.0
        for k in range(i, i + pair):
            variance = responses[k].added
            z[k] *= (spins if acts_on_course else 1.0) * math.sqrt(variance)
            if acts_on_course:
                share = responses[k].with_gain / variance if variance > 0.0 else 0.0
                turn += responses[k].turn * x[k] + share * z[k]
                own_turn -= share * share * variance
        a, left, spun = x[i], responses[i].left, responses[i].spun
        x[i] = left * a + z[i]
        if pair == 2:
            b = x[i + 1]
            x[i] -= spun * b
            x[i + 1] = spun * a + left * b + z[i + 1]
        i += pair
    slowness = (held / step.drift_speed) ** 2
    share = max(1.0 / (1.0 + slowness * slowness), step.sideways)
    along = held + math.sqrt(step.held_uu) * z[SPEED] + min(returns * step.dt, 1.0) * (usual - held)
    across = math.sqrt(share * step.held_uu) * sideways
    turn += spins * math.sqrt(max(own_turn, 0.0)) * z[COURSE] + math.atan2(across, along)
    x[SPEED] = math.hypot(along, across) + swing_of(x, responses)
    middle, way = x[COURSE] + 0.5 * turn, 0.5 * (before + x[SPEED]) * step.dt
    x[NORTH] += way * math.cos(middle)
    x[EAST] += way * math.sin(middle)
    x[COURSE] += turn
