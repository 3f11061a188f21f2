"""The five-state extended Kalman filter of S. Fossen and T. I. Fossen, Sensors 21, 2021, 7910, Table 1.

The state (27) is x = [x^n y^n U χ ω_χ]: position north and east (m), speed over ground (m/s), course over ground (rad)
and course rate (rad/s). A fix (28) measures the position, y = [x^n y^n].

    ẋ^n = U cos χ   (11)        U̇ = −α1 U + w1   (13)        χ̇ = ω_χ             (14)
    ẏ^n = U sin χ   (12)                                      ω̇_χ = −α2 ω_χ + w2   (15)

The filter differs from the paper in four ways. The first makes the estimate independent of the rate of the filter:

- Instead of Euler's method (18)–(22), a step follows an arc at the mean speed and turn rate of (13)–(15), integrated
  exactly. The noise w1 and w2 has spectral densities S_U and S_ω; the paper adds E_d Q_d E_dᵀ at every step.
- The covariance P belongs to the error [δx^n δy^n δU δs δω_χ] with δs = U δχ, the velocity across the course (m/s). P
stays regular at rest, where the course is undefined. Functions read and write its upper triangle.
- Below `drift_speed`, w1 also acts across the course.
- A fix is weighted by the probability β that it is not an outlier. Table 1 has β = 1.

`filter.row` is the general filter, with several modes of motion, further states, poor fixes and receiver steps. For one
mode without these, this module gives the same numbers faster. Runs of outliers are left to `filter.row`.
"""

import math
from typing import NamedTuple

from steerway.core.angles import sinc, wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, inlined_kernel, lean_kernel
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.filter.bank import LONGEST_STEP, SAME_STEP, forget_direction, loses_course
from steerway.estimation.filter.bank import advance as advance_modes
from steerway.estimation.filter.discrete import decaying, hold_speed, noise
from steerway.estimation.filter.fuse import COURSE_STD, mean_speed
from steerway.estimation.filter.model import COURSE, EAST, NORTH, RATE, SPEED, Bank, Mode, Model, Response, Run, Step
from steerway.estimation.filter.relative import corrected
from steerway.estimation.filter.row import Asked, Row, Rows, Taken, keep, row_of, take_row
from steerway.estimation.filter.vectors import Sym2, Vec2, determinant, inverse, nis, outer, plus, scaled, times, trace
from steerway.estimation.filter.weigh import DIFFUSE, OUTLIERS_LAST, RARE, outlier_density


@called_kernel
def discretise(step: Step, turn: Response, mode: Mode, h: float) -> None:
    """Discretise (13)–(15) over a step of h seconds, into `step` and into `turn`, the response to the course rate.

    w1 drives the speed u and the distance l along the course; w2 drives ω_χ, the course x and the distance y across it.
    """
    step.dt, step.sideways, step.drift_speed = h, mode.sideways, mode.drift_speed
    hold_speed(step, mode.speed_decay, mode.speed_noise)
    step.uu, step.lu, step.ll = step.held_uu, step.held_lu, step.held_ll
    turn.left, turn.turn, area = decaying(mode.rate_decay, h)
    turn.lean = area / h
    unit, density = noise(mode.rate_decay, h), mode.rate_noise
    step.yy, step.yx, step.xx = density * unit.yy, density * unit.yx, density * unit.xx
    turn.with_way, turn.with_gain, turn.added = density * unit.yw, density * unit.xw, density * unit.ww


@lean_kernel
def predict(x: Floats, p: Floats, step: Step, turn: Response) -> None:
    """State and covariance predictor of Table 1: x ← f(x) and P ← A_d P A_dᵀ + Q, where A_d (31) is the Jacobian of f.

    Names give row and column: for x^n and ω_χ, `n_w` is the entry of A_d, `nw` that of P and `n4` that of A_d P. The
    columns of x^n and y^n of A_d are those of the identity.
    """
    u, w = x[SPEED], x[RATE]
    mean = x[COURSE] + turn.lean * w
    c, s = math.cos(mean), math.sin(mean)
    ratio, slope = sinc(0.5 * turn.turn * w)
    a, bend = step.way * ratio, 0.5 * slope * u * step.way * turn.turn
    lean = turn.lean * u * a
    n_u, n_s, n_w = a * c, -a * s, bend * c - lean * s
    e_u, e_s, e_w = a * s, a * c, bend * s + lean * c
    speed, left, now = step.left, turn.left, u * step.left
    s_w = now * turn.turn
    x[NORTH] += u * n_u
    x[EAST] += u * e_u
    x[SPEED] = now
    x[COURSE] = wrap(x[COURSE] + turn.turn * w)
    x[RATE] = left * w

    uu, us, uw, ss, sw, ww = p[2, 2], p[2, 3], p[2, 4], p[3, 3], p[3, 4], p[4, 4]
    nu, ns, nw, eu, es, ew = p[0, 2], p[0, 3], p[0, 4], p[1, 2], p[1, 3], p[1, 4]
    n0 = p[0, 0] + n_u * nu + n_s * ns + n_w * nw
    n1 = p[0, 1] + n_u * eu + n_s * es + n_w * ew
    n2 = nu + n_u * uu + n_s * us + n_w * uw
    n3 = ns + n_u * us + n_s * ss + n_w * sw
    n4 = nw + n_u * uw + n_s * sw + n_w * ww
    e1 = p[1, 1] + e_u * eu + e_s * es + e_w * ew
    e2 = eu + e_u * uu + e_s * us + e_w * uw
    e3 = es + e_u * us + e_s * ss + e_w * sw
    e4 = ew + e_u * uw + e_s * sw + e_w * ww
    s3, s4 = speed * ss + s_w * sw, speed * sw + s_w * ww

    slowness = (now / step.drift_speed) ** 2
    drift = max(1.0 / (1.0 + slowness * slowness), step.sideways)
    yy = u * u * step.yy + drift * step.ll
    ys = u * now * step.yx + drift * step.lu
    y_w = u * turn.with_way
    p[0, 0] = n0 + n_u * n2 + n_s * n3 + n_w * n4 + c * c * step.ll + s * s * yy
    p[0, 1] = n1 + e_u * n2 + e_s * n3 + e_w * n4 + c * s * (step.ll - yy)
    p[0, 2] = speed * n2 + c * step.lu
    p[0, 3] = speed * n3 + s_w * n4 - s * ys
    p[0, 4] = left * n4 - s * y_w
    p[1, 1] = e1 + e_u * e2 + e_s * e3 + e_w * e4 + s * s * step.ll + c * c * yy
    p[1, 2] = speed * e2 + s * step.lu
    p[1, 3] = speed * e3 + s_w * e4 + c * ys
    p[1, 4] = left * e4 + c * y_w
    p[2, 2] = speed * speed * uu + step.uu
    p[2, 3] = speed * (speed * us + s_w * uw)
    p[2, 4] = speed * left * uw
    p[3, 3] = speed * s3 + s_w * s4 + now * now * step.xx + drift * step.uu
    p[3, 4] = left * s4 + now * turn.with_gain
    p[4, 4] = left * left * ww + turn.added


class Innovation(NamedTuple):
    """A fix compared with its prediction."""

    off: Vec2  # innovation ν = y − C_d x, m
    s: Sym2  # its covariance S = C_d P C_dᵀ + R_d, m²
    good: float  # prior probability of a fix that is not an outlier, times its density, 1/m²
    wrong: float  # prior probability of an outlier, times its density, 1/m²


@lean_kernel
def innovate(x: Floats, p: Floats, fix: Vec2, variance: float, clock: float, outlier_rate: float) -> Innovation:
    """Innovation ν of a fix (m), its covariance S, and how probable the fix is.

    R_d = `variance` I + `clock` v vᵀ: white noise (m²), and a time error of variance `clock` (s²) at velocity v.
    """
    off, s = Vec2(fix.n - x[NORTH], fix.e - x[EAST]), Sym2(p[0, 0] + variance, p[0, 1], p[1, 1] + variance)
    if clock > 0.0:
        s = plus(s, scaled(clock * x[SPEED] ** 2, outer(Vec2(math.cos(x[COURSE]), math.sin(x[COURSE])))))
    good = math.exp(-0.5 * nis(off, s)) / (2.0 * math.pi * math.sqrt(determinant(s)))
    wrong = outlier_rate * outlier_density(off, trace(s), variance)
    return Innovation(off, s, (1.0 - outlier_rate) * good, wrong)


@lean_kernel
def correct(x: Floats, p: Floats, off: Vec2, s: Sym2, beta: float, error: Floats) -> None:
    """Gain, state and covariance corrector of Table 1: K = P C_dᵀ S⁻¹, x ← x + β K ν.

    P ← P − β K S Kᵀ + β (1 − β) K ν νᵀ Kᵀ, which is probabilistic data association (Y. Bar-Shalom and X. R. Li,
    Multitarget-Multisensor Tracking, 1995, §3.4). error: workspace (5,).
    """
    information = inverse(s)
    pull = times(information, off)
    m = plus(scaled(beta, information), scaled(-beta * (1.0 - beta), outer(pull)))
    n0, n1, n2, n3, n4 = p[0, 0], p[0, 1], p[0, 2], p[0, 3], p[0, 4]
    e1, e2, e3, e4 = p[1, 1], p[1, 2], p[1, 3], p[1, 4]
    error[0], error[1] = beta * (n0 * pull.n + n1 * pull.e), beta * (n1 * pull.n + e1 * pull.e)
    error[2], error[3] = beta * (n2 * pull.n + e2 * pull.e), beta * (n3 * pull.n + e3 * pull.e)
    error[4] = beta * (n4 * pull.n + e4 * pull.e)
    a, b = n0 * m.nn + n1 * m.ne, n0 * m.ne + n1 * m.ee
    p[0, 0] -= a * n0 + b * n1
    p[0, 1] -= a * n1 + b * e1
    p[0, 2] -= a * n2 + b * e2
    p[0, 3] -= a * n3 + b * e3
    p[0, 4] -= a * n4 + b * e4
    a, b = n1 * m.nn + e1 * m.ne, n1 * m.ne + e1 * m.ee
    p[1, 1] -= a * n1 + b * e1
    p[1, 2] -= a * n2 + b * e2
    p[1, 3] -= a * n3 + b * e3
    p[1, 4] -= a * n4 + b * e4
    a, b = n2 * m.nn + e2 * m.ne, n2 * m.ne + e2 * m.ee
    p[2, 2] -= a * n2 + b * e2
    p[2, 3] -= a * n3 + b * e3
    p[2, 4] -= a * n4 + b * e4
    a, b = n3 * m.nn + e3 * m.ne, n3 * m.ne + e3 * m.ee
    p[3, 3] -= a * n3 + b * e3
    p[3, 4] -= a * n4 + b * e4
    a, b = n4 * m.nn + e4 * m.ne, n4 * m.ne + e4 * m.ee
    p[4, 4] -= a * n4 + b * e4
    corrected(x, p, error, True)


@inlined_kernel
def advance(bank: Bank, model: Model, h: float) -> None:
    """Predict by h > 0 seconds, at most `LONGEST_STEP`."""
    x, p, step, turn = bank.x[0], bank.p[0], bank.steps[0], bank.responses[0, RATE]
    bank.run[0].since += h
    if abs(h - step.dt) > SAME_STEP * h:
        discretise(step, turn, model.modes[0], h)
    predict(x, p, step, turn)
    if loses_course(x, p):
        fill_lower(p)
        forget_direction(x, p)


@inlined_kernel
def take_fix(bank: Bank, model: Model, fix: Vec2, excess: float) -> Taken:
    """Correct by a fix. For a probable outlier nothing is changed, and the returned numbers are NaN.

    excess: factor on the usual variance of the white noise.
    """
    x, p, run, receiver = bank.x[0], bank.p[0], bank.run[0], model.receiver[0]
    variance = excess * receiver.fix_variance
    rate = receiver.outlier_rate * (1.0 - run.was_outlier) + OUTLIERS_LAST * run.was_outlier
    seen = innovate(x, p, fix, variance, receiver.time_variance, rate)
    total = seen.good + seen.wrong
    if not seen.wrong < 0.5 * total:
        return Taken(math.nan, math.nan, math.nan)
    run.apart, run.since, run.was_outlier = run.since, 0.0, seen.wrong / total
    first = trace(seen.s) > DIFFUSE * variance and seen.wrong < RARE * total
    correct(x, p, seen.off, seen.s, 1.0 if first else seen.good / total, bank.rows[2])
    return Taken(nis(seen.off, seen.s), math.log(total), seen.wrong / total)


@inlined_kernel
def is_usual(run: Run) -> bool:
    """Whether a filter has begun, its last fix was not an outlier and it follows no step of the receiver."""
    return run.started == 1 and run.outliers == 0.0 and run.step_north == 0.0 and run.step_east == 0.0


@inlined_kernel
def wait(bank: Bank, model: Model, dt: float) -> None:
    """Predict to a row without a fix."""
    if is_usual(bank.run[0]) and dt <= LONGEST_STEP:
        if dt > 0.0:
            advance(bank, model, dt)
    elif bank.run[0].started and dt > 0.0:
        wait_longer(bank, model, dt)


@called_kernel
def wait_longer(bank: Bank, model: Model, dt: float) -> None:
    """Predict by the general filter: called and not inlined, as `leave` is."""
    fill_lower(bank.p[0])
    advance_modes(bank, model, dt)


@inlined_kernel
def take(bank: Bank, model: Model, row: Row) -> Taken:
    """Predict to a row and take its fix, as `take_row` does for a row without aids."""
    fixed, dt = math.isfinite(row.north) and math.isfinite(row.east), row.dt
    if is_usual(bank.run[0]) and dt <= LONGEST_STEP:
        if dt > 0.0:
            advance(bank, model, dt)
        if not fixed:
            return Taken(math.nan, 0.0, math.nan)
        taken = take_fix(bank, model, Vec2(row.north, row.east), row.excess)
        if not math.isnan(taken.wrong):
            return taken
        dt = 0.0
    return leave(bank, model, Row(dt, row.north, row.east, row.excess))


@called_kernel
def leave(bank: Bank, model: Model, row: Row) -> Taken:
    """Take a row by the general filter. Inlined, this rare call would slow down all other rows."""
    fill_lower(bank.p[0])
    return take_row(bank, model, row, bank.rows[0, :0])


@called_kernel
def run(rows: Rows, model: Model, bank: Bank, asked: Asked) -> None:
    """Filter a record without aids, as `run_record` does, and fill `asked.out` and `asked.kept`."""
    r = 0
    for k in range(len(rows.time)):
        if r < len(rows.restarts) and rows.restarts[r] == k:
            r += 1
            bank.run[0].started = 0
        taken = take(bank, model, row_of(rows, k, bank.run[0].started == 0))
        if len(asked.out):
            state_row(bank, model, asked.out[k])
            asked.out[k, -2], asked.out[k, -1] = taken.nis, taken.wrong
        if len(asked.kept.x):
            fill_lower(bank.p[0])
            keep(bank, asked.kept, k)
    fill_lower(bank.p[0])


@lean_kernel
def state_row(bank: Bank, model: Model, out: Floats) -> None:
    """Write the estimate after a row into `out` (FUSED or more), as `row.state_row` does; NaN before the first fix."""
    x, p = bank.x[0], bank.p[0]
    if bank.run[0].started == 0:
        for i in range(len(out)):
            out[i] = math.nan
        return
    speed = mean_speed(x, p, model.modes[0])
    out[0], out[1], out[2], out[3], out[4] = x[NORTH], x[EAST], speed, wrap(x[COURSE]), x[RATE]
    out[5], out[6], out[7] = p[2, 2], p[3, 3] / max(speed * speed, 1e-12), p[4, 4]
    out[8] = 0.5 * (p[0, 0] + p[1, 1])


@lean_kernel
def write_estimate(bank: Bank, model: Model, steerageway: float, estimate: Floats) -> None:
    """Write the estimate after a row into `estimate` (9,), as a user gets it; columns: see `log.course`.

    Course and course rate are NaN below `steerageway` (m/s), and where the course has a σ of COURSE_STD or more.
    """
    state_row(bank, model, estimate)
    for i in range(5, 9):
        estimate[i] = math.sqrt(estimate[i])
    if not (estimate[6] < COURSE_STD and estimate[2] >= steerageway):
        estimate[3] = estimate[4] = estimate[6] = estimate[7] = math.nan


def is_plain(model: Model, aids: Floats) -> bool:
    """Whether this filter can run a model with these aids: one mode, five states, no poor fixes, steps or aids."""
    receiver, mode = model.receiver[0], model.modes[0]
    extras = receiver.poor_rate, receiver.step_rate, mode.sideways
    return len(model.modes) == 1 and model.states == 5 and not any(extras) and len(aids) == 0
