"""A record through the bank, row by row."""

import math

from steerway.core.compiled import called_kernel, inlined_kernel
from steerway.estimation.inference.aids import take_aids
from steerway.estimation.inference.bank import advance, start
from steerway.estimation.inference.fuse import add_unresolved_speed, fuse
from steerway.estimation.inference.model import APART, SINCE, STARTED
from steerway.estimation.inference.weigh import take_fix


@called_kernel
def run_record(time, north, east, excess, aids, model, bank, motion_states, restarts, out, density, judged, kept):
    """Over a record. Returns the sum of log densities of what counts: fixes and aids but for the first after a start.

    Args:
        time: (n,) s. north, east: (n,) m, NaN where a row is no fix. excess: (n or 0,), see `take_fix`. aids: (n or 0,
            5), NaN where unknown. restarts: (r,) rows at which the filter begins anew.
        out: (n or 0, FUSED + 2) filled: `state_row`, NIS and the probability of an outlier.
        density: (n or 0,) filled: log density of every row that counts, else 0.
        judged: rows after a start that do not count.
        kept: of n or 0 rows, filled for the smoother.
    """
    total = 0.0
    since, r = 0, 0
    run = bank.run
    for k in range(len(time)):
        fixed = math.isfinite(north[k]) and math.isfinite(east[k])
        begins = r < len(restarts) and restarts[r] == k
        if begins:
            r += 1
            run[STARTED] = 0.0
        begins = run[STARTED] == 0.0
        dt = 0.0 if begins else time[k] - time[k - 1]
        variance_scale = excess[k] if len(excess) else 1.0
        nis, log_density, wrong = take_row(bank, model, dt, north[k], east[k], variance_scale, motion_states)
        if begins:
            since = 0
        else:
            since += 1 if fixed else 0
            if len(aids):
                log_density += take_aids(bank, model, aids[k])
            if since > judged:
                total += log_density
                if len(density):
                    density[k] = log_density
        if len(out):
            if run[STARTED] == 0.0:
                for i in range(out.shape[1]):
                    out[k, i] = math.nan
            else:
                state_row(bank, model, out[k])
            out[k, -2], out[k, -1] = nis, wrong
        if len(kept.x):
            keep(bank, kept, k)
            if run[STARTED] == 0.0:
                kept.probability[k, 0] = math.nan
    return total


@inlined_kernel
def take_row(bank, model, dt, north, east, excess, motion_states):
    """One row: begin at its fix, or predict by dt ≥ 0 s and take it, where it has one (m; NaN: none).

    Returns NIS, log density and probability of an outlier, of a row that is no fix or begins NaN, 0 and NaN.
    """
    fixed = math.isfinite(north) and math.isfinite(east)
    if bank.run[STARTED] == 0.0:
        if fixed:
            start(bank, model, north, east)
    else:
        if dt > 0.0:
            advance(bank, model, dt, motion_states)
        if fixed:
            return take_fix(bank, model, north, east, excess)
    return math.nan, 0.0, math.nan


@called_kernel
def state_row(bank, model, out):
    """What all modes say after a row, into `out` (≥ FUSED)."""
    fuse(bank.x, bank.p, bank.probability, model.filters, bank.work[0], out)
    add_unresolved_speed(model.filters, max(bank.run[SINCE], bank.run[APART]), out)


@called_kernel
def keep(bank, kept, k):
    """Copy the modes into row k."""
    m, n = bank.x.shape
    for i in range(m):
        kept.probability[k, i] = bank.probability[i]
        for a in range(n):
            kept.x[k, i, a] = bank.x[i, a]
            for b in range(n):
                kept.p[k, i, a, b] = bank.p[i, a, b]


@called_kernel
def recall(kept, k, x, p, probability):
    """Copy the modes from row k."""
    m, n = x.shape
    for i in range(m):
        probability[i] = kept.probability[k, i]
        for a in range(n):
            x[i, a] = kept.x[k, i, a]
            for b in range(n):
                p[i, a, b] = kept.p[k, i, a, b]
