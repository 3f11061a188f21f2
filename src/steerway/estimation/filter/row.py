"""The filter, row by row: what happens to a bank of modes between two fixes, and what a fix does to it."""

import math
from typing import NamedTuple

from steerway.core.arrays import Floats, Ints, Records
from steerway.core.compiled import called_kernel, inlined_kernel
from steerway.estimation.filter.aids import take_aids
from steerway.estimation.filter.bank import advance, start
from steerway.estimation.filter.fuse import COURSE_VARIANCE, SOG_VARIANCE, add_unresolved_speed, fuse
from steerway.estimation.filter.model import COURSE, ON_ACCELERATION, SPEED, Bank, Kept, Model
from steerway.estimation.filter.weigh import take_fix


class Row(NamedTuple):
    """The measurements of one time, as a filter takes them."""

    dt: float  # s since the row before, ≥ 0
    north: float  # m, NaN of a row without a fix
    east: float
    excess: float  # how many times its usual variance the white noise of the fix has


class Taken(NamedTuple):
    """What a filter says of a row; of one that is no fix, or the first, NaN, the log density of aids, and NaN."""

    nis: float  # of the mean of all modes
    log_density: float
    wrong: float  # probability of an outlier


@inlined_kernel
def take_row(bank: Bank, model: Model, row: Row, aids: Floats) -> Taken:
    """Begin at the first fix; then predict to the row's time, weigh and take its fix, and its aids (a or 0,)."""
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
    """A record: fixes and aids of every row, and where the filter begins anew."""

    time: Floats  # (n,) s
    north: Floats  # (n,) m, NaN where a row is no fix
    east: Floats
    excess: Floats  # (n or 0,) how many times its usual variance the noise of a fix has
    aids: Floats  # (n or 0, aids), NaN where unknown
    restarts: Ints  # (r,) rows at which the filter begins anew
    quantum: tuple[float, float] = (0.0, 0.0)  # last digit of a fix north and east, m; 0: not rounded


class Asked(NamedTuple):
    """What is asked of a run over n rows, filled as far as there is room."""

    out: Floats  # (n or 0, FUSED + 2): `state_row`, NIS and the probability of an outlier
    density: Floats  # (n or 0,) log density of every row that counts, else 0
    kept: Kept  # of n or 0 rows, for the smoother
    settling: int  # fixes after a start that do not count


@called_kernel
def run_record(rows: Rows, model: Model, bank: Bank, asked: Asked) -> float:
    """Over a record (Rows). Returns the sum of log densities of what counts: all but the first fixes after a start."""
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
    """What all modes say after a row, into `out` (≥ FUSED); NaN before the first fix."""
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
    """If acceleration acts along the course, change in `out` (FUSED) what depends on the sense of the motion.

    A vessel that may have any speed, forwards or backwards, has that of its mean velocity, and its course is known but
    for the sense.
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
