"""What a fix does to all modes: good, poor, an outlier, or a step of the receiver.

All hypotheses are weighed in one likelihood, and nothing is left out of it.
"""

import math

from steerway.core.compiled import called_kernel, lean_kernel
from steerway.estimation.inference.fix import correct, of_fix, project
from steerway.estimation.inference.model import (
    APART,
    COURSE,
    EAST,
    FIX_VARIANCE,
    LATE_VARIANCE,
    LEARNT,
    LEVEL,
    NORTH,
    OUTLIER_RATE,
    POOR_NOISE,
    POOR_RATE,
    POOR_TIME,
    RUN,
    RUN_E,
    RUN_N,
    SINCE,
    SLIP_VARIANCE,
    SPEED,
    STEP_E,
    STEP_N,
    STEP_RATE,
    STEP_VARIANCE,
    TIME_VARIANCE,
    WAS_OUTLIER,
    WAS_POOR,
)

LEAST_OUTLIER, DECADES = 10.0, 10.0
"""An outlier is off by any distance from so many standard deviations of a fix to km, as likely in every decade:
density 1/(2π (ρ² + a²) L) with a (m) and L = ln (km / a), about 10 for any receiver."""
LEAST_PROBABILITY = 1e-6
"""Of a hypothesis that a correction counts: below, it moves nothing by a thousandth of a standard deviation."""
FREEDOM = 4.0
STUDENT_VARIANCE = FREEDOM / (FREEDOM - 2.0)
"""Degrees of freedom of Student's t distribution (K. L. Lange, R. J. A. Little and J. M. G. Taylor, J. American
Statistical Association 84(408), 1989), and its variance at unit scale: steps are small and seldom large, and so is the
noise of an obstruction before its fixes tell it."""
DIFFUSE, RARE = 1e6, 1e-3
"""Variance of a predicted fix, in that of its white noise, from which on a fix that is so seldom an outlier is right,
as the first one is: the share of so vague a prediction would outweigh the fix in the correction. Chosen."""
OUTLIERS_LAST = 0.5
"""Probability that a fix after an outlier is one too. Chosen: even odds, as the two below."""
SAME_OFFSET = 0.5
"""Probability that it is then off by the same."""
RUN_FOLLOWED = 4
"""So many outliers in a row that agree are a step of the receiver, and their position is followed. Chosen:
4 s at 1 Hz."""

RETURNS = 0.5
"""Probability that the receiver then returns by the same step."""


@lean_kernel
def outlier_density(nu_n, nu_e, spread, variance):
    """Density (1/m²) of an outlier so far from the predicted fix, which is uncertain by `spread` (m²) itself."""
    return 1.0 / (2.0 * math.pi * DECADES * (nu_n * nu_n + nu_e * nu_e + spread + LEAST_OUTLIER**2 * variance))


@called_kernel
def take_fix(bank, model, north, east, excess):
    """Weigh and take a fix. Returns (NIS of the mean of all modes, log density, probability of an outlier).

    A fix is good, poor (its noise several times the usual), the first of which the receiver is off by another distance
    (a step, which moves the position and not the motion) or an outlier; in every mode all four are weighed, and the
    correction is their mean (probabilistic data association: Y. Bar-Shalom and X. R. Li, Multitarget-Multisensor
    Tracking, 1995, §3.4): x ← x + C Σ β_h s_h and P ← P − C (Σ β_h (S_h⁻¹ − s_h s_hᵀ) + s̄ s̄ᵀ) Cᵀ with C = P Hᵀ,
    s_h = S_h⁻¹ ν, s̄ = Σ β_h s_h; for a step see `step_position`. Where the sky is obstructed a poor fix is mostly
    followed by one, and those before it tell how large the noise is (S. Särkkä and A. Nummenmaa, IEEE Trans. Automatic
    Control 54(3), 2009).
    excess: how many times its usual variance the white noise of this fix has.
    """
    x, p, probability, run, work = bank.x, bank.p, bank.probability, bank.run, bank.work
    m = x.shape[0]
    filters, receiver = model.filters, model.receiver
    variance, clock, late = excess * receiver[FIX_VARIANCE], receiver[TIME_VARIANCE], receiver[LATE_VARIANCE]
    return_step(bank, model, north, east, excess)
    wrong_prior = receiver[OUTLIER_RATE] * (1.0 - run[WAS_OUTLIER]) + OUTLIERS_LAST * run[WAS_OUTLIER]
    lasting = receiver[POOR_TIME] > 0.0
    left = math.exp(-run[SINCE] / receiver[POOR_TIME]) if lasting else 0.0
    stays, learnt = left * run[WAS_POOR], left * run[LEARNT]
    freedom = FREEDOM + learnt
    level = (FREEDOM + learnt * run[LEVEL]) / freedom
    poor_spread = freedom / (freedom - 2.0) if lasting else 1.0
    poor_prior = (1.0 - wrong_prior) * (stays + (1.0 - stays) * receiver[POOR_RATE])
    step_prior = (1.0 - wrong_prior - poor_prior) * (1.0 - math.exp(-receiver[STEP_RATE] * run[SINCE]))
    run[APART], run[SINCE] = run[SINCE], 0.0
    good_prior = 1.0 - wrong_prior - poor_prior - step_prior
    density = work[8]
    mean_n = mean_e = mean_nn = mean_ne = mean_ee = 0.0
    total = wrong = bad = seen = 0.0
    least = math.inf
    for k in range(m):
        pc_n, pc_e = work[0], work[1]
        c, s = math.cos(x[k, COURSE]), math.sin(x[k, COURSE])
        at_n, at_e = project(x, p, k, filters, c, s, pc_n, pc_e)
        s_nn, s_ne, s_ee = of_fix(x[k, SPEED], filters, c, s, pc_n, pc_e)
        v_n, v_e = x[k, SPEED] * c, x[k, SPEED] * s
        if clock > 0.0:
            s_nn, s_ne, s_ee = s_nn + clock * v_n * v_n, s_ne + clock * v_n * v_e, s_ee + clock * v_e * v_e
        s_nn, s_ee = s_nn + variance, s_ee + variance
        nu_n, nu_e, weight = north - at_n, east - at_e, probability[k]
        outlier = outlier_density(nu_n, nu_e, s_nn + s_ee, variance)
        if run[RUN] > 0.0:
            same = gaussian(nu_n - run[RUN_N], nu_e - run[RUN_E], s_nn + variance, s_ne, s_ee + variance)
            outlier = (1.0 - SAME_OFFSET) * outlier + SAME_OFFSET * same
        outlier *= wrong_prior
        usual = good_prior * gaussian(nu_n, nu_e, s_nn, s_ne, s_ee)
        added = level * (receiver[POOR_NOISE] ** 2 - 1.0) * variance
        p_nn, p_ne, p_ee = s_nn + added + late * v_n * v_n, s_ne + late * v_n * v_e, s_ee + added + late * v_e * v_e
        if lasting:
            poor = poor_prior * student(nu_n, nu_e, p_nn, p_ne, p_ee, freedom)
            seen += weight * poor * level * noise_seen(2.0 * added, nu_n, nu_e, p_nn + p_ee)
        else:
            poor = poor_prior * gaussian(nu_n, nu_e, p_nn, p_ne, p_ee)
        stepped = 0.0
        d_nn, d_ne, d_ee = step_variance(receiver, v_n, v_e)
        if step_prior > 0.0:
            stepped = step_prior * student(nu_n, nu_e, s_nn + d_nn, s_ne + d_ne, s_ee + d_ee, FREEDOM)
        whole = usual + poor + stepped + outlier
        density[k] = weight * whole
        total += weight * whole
        wrong += weight * outlier
        bad += weight * poor
        mean_n += weight * nu_n
        mean_e += weight * nu_e
        loose, far = poor_prior * poor_spread * added, step_prior * STUDENT_VARIANCE
        mean_nn += weight * (s_nn + loose + far * d_nn + nu_n * nu_n)
        mean_ne += weight * (s_ne + far * d_ne + nu_n * nu_e)
        mean_ee += weight * (s_ee + loose + far * d_ee + nu_e * nu_e)
        least = min(least, s_nn + s_ee)
        if s_nn + s_ee > DIFFUSE * variance and outlier < RARE * whole:
            whole -= outlier
        m_nn, m_ne, m_ee, mean_s_n, mean_s_e = share(usual / whole, nu_n, nu_e, s_nn, s_ne, s_ee)
        if poor > LEAST_PROBABILITY * whole:
            if lasting:
                scale = (freedom + square(nu_n, nu_e, p_nn, p_ne, p_ee)) / (freedom + 2.0)
                p_nn, p_ne, p_ee = (
                    s_nn + scale * (p_nn - s_nn),
                    s_ne + scale * (p_ne - s_ne),
                    s_ee + scale * (p_ee - s_ee),
                )
            j_nn, j_ne, j_ee, b_n, b_e = share(poor / whole, nu_n, nu_e, p_nn, p_ne, p_ee)
            m_nn, m_ne, m_ee = m_nn + j_nn, m_ne + j_ne, m_ee + j_ee
            mean_s_n, mean_s_e = mean_s_n + b_n, mean_s_e + b_e
        if stepped > LEAST_PROBABILITY * whole:
            # it went as far as the innovation is larger than it should be
            scale = max(1.0, (nu_n * nu_n + nu_e * nu_e - s_nn - s_ee) / (d_nn + d_ee))
            d_nn, d_ne, d_ee = scale * d_nn, scale * d_ne, scale * d_ee
            stepped /= whole
            j_nn, j_ne, j_ee, b_n, b_e = share(stepped, nu_n, nu_e, s_nn + d_nn, s_ne + d_ne, s_ee + d_ee)
            m_nn, m_ne, m_ee = m_nn + j_nn, m_ne + j_ne, m_ee + j_ee
            mean_s_n, mean_s_e = mean_s_n + b_n, mean_s_e + b_e
            step_position(
                x, p, k, pc_n, pc_e, d_nn, d_ne, d_ee, stepped, j_nn, j_ne, j_ee, b_n, b_e, mean_s_n, mean_s_e
            )
        m_nn, m_ne, m_ee = m_nn + mean_s_n * mean_s_n, m_ne + mean_s_n * mean_s_e, m_ee + mean_s_e * mean_s_e
        correct(x, p, k, pc_n, pc_e, m_nn, m_ne, m_ee, mean_s_n, mean_s_e)
    for k in range(m):
        probability[k] = density[k] / total
    mean_nn, mean_ne, mean_ee = mean_nn - mean_n * mean_n, mean_ne - mean_n * mean_e, mean_ee - mean_e * mean_e
    nis = (mean_ee * mean_n * mean_n - 2.0 * mean_ne * mean_n * mean_e + mean_nn * mean_e * mean_e) / (
        mean_nn * mean_ee - mean_ne * mean_ne
    )
    run[WAS_POOR], run[LEARNT] = bad / total, learnt
    if lasting and bad > 0.0:
        told = 2.0 * bad / total  # a fix has two coordinates
        run[LEARNT] = learnt + told
        run[LEVEL] += told / run[LEARNT] * (seen / bad - run[LEVEL])
    follow_run(bank, mean_n, mean_e, wrong / total, least)
    return nis, math.log(total), wrong / total


@lean_kernel
def share(probability, nu_n, nu_e, s_nn, s_ne, s_ee):
    """What a hypothesis β adds to the correction: β (S⁻¹ − s sᵀ), three numbers, and β s, two, with s = S⁻¹ ν."""
    determinant = s_nn * s_ee - s_ne * s_ne
    i_nn, i_ne, i_ee = s_ee / determinant, -s_ne / determinant, s_nn / determinant
    s_n, s_e = i_nn * nu_n + i_ne * nu_e, i_ne * nu_n + i_ee * nu_e
    m_nn, m_ne, m_ee = i_nn - s_n * s_n, i_ne - s_n * s_e, i_ee - s_e * s_e
    return probability * m_nn, probability * m_ne, probability * m_ee, probability * s_n, probability * s_e


@lean_kernel
def noise_seen(variance, nu_n, nu_e, spread):
    """Mean square of a noise, in its variance, where the innovation, of variance `spread` with it, is known."""
    part = variance / spread
    return part * (nu_n * nu_n + nu_e * nu_e) / spread + 1.0 - part


@lean_kernel
def step_variance(receiver, v_n, v_e):
    """Covariance (m²) of a step of the receiver: in any direction, and along the velocity."""
    step, slip = receiver[STEP_VARIANCE], receiver[SLIP_VARIANCE]
    return step + slip * v_n * v_n, slip * v_n * v_e, step + slip * v_e * v_e


@called_kernel
def step_position(x, p, k, pc_n, pc_e, d_nn, d_ne, d_ee, probability, j_nn, j_ne, j_ee, b_n, b_e, mean_n, mean_e):
    """Move the position of mode k by what a step of covariance D (m²) and probability β does to it, E of x.

    x ← x + E D b and P ← P − (C (J + s̄ bᵀ) D Eᵀ + its transpose) + E (β D − D (J + b bᵀ) D) Eᵀ, with J and b of `share`
    and s̄ the mean of all hypotheses; what is common to them follows by `correct`.
    """
    x[k, NORTH] += d_nn * b_n + d_ne * b_e
    x[k, EAST] += d_ne * b_n + d_ee * b_e
    k_nn, k_ne, k_en, k_ee = j_nn + mean_n * b_n, j_ne + mean_n * b_e, j_ne + mean_e * b_n, j_ee + mean_e * b_e
    k_nn, k_ne = k_nn * d_nn + k_ne * d_ne, k_nn * d_ne + k_ne * d_ee
    k_en, k_ee = k_en * d_nn + k_ee * d_ne, k_en * d_ne + k_ee * d_ee
    for i in range(x.shape[1]):
        a, b = pc_n[i] * k_nn + pc_e[i] * k_en, pc_n[i] * k_ne + pc_e[i] * k_ee
        p[k, i, NORTH] -= a
        p[k, NORTH, i] -= a
        p[k, i, EAST] -= b
        p[k, EAST, i] -= b
    j_nn, j_ne, j_ee = j_nn + b_n * b_n, j_ne + b_n * b_e, j_ee + b_e * b_e
    a_nn, a_ne, a_en, a_ee = (
        d_nn * j_nn + d_ne * j_ne,
        d_nn * j_ne + d_ne * j_ee,
        d_ne * j_nn + d_ee * j_ne,
        d_ne * j_ne + d_ee * j_ee,
    )
    p[k, NORTH, NORTH] += probability * d_nn - a_nn * d_nn - a_ne * d_ne
    p[k, EAST, EAST] += probability * d_ee - a_en * d_ne - a_ee * d_ee
    cross = probability * d_ne - a_nn * d_ne - a_ne * d_ee
    p[k, NORTH, EAST] += cross
    p[k, EAST, NORTH] += cross


@called_kernel
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


@called_kernel
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
    """Undo the step last followed where a fix is likelier so than as a good one or an outlier."""
    x, p, probability, run, work = bank.x, bank.p, bank.probability, bank.run, bank.work
    if run[STEP_N] == 0.0 and run[STEP_E] == 0.0:
        return
    variance = excess * model.receiver[FIX_VARIANCE]
    stays = returns = 0.0
    for k in range(x.shape[0]):
        c, s = math.cos(x[k, COURSE]), math.sin(x[k, COURSE])
        at_n, at_e = project(x, p, k, model.filters, c, s, work[0], work[1])
        s_nn, s_ne, s_ee = of_fix(x[k, SPEED], model.filters, c, s, work[0], work[1])
        s_nn, s_ee = s_nn + variance, s_ee + variance
        a, b = north - at_n, east - at_e
        stays += probability[k] * gaussian(a, b, s_nn, s_ne, s_ee)
        stays += probability[k] * model.receiver[OUTLIER_RATE] * outlier_density(a, b, s_nn + s_ee, variance)
        s_nn, s_ee = s_nn + variance, s_ee + variance
        returns += probability[k] * gaussian(a + run[STEP_N], b + run[STEP_E], s_nn, s_ne, s_ee)
    if RETURNS * model.receiver[OUTLIER_RATE] * returns > stays:
        shift(bank, -run[STEP_N], -run[STEP_E], variance)
        run[STEP_N] = run[STEP_E] = 0.0


@lean_kernel
def square(a, b, s_nn, s_ne, s_ee):
    """Innovation (a, b) squared, in its covariance: NIS."""
    return (s_ee * a * a - 2.0 * s_ne * a * b + s_nn * b * b) / (s_nn * s_ee - s_ne * s_ne)


@lean_kernel
def gaussian(a, b, s_nn, s_ne, s_ee):
    """Density (1/m²) of an innovation (a, b)."""
    determinant = s_nn * s_ee - s_ne * s_ne
    return math.exp(-0.5 * square(a, b, s_nn, s_ne, s_ee)) / (2.0 * math.pi * math.sqrt(determinant))


@lean_kernel
def student(a, b, s_nn, s_ne, s_ee, freedom):
    """Density (1/m²) of an innovation (a, b) by Student's t distribution of so many degrees of freedom."""
    determinant = s_nn * s_ee - s_ne * s_ne
    tail = 1.0 + square(a, b, s_nn, s_ne, s_ee) / freedom
    power = tail**3 if freedom == FREEDOM else tail ** (0.5 * freedom + 1.0)  # a cube takes less time
    return 1.0 / (2.0 * math.pi * math.sqrt(determinant) * power)
