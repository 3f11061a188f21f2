"""The general filter, row by row: predict every mode to the time of a row, then correct by its fix and its aids.

A bank holds a Gaussian for every mode of motion. `bank` mixes and predicts them, `weigh` corrects them by a fix, `aids`
by other instruments, and `fuse` makes one estimate of them.
"""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats, Ints, Records
from steerway.core.compiled import called_kernel, inlined_kernel
from steerway.estimation.filter.aids import take_aids
from steerway.estimation.filter.bank import advance, start
from steerway.estimation.filter.fuse import COURSE_VARIANCE, SOG_VARIANCE, add_unresolved_speed, fuse
from steerway.estimation.filter.model import COURSE, FUSED, ON_ACCELERATION, SPEED, Bank, Kept, Model, room_to_keep
from steerway.estimation.filter.weigh import take_fix


class Row(NamedTuple):
    """A fix, and the time since the row before."""

    dt: float  # s, ≥ 0
    north: float  # m, NaN for a row without a fix
    east: float
    excess: float  # factor on the usual variance of the white noise of the fix


class Taken(NamedTuple):
    """Statistics of a row."""

    nis: float  # of the fix for the mean of all modes; NaN without a fix and for the first one
    log_density: float  # of the fix and the aids, given all rows before
    wrong: float  # probability that the fix is an outlier; NaN without a fix and for the first one


@inlined_kernel
def take_row(bank: Bank, model: Model, row: Row, aids: Floats) -> Taken:
    """Start at the first fix; later predict to the time of the row and correct by its fix and its aids, if any."""
    fixed = math.isfinite(row.north) and math.isfinite(row.east)
    nis, log_density, wrong = math.nan, 0.0, math.nan
    if bank.run[0].started == 0:
        if fixed:
            start(bank, model, row.north, row.east)
    else:
        if row.dt > 0.0:
            advance(bank, model, row.dt)
        if fixed:
            nis, log_density, wrong = take_fix(bank, model, row.north, row.east, row.excess)
        log_density += take_aids(bank, model, aids)
    return Taken(nis, log_density, wrong)


class Rows(NamedTuple):
    """A record: time, fix and aids of every row, and the rows at which the filter starts again."""

    time: Floats  # (n,) s
    north: Floats  # (n,) m, NaN for a row without a fix
    east: Floats
    excess: Floats  # (n or 0,) factor on the usual variance of the white noise of a fix
    aids: Floats  # (n or 0, aids), NaN where unknown
    restarts: Ints  # (r,) rows at which the filter starts again
    quantum: tuple[float, float] = (0.0, 0.0)  # last digit of a fix north and east, m; 0: not rounded


class Asked(NamedTuple):
    """Outputs of a run over n rows; an output of length 0 is not filled."""

    out: Floats  # (n or 0, FUSED + 2): `state_row`, NIS and probability of an outlier
    density: Floats  # (n or 0,) log density of every row that counts; others are not written
    kept: Kept  # of n or 0 rows, for the smoother
    settling: int  # fixes after a start that do not count in the likelihood


def outputs(model: Model, estimates: int = 0, kept: int = 0) -> Asked:
    """Memory for the estimates, and for the modes, of this many rows."""
    return Asked(np.empty((estimates, FUSED + 2)), np.empty(0), room_to_keep(kept, model), 0)


@called_kernel
def run_record(rows: Rows, model: Model, bank: Bank, asked: Asked) -> float:
    """Filter a record and fill `asked`. Returns the log likelihood without the first `settling` fixes after a start."""
    run, total, since, r = bank.run[0], 0.0, 0, 0
    for k in range(len(rows.time)):
        if r < len(rows.restarts) and rows.restarts[r] == k:
            r += 1
            run.started = 0
        begins = run.started == 0
        row = row_of(rows, k, begins)
        taken = take_row(bank, model, row, rows.aids[k] if len(rows.aids) else rows.north[:0])
        if begins:
            since = 0
        elif math.isfinite(row.north) and math.isfinite(row.east):
            since += 1
        if since > asked.settling:
            total += taken.log_density
            if len(asked.density):
                asked.density[k] = taken.log_density
        if len(asked.out):
            state_row(bank, model, asked.out[k])
            asked.out[k, -2], asked.out[k, -1] = taken.nis, taken.wrong
        if len(asked.kept.x):
            keep(bank, asked.kept, k)
    return total


@inlined_kernel
def row_of(rows: Rows, k: int, begins: bool) -> Row:
    """Row k of a record."""
    dt = 0.0 if begins else rows.time[k] - rows.time[k - 1]
    return Row(dt, rows.north[k], rows.east[k], rows.excess[k] if len(rows.excess) else 1.0)


@called_kernel
def state_row(bank: Bank, model: Model, out: Floats) -> None:
    """Write the estimate of all modes after a row into `out` (FUSED or more); NaN before the first fix."""
    run = bank.run[0]
    if run.started == 0:
        for i in range(len(out)):
            out[i] = math.nan
        return
    fuse(bank.x, bank.p, bank.probability, model, bank.rows[0], out)
    if len(bank.x) == 1:
        take_sense(bank.x[0], bank.p[0], model.processes, out)
    add_unresolved_speed(model.processes, max(run.since, run.apart), out)


@called_kernel
def take_sense(x: Floats, p: Floats, processes: Records, out: Floats) -> None:
    """If the acceleration along the course is a state, allow in `out` (FUSED) for a vessel that may run backwards.

    Such a vessel may have any speed along a line. SOG is then that of the mean velocity, and the variance of the course
    includes the probability of the opposite direction.
    """
    for f in range(len(processes)):
        if processes[f].acts_on == ON_ACCELERATION:
            speed, variance = x[SPEED], p[SPEED, SPEED]
            out[2], out[SOG_VARIANCE] = speed, variance
            out[COURSE_VARIANCE] = p[COURSE, COURSE] / max(speed * speed, 1e-12)
            out[COURSE_VARIANCE] += 0.5 * math.pi**2 * math.erfc(speed / math.sqrt(2.0 * variance))
            return


@called_kernel
def keep(bank: Bank, kept: Kept, k: int) -> None:
    """Copy the modes into row k."""
    m, n = bank.x.shape
    for i in range(m):
        kept.probability[k, i] = bank.probability[i] if bank.run[0].started else math.nan
        for a in range(n):
            kept.x[k, i, a] = bank.x[i, a]
            for b in range(n):
                kept.p[k, i, a, b] = bank.p[i, a, b]


@called_kernel
def recall(kept: Kept, k: int, bank: Bank) -> None:
    """Copy the modes from row k."""
    m, n = bank.x.shape
    for i in range(m):
        bank.probability[i] = kept.probability[k, i]
        for a in range(n):
            bank.x[i, a] = kept.x[k, i, a]
            for b in range(n):
                bank.p[i, a, b] = kept.p[k, i, a, b]
