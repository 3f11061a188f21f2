"""Interacting multiple models: one Gaussian a mode, mixed before every step and weighed by every fix.

H. A. P. Blom and Y. Bar-Shalom, IEEE Trans. Automatic Control 33(8), 1988. Modes change in continuous time, so that
neither the rate of fixes nor a gap changes the tuning.
"""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.inference.aids import take_aids
from steerway.estimation.inference.discrete import set_steps
from steerway.estimation.inference.fix import correct, of_fix, project
from steerway.estimation.inference.model import (
    ACTS_ON,
    COURSE,
    DRIFT_SPEED,
    EAST,
    FIX_VARIANCE,
    FREQUENCY,
    NORTH,
    ON_FIX,
    ON_RATE,
    OUTLIER_RATE,
    POOR_RATE,
    RATE,
    SPEED,
    STATE,
    TIME_VARIANCE,
    VARIANCE,
)
from steerway.estimation.inference.motion import predict, turn_pair

_NEGLIGIBLE = 1e-5
"""Part that one mode has in another below which it is left out."""
_STEADY = 3.0
"""Speed in standard deviations across the course above which modes are averaged as speeds and courses, not vectors."""
LONGEST_STEP = 3.0
"""s; a longer interval is predicted in equal parts of at most this."""
MOST_STEPS = 150
"""In an interval between fixes; with longer steps over several minutes the mixture is off by too much afterwards."""
SAME_STEP = 1e-4
"""Part of a step by which clocks err."""
START_SPEED_STD, START_RATE_STD = 10.0, 0.2
"""m/s, rad/s: of a vessel of which nothing is known."""
START_PROBABILITY = (0.55, 0.2, 0.15, 0.09, 0.01)
"""Of the modes of a vessel of which nothing is known."""
LEAST_OUTLIER, DECADES = 10.0, 10.0
"""An outlier is off by any distance from so many standard deviations of a fix to km, as likely in every decade:
density 1/(2π (ρ² + a²) L) with a (m) and L = ln (km / a), about 10 for any receiver."""
POOR = 6.0
"""How many times as large the noise of a poor fix is."""
OUTLIERS_LAST = 0.5
"""Probability that a fix after an outlier is one too."""
SAME_OFFSET = 0.5
"""Probability that it is then off by the same."""
RUN_FOLLOWED = 4
"""So many outliers in a row that agree are a step of the receiver, and their position is followed."""

RETURNS = 0.5
"""Probability that the receiver then returns by the same step."""

RUN, RUN_N, RUN_E, WAS_OUTLIER, STARTED, STEP_N, STEP_E = range(7)
"""`run`: how many outliers in a row agree, their offset, the probability that the last fix was one; 1 once begun; the
step last followed."""


@called_kernel
def start(bank, model, north, east):
    """Begin from one fix: its place, and a velocity about which nothing is known."""
    x, p, probability, run = bank.x, bank.p, bank.probability, bank.run
    m, n = x.shape
    filters = model.filters
    for k in range(m):
        for i in range(n):
            x[k, i] = 0.0
            for j in range(n):
                p[k, i, j] = 0.0
        x[k, NORTH], x[k, EAST] = north, east
        p[k, 0, 0] = p[k, 1, 1] = model.receiver[FIX_VARIANCE]
        p[k, 2, 2] = p[k, 3, 3] = START_SPEED_STD**2
        p[k, 4, 4] = START_RATE_STD**2
        for f in range(len(filters)):
            j, variance = int(filters[f, STATE]), filters[f, VARIANCE]
            p[k, j, j] = variance
            if filters[f, ACTS_ON] == ON_FIX or filters[f, FREQUENCY] > 0.0:
                p[k, j + 1, j + 1] = variance
            if filters[f, ACTS_ON] == ON_FIX:
                for i in range(2):
                    p[k, i, i] += variance
                    p[k, i, j + i] = p[k, j + i, i] = -variance
        probability[k] = START_PROBABILITY[k]
    for i in range(len(run)):
        run[i] = 0.0
    run[STARTED] = 1.0


@called_kernel
def mix(bank):
    """What each mode starts a step from: all of them, as likely as each of them led to it."""
    x, p, mixed_x, mixed_p = bank.x, bank.p, bank.mixed_x, bank.mixed_p
    probability, change, work = bank.probability, bank.change, bank.work
    m, n = x.shape
    reference = 0
    for k in range(1, m):
        if probability[k] > probability[reference]:
            reference = k
    across = 0.0
    for k in range(m):
        bend = wrap(x[k, COURSE] - x[reference, COURSE])
        across += probability[k] * (p[k, 3, 3] + (x[k, SPEED] * math.sin(bend)) ** 2)
    steady = x[reference, SPEED] > _STEADY * math.sqrt(across)
    for k in range(m):
        bend = wrap(x[k, COURSE] - x[reference, COURSE])
        for i in range(n):
            work[k, i] = x[k, i] - x[reference, i]
        if steady:
            work[k, COURSE] = bend * x[reference, SPEED]
        else:
            c, s = math.cos(bend), math.sin(bend)
            work[k, SPEED] = x[k, SPEED] * c - x[reference, SPEED]
            work[k, COURSE] = x[k, SPEED] * s
            turn_pair(p, k, SPEED, c, s)
            for i in range(n):
                for j in range(i):
                    p[k, i, j] = p[k, j, i]
    for k in range(m):
        for a in range(n):
            for b in range(n):
                p[k, a, b] += work[k, a] * work[k, b]
    flat, mixed_flat = p.reshape((m, n * n)), mixed_p.reshape((m, n * n))
    for j in range(m):
        total = 0.0
        for i in range(m):
            total += probability[i] * change[i, j]
        work[m + 1, j] = total
        w0, w1, w2 = (
            probability[0] * change[0, j] / total,
            probability[1] * change[1, j] / total,
            probability[2] * change[2, j] / total,
        )
        w3, w4 = probability[3] * change[3, j] / total, probability[4] * change[4, j] / total
        for a in range(n * n):
            mixed_flat[j, a] = w0 * flat[0, a] + w1 * flat[1, a] + w2 * flat[2, a] + w3 * flat[3, a] + w4 * flat[4, a]
        for a in range(n):
            work[m, a] = w0 * work[0, a] + w1 * work[1, a] + w2 * work[2, a] + w3 * work[3, a] + w4 * work[4, a]
            mixed_x[j, a] = x[reference, a] + work[m, a]
        for a in range(n):
            for b in range(n):
                mixed_p[j, a, b] -= work[m, a] * work[m, b]
        if steady:
            mixed_x[j, COURSE] = wrap(x[reference, COURSE] + work[m, COURSE] / x[reference, SPEED])
        else:
            along, sideways = x[reference, SPEED] + work[m, SPEED], work[m, COURSE]
            angle = math.atan2(sideways, along)
            mixed_x[j, SPEED] = math.hypot(along, sideways)
            mixed_x[j, COURSE] = wrap(x[reference, COURSE] + angle)
            turn_pair(mixed_p, j, SPEED, math.cos(angle), -math.sin(angle))
            for a in range(n):
                for b in range(a):
                    mixed_p[j, a, b] = mixed_p[j, b, a]
    total = 0.0
    for j in range(m):
        total += work[m + 1, j]
    for j in range(m):
        probability[j] = work[m + 1, j] / total


@called_kernel
def advance(bank, model, dt, motion_states):
    """Predict by dt > 0 seconds."""
    x, p, mixed_x, mixed_p, steps = bank.x, bank.p, bank.mixed_x, bank.mixed_p, bank.steps
    m, n = x.shape
    parts = min(max(math.ceil(dt / LONGEST_STEP - 1e-3), 1), MOST_STEPS)
    part = dt / parts
    if abs(part - steps[0, 0, 0]) > SAME_STEP * part:
        set_steps(steps, bank.change, bank.work, part, model)
    for _ in range(parts):
        mix(bank)
        for k in range(m):
            for i in range(n):
                x[k, i] = mixed_x[k, i]
                for j in range(n):
                    p[k, i, j] = mixed_p[k, i, j]
            predict(x, p, k, steps[k], motion_states, model.receiver[DRIFT_SPEED], bank.work)


@lean_kernel
def outlier_density(nu_n, nu_e, spread, variance):
    """Density (1/m²) of an outlier so far from the predicted fix, which is uncertain by `spread` (m²) itself."""
    return 1.0 / (2.0 * math.pi * DECADES * (nu_n * nu_n + nu_e * nu_e + spread + LEAST_OUTLIER**2 * variance))


@called_kernel
def take_fix(bank, model, north, east, excess):
    """Weigh and take a fix. Returns (NIS of the mean of all modes, log density, probability of an outlier).

    A fix is good, poor (its noise POOR times as large) or an outlier; in every mode all three are weighed, and the
    correction is their mean (probabilistic data association: Y. Bar-Shalom and X. R. Li, Multitarget-Multisensor
    Tracking, 1995, §3.4): x ← x + C Σ β_h s_h and P ← P − C (Σ β_h (S_h⁻¹ − s_h s_hᵀ) + s̄ s̄ᵀ) Cᵀ with C = P Hᵀ,
    s_h = S_h⁻¹ ν, s̄ = Σ β_h s_h.
    excess: how many times its usual variance the white noise of this fix has.
    """
    x, p, probability, run, work = bank.x, bank.p, bank.probability, bank.run, bank.work
    m = x.shape[0]
    filters, receiver = model.filters, model.receiver
    variance, clock = excess * receiver[FIX_VARIANCE], receiver[TIME_VARIANCE]
    return_step(bank, model, north, east, excess)
    wrong_prior = receiver[OUTLIER_RATE] * (1.0 - run[WAS_OUTLIER]) + OUTLIERS_LAST * run[WAS_OUTLIER]
    poor_prior = (1.0 - wrong_prior) * receiver[POOR_RATE]
    good_prior = 1.0 - wrong_prior - poor_prior
    density = work[8]
    mean_n = mean_e = mean_nn = mean_ne = mean_ee = 0.0
    total = wrong = 0.0
    least = math.inf
    for k in range(m):
        pc_n, pc_e = work[0], work[1]
        at_n, at_e = project(x, p, k, filters, pc_n, pc_e)
        s_nn, s_ne, s_ee = of_fix(x, k, filters, pc_n, pc_e)
        if clock > 0.0:
            v_n, v_e = x[k, SPEED] * math.cos(x[k, COURSE]), x[k, SPEED] * math.sin(x[k, COURSE])
            s_nn, s_ne, s_ee = s_nn + clock * v_n * v_n, s_ne + clock * v_n * v_e, s_ee + clock * v_e * v_e
        s_nn, s_ee = s_nn + variance, s_ee + variance
        nu_n, nu_e = north - at_n, east - at_e
        outlier = outlier_density(nu_n, nu_e, s_nn + s_ee, variance)
        if run[RUN] > 0.0:
            same = gaussian(nu_n - run[RUN_N], nu_e - run[RUN_E], s_nn + variance, s_ne, s_ee + variance)
            outlier = (1.0 - SAME_OFFSET) * outlier + SAME_OFFSET * same
        outlier *= wrong_prior
        usual = good_prior * gaussian(nu_n, nu_e, s_nn, s_ne, s_ee)
        added = (POOR * POOR - 1.0) * variance
        poor = poor_prior * gaussian(nu_n, nu_e, s_nn + added, s_ne, s_ee + added)
        whole = usual + poor + outlier
        weight = probability[k]
        density[k] = weight * whole
        total += weight * whole
        wrong += weight * outlier
        mean_n += weight * nu_n
        mean_e += weight * nu_e
        mean_nn += weight * (s_nn + nu_n * nu_n)
        mean_ne += weight * (s_ne + nu_n * nu_e)
        mean_ee += weight * (s_ee + nu_e * nu_e)
        least = min(least, s_nn + s_ee)
        good, poor = usual / whole, poor / whole
        determinant = s_nn * s_ee - s_ne * s_ne
        i_nn, i_ne, i_ee = s_ee / determinant, -s_ne / determinant, s_nn / determinant
        s_n, s_e = i_nn * nu_n + i_ne * nu_e, i_ne * nu_n + i_ee * nu_e
        m_nn, m_ne, m_ee = good * (i_nn - s_n * s_n), good * (i_ne - s_n * s_e), good * (i_ee - s_e * s_e)
        mean_s_n, mean_s_e = good * s_n, good * s_e
        if poor > 1e-6:
            s_nn, s_ee = s_nn + added, s_ee + added
            determinant = s_nn * s_ee - s_ne * s_ne
            i_nn, i_ne, i_ee = s_ee / determinant, -s_ne / determinant, s_nn / determinant
            s_n, s_e = i_nn * nu_n + i_ne * nu_e, i_ne * nu_n + i_ee * nu_e
            m_nn, m_ne, m_ee = (
                m_nn + poor * (i_nn - s_n * s_n),
                m_ne + poor * (i_ne - s_n * s_e),
                m_ee + poor * (i_ee - s_e * s_e),
            )
            mean_s_n, mean_s_e = mean_s_n + poor * s_n, mean_s_e + poor * s_e
        m_nn, m_ne, m_ee = m_nn + mean_s_n * mean_s_n, m_ne + mean_s_n * mean_s_e, m_ee + mean_s_e * mean_s_e
        correct(x, p, k, pc_n, pc_e, m_nn, m_ne, m_ee, mean_s_n, mean_s_e)
    for k in range(m):
        probability[k] = density[k] / total
    mean_nn, mean_ne, mean_ee = mean_nn - mean_n * mean_n, mean_ne - mean_n * mean_e, mean_ee - mean_e * mean_e
    nis = (mean_ee * mean_n * mean_n - 2.0 * mean_ne * mean_n * mean_e + mean_nn * mean_e * mean_e) / (
        mean_nn * mean_ee - mean_ne * mean_ne
    )
    follow_run(bank, mean_n, mean_e, wrong / total, least)
    return nis, math.log(total), wrong / total


@lean_kernel
def follow_run(bank, nu_n, nu_e, wrong, spread):
    """Count outliers in a row that agree; a step of the receiver is followed in position, and the motion kept."""
    run = bank.run
    run[WAS_OUTLIER] = wrong
    if wrong < 0.5:
        run[RUN] = 0.0
        return
    a, b = nu_n - run[RUN_N], nu_e - run[RUN_E]
    if run[RUN] > 0.0 and a * a + b * b < 9.0 * spread:
        run[RUN] += 1.0
        run[RUN_N] += a / run[RUN]
        run[RUN_E] += b / run[RUN]
    else:
        run[RUN], run[RUN_N], run[RUN_E] = 1.0, nu_n, nu_e
    if run[RUN] >= RUN_FOLLOWED:
        shift(bank, run[RUN_N], run[RUN_E], spread / RUN_FOLLOWED)


@lean_kernel
def shift(bank, north, east, variance):
    """Follow a step of the receiver in position, and keep the motion."""
    run, x, p = bank.run, bank.x, bank.p
    for k in range(x.shape[0]):
        x[k, NORTH] += north
        x[k, EAST] += east
        p[k, 0, 0] += variance
        p[k, 1, 1] += variance
    run[RUN] = run[WAS_OUTLIER] = 0.0
    run[STEP_N] += north
    run[STEP_E] += east


@called_kernel
def return_step(bank, model, north, east, excess):
    """Undo the step last followed where a fix is likelier so."""
    x, p, probability, run, work = bank.x, bank.p, bank.probability, bank.run, bank.work
    if run[STEP_N] == 0.0 and run[STEP_E] == 0.0:
        return
    variance = excess * model.receiver[FIX_VARIANCE]
    stays = returns = 0.0
    for k in range(x.shape[0]):
        at_n, at_e = project(x, p, k, model.filters, work[0], work[1])
        s_nn, s_ne, s_ee = of_fix(x, k, model.filters, work[0], work[1])
        s_nn, s_ee = s_nn + variance, s_ee + variance
        a, b = north - at_n, east - at_e
        stays += probability[k] * gaussian(a, b, s_nn, s_ne, s_ee)
        s_nn, s_ee = s_nn + variance, s_ee + variance
        returns += probability[k] * gaussian(a + run[STEP_N], b + run[STEP_E], s_nn, s_ne, s_ee)
    if RETURNS * model.receiver[OUTLIER_RATE] * returns > stays:
        shift(bank, -run[STEP_N], -run[STEP_E], variance)
        run[STEP_N] = run[STEP_E] = 0.0


@lean_kernel
def gaussian(a, b, s_nn, s_ne, s_ee):
    """Density (1/m²) of an innovation (a, b)."""
    determinant = s_nn * s_ee - s_ne * s_ne
    nis = (s_ee * a * a - 2.0 * s_ne * a * b + s_nn * b * b) / determinant
    return math.exp(-0.5 * nis) / (2.0 * math.pi * math.sqrt(determinant))


@lean_kernel
def course_rate(x, p, k, filters):
    """Course rate of mode k, held and shaped, and its variance."""
    rate, variance = x[k, RATE], p[k, RATE, RATE]
    for f in range(len(filters)):
        if filters[f, ACTS_ON] == ON_RATE:
            j = int(filters[f, STATE])
            rate += x[k, j]
            variance += 2.0 * p[k, RATE, j] + p[k, j, j]
            for g in range(f):
                if filters[g, ACTS_ON] == ON_RATE:
                    variance += 2.0 * p[k, j, int(filters[g, STATE])]
    return rate, variance


@called_kernel
def fuse(x, p, probability, filters, out):
    """Mean and spread of all modes into `out` (FUSED)."""
    m = x.shape[0]
    likeliest = 0
    for k in range(1, m):
        if probability[k] > probability[likeliest]:
            likeliest = k
    reference = x[likeliest, COURSE]
    north = east = u = across = w = 0.0
    for k in range(m):
        weight, bend = probability[k], wrap(x[k, COURSE] - reference)
        rate, _ = course_rate(x, p, k, filters)
        north += weight * x[k, NORTH]
        east += weight * x[k, EAST]
        u += weight * x[k, SPEED]
        across += weight * bend
        w += weight * rate
    p_u = p_w = p_place = p_s = 0.0
    for k in range(m):
        weight, bend = probability[k], wrap(x[k, COURSE] - reference)
        rate, variance = course_rate(x, p, k, filters)
        p_u += weight * (p[k, 2, 2] + (x[k, SPEED] - u) ** 2)
        p_s += weight * (p[k, 3, 3] + (x[k, SPEED] * (bend - across)) ** 2)
        p_w += weight * (variance + (rate - w) ** 2)
        p_place += weight * 0.5 * (p[k, 0, 0] + p[k, 1, 1] + (x[k, 0] - north) ** 2 + (x[k, 1] - east) ** 2)
    out[0], out[1], out[2], out[3], out[4] = north, east, u, wrap(reference + across), w
    out[5], out[6], out[7], out[8] = p_u, p_s / max(u * u, 1e-12), p_w, p_place
    out[9] = 1.0


@called_kernel
def run_record(time, north, east, excess, aids, model, bank, motion_states, restarts, out, density, judged, kept):
    """Over a record. Returns the sum of log densities of what counts: fixes and aids but for the first after a start.

    Args:
        time: (n,) s. north, east: (n,) m, NaN where a row is no fix. excess: (n or 0,), see `take_fix`. aids: (n or 0,
            5), NaN where unknown. restarts: (r,) rows at which the filter begins anew.
        out: (n or 0, FUSED + 2) filled: `fuse`, NIS and the probability of an outlier.
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
        nis = wrong = math.nan
        log_density = 0.0
        step_n, step_e = run[STEP_N], run[STEP_E]
        if begins or run[STARTED] == 0.0:
            run[STARTED] = 0.0
            if fixed:
                start(bank, model, north[k], east[k])
            begins = True
            since = 0
        else:
            dt = time[k] - time[k - 1]
            if dt > 0.0:
                advance(bank, model, dt, motion_states)
            if fixed:
                nis, log_density, wrong = take_fix(bank, model, north[k], east[k], excess[k] if len(excess) else 1.0)
                since += 1
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
                fuse(bank.x, bank.p, bank.probability, model.filters, out[k])
            out[k, -2], out[k, -1] = nis, wrong
        if len(kept.x):
            keep(bank, kept, k)
            kept.moved[k, 0], kept.moved[k, 1] = run[STEP_N] - step_n, run[STEP_E] - step_e
            kept.moved[k, 2] = 1.0 if begins else 0.0
            if run[STARTED] == 0.0:
                kept.probability[k, 0] = math.nan
    return total


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
