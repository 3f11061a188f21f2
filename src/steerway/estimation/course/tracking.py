"""The recursion: predict to a time, correct by what was measured then, update the phase.

The same kernels serve the streaming filter, the record and the batch of records.
"""

import math

import numpy as np

from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.earth import displaced, displacement
from steerway.core.kalman import correct, correct_scalar, innovation, normalised_square, scalar_innovation
from steerway.core.statistics import AID_GATE
from steerway.estimation.course.imm import (
    combine,
    course_is_lost,
    fold_modes,
    mixture_nll,
    predict_modes,
    set_steps,
    split,
    update_probabilities,
)
from steerway.estimation.course.motion.layout import (
    COURSE,
    DT,
    EAST,
    EMPTY,
    ERROR_PAIRS,
    ERROR_STATE,
    LATITUDE,
    LONGEST_REJECTION,
    LONGEST_STEP,
    LONGITUDE,
    NLL,
    NLLS,
    NORTH,
    PHASE,
    POSITION_VARIANCE,
    REJECTED_FOR,
    RESETS,
    SPEED,
    STEP,
    STEP_ROWS,
    STEP_SLACK,
    TIME_VARIANCE,
    UNDER_WAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
    first_mode,
    mode_count,
)
from steerway.estimation.course.motion.low_speed import predict as predict_low_speed
from steerway.estimation.course.motion.models import change_velocity, parts_of
from steerway.estimation.course.output import copy_block, status_of, write_output
from steerway.estimation.course.steerageway import set_position, start, update_phase
from steerway.estimation.course.update.aids import aid_low_speed, any_known, measured
from steerway.estimation.course.update.invariant import rotate_correction
from steerway.estimation.course.update.outliers import (
    AID_OUTLIER_NLL,
    aid_nll,
    fix_is_accepted,
    fix_nll,
)
from steerway.estimation.log.rows import LONGEST_GAP
from steerway.estimation.vessel.aids import COG, SOG

_SLOTS, _SLOTS_PER_SECOND = 128, 7.0
"""Steps kept by their length; intervals of whole seconds, as AIS has them, meet in no slot up to two minutes:
128 is a power of 2, 7 has no factor with it."""
_SAME_STEP = 1e-10
"""Part of a step by which equal intervals between times of up to an hour differ in their last digits: of three
rows at 50 Hz two would have a step of their own (`python -m benchmarks batch`)."""


@lean_kernel
def advance(bank, dt, parameters, terms):
    """Predict by dt ≥ 0 seconds. Before output without a further measurement, `combine`.

    terms: (any, STEP_ROWS, n), zero at first: steps of one mode taken before, to be taken again.
    """
    n = bank.shape[2]
    p, x, flags, step = bank[0, :n], bank[0, n], bank[0, n + 1], bank[0, n + STEP : n + NLLS]
    if flags[PHASE] == EMPTY or not dt > 0.0:
        return
    if dt > LONGEST_GAP:
        flags[PHASE] = EMPTY
        return
    if flags[REJECTED_FOR] >= 0.0:
        flags[REJECTED_FOR] += dt
    if len(bank) == 1:
        change_velocity(x, p, flags[PHASE] == UNDER_WAY, parameters[0])
    steps = max(math.ceil(dt / parameters[0, LONGEST_STEP] - STEP_SLACK), 1)
    if steps > 1 and len(bank) == 1:
        steps = parts_of(x, p, flags[PHASE] == UNDER_WAY, dt, parameters[0])
    if abs(dt / steps - step[DT]) > _SAME_STEP * dt:
        recall_step(bank, dt / steps, parameters, terms)
    for _ in range(steps):
        if flags[PHASE] == UNDER_WAY:
            predict_modes(bank, parameters)
            if course_is_lost(bank):
                update_phase(x, p, flags, parameters[0])
        else:
            predict_low_speed(x, p, step, parameters[0])


@called_kernel
def recall_step(bank, dt, parameters, terms):
    """`set_steps`, or a copy of what it did before for one mode."""
    if len(terms) == 0:
        set_steps(bank, dt, parameters)
        return
    n = bank.shape[2]
    known, step = terms[int(_SLOTS_PER_SECOND * dt) % len(terms)], bank[0, n + STEP : n + NLLS]
    if known[DT] == dt:
        copy_block(known, step)
    else:
        set_steps(bank, dt, parameters)
        copy_block(step, known)


@lean_kernel
def conclude(bank):
    """Combine the modes after a prediction."""
    if bank[0, bank.shape[2] + 1, PHASE] == UNDER_WAY:
        combine(bank)


@lean_kernel
def take_fix(bank, north, east, variance_scale, parameters):
    """Correct by a fix in the present tangent plane. Returns (accepted, NIS, nll).

    `variance_scale` is how many times its usual variance the white noise of this fix has.
    """
    n = bank.shape[2]
    p, x, flags = bank[0, :n], bank[0, n], bank[0, n + 1]
    if flags[PHASE] == EMPTY:
        start(x, p, flags, north, east, variance_scale, parameters[0])
        flags[REJECTED_FOR], flags[RESETS] = -1.0, 0.0
        return True, math.nan, math.nan
    first, count = modes_in_use(bank)
    nis, nll, least = weigh_fix(bank, first, count, north, east, variance_scale, parameters)
    accepted = fix_is_accepted(least, nll, parameters[0])
    if accepted:
        correct_modes(bank, first, count, parameters)
        if flags[REJECTED_FOR] < 0.0:
            flags[RESETS] = 0.0
        flags[REJECTED_FOR] = -1.0
    elif flags[REJECTED_FOR] < 0.0:
        flags[REJECTED_FOR] = 0.0
    elif flags[REJECTED_FOR] >= parameters[0, LONGEST_REJECTION] - 1e-6:
        reset_position(bank, north, east, variance_scale, parameters)
    return accepted, nis, nll


@lean_kernel
def modes_in_use(bank):
    """Block of the first, and how many: all modes under way, else the combined estimate alone."""
    if bank[0, bank.shape[2] + 1, PHASE] == UNDER_WAY:
        return first_mode(bank), mode_count(bank)
    return 0, 1


@lean_kernel
def weigh_fix(bank, first, count, north, east, variance_scale, parameters):
    """NIS of a fix against the mixture of all modes, its nll, and the least NIS, of the mixture or of a mode.

    An improbable turn hardly widens the mixture, and yet predicts the position where one begins. The innovation of
    every mode (ν_N, ν_E, S_NN, S_NE, S_EE) stays in its first row of workspace.
    """
    n = bank.shape[2]
    under_way = bank[0, n + 1, PHASE] == UNDER_WAY
    for k in range(first, first + count):
        fix_innovation(bank[k], north, east, variance_scale, under_way, parameters[k])
    if count == 1:
        nu = bank[first, n + 2]
        nis = normalised_square(nu[0], nu[1], nu[2], nu[3], nu[4])
        nll = bank[first, n + NLLS, NLL]
        return nis, nll, nis
    probability = bank[0, n + NLLS]
    mean_n = mean_e = s_nn = s_ne = s_ee = 0.0
    least = math.inf
    for k in range(count):
        nu = bank[first + k, n + 2]
        mean_n += probability[k] * nu[0]
        mean_e += probability[k] * nu[1]
        least = min(least, normalised_square(nu[0], nu[1], nu[2], nu[3], nu[4]))
    for k in range(count):
        nu = bank[first + k, n + 2]
        apart_n, apart_e = nu[0] - mean_n, nu[1] - mean_e
        s_nn += probability[k] * (nu[2] + apart_n * apart_n)
        s_ne += probability[k] * (nu[3] + apart_n * apart_e)
        s_ee += probability[k] * (nu[4] + apart_e * apart_e)
    nis = normalised_square(mean_n, mean_e, s_nn, s_ne, s_ee)
    return nis, mixture_nll(bank), min(nis, least)


@lean_kernel
def fix_innovation(mode, north, east, variance_scale, under_way, parameters):
    """Fill the workspace of a mode with its innovation, and set its nll.

    With a variance of the time of a fix, what the vessel sails in that time is part of the innovation's covariance.
    """
    n = mode.shape[1]
    p, x, nu = mode[:n], mode[n], mode[n + 2]
    g, pairs, variance = int(parameters[ERROR_STATE]), int(parameters[ERROR_PAIRS]), parameters[POSITION_VARIANCE]
    variance *= variance_scale
    nu_n, nu_e, s_nn, s_ne, s_ee = innovation(x, p, north, east, variance, variance, g, pairs)
    time_variance = parameters[TIME_VARIANCE]
    if time_variance > 0.0:
        v_n, v_e = x[VELOCITY_NORTH], x[VELOCITY_EAST]
        if under_way:
            v_n, v_e = x[SPEED] * math.cos(x[COURSE]), x[SPEED] * math.sin(x[COURSE])
        s_nn += time_variance * v_n * v_n
        s_ne += time_variance * v_n * v_e
        s_ee += time_variance * v_e * v_e
    nu[0], nu[1], nu[2], nu[3], nu[4] = nu_n, nu_e, s_nn, s_ne, s_ee
    mode[n + NLLS, NLL] = fix_nll(normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee), s_nn * s_ee - s_ne * s_ne)


@lean_kernel
def correct_modes(bank, first, count, parameters):
    """Correct every mode by a fix that has been weighed, and their probabilities."""
    n = bank.shape[2]
    g, pairs = int(parameters[0, ERROR_STATE]), int(parameters[0, ERROR_PAIRS])
    for k in range(first, first + count):
        p, x, work, nu = bank[k, :n], bank[k, n], bank[k, n + 2 : n + 6], bank[k, n + 2]
        nu_n, nu_e, s_nn, s_ne, s_ee = nu[0], nu[1], nu[2], nu[3], nu[4]
        if count == 1:  # as Table 1 of the paper has it; the rotation matters where modes disagree on the course
            correct(x, p, work, nu_n, nu_e, s_nn, s_ne, s_ee, g, pairs)
        else:
            before = bank[count + k, n]
            for i in range(n):
                before[i] = x[i]
            correct(x, p, work, nu_n, nu_e, s_nn, s_ne, s_ee, g, pairs)
            rotate_correction(x, p, before, g, pairs)
    if count > 1:
        update_probabilities(bank)


@called_kernel
def reset_position(bank, north, east, variance_scale, parameters):
    """After unbroken rejections set the position to the fix and keep the motion; if that did not help, start anew."""
    n = bank.shape[2]
    flags = bank[0, n + 1]
    if flags[RESETS] > 0.0:
        start(bank[0, n], bank[0, :n], flags, north, east, variance_scale, parameters[0])
        flags[RESETS] = 0.0
    else:
        for k in range(len(parameters)):
            set_position(bank[k, n], bank[k, :n], north, east, variance_scale, parameters[k])
        flags[RESETS] = 1.0
    flags[REJECTED_FOR] = -1.0


@called_kernel
def take_aids(bank, aids, parameters):
    """Correct by every aid that is known (not NaN) and within the gate of at least one mode. Returns their nll.

    At low speed they are no part of the likelihood: 0.
    """
    n = bank.shape[2]
    phase = bank[0, n + 1, PHASE]
    if phase == UNDER_WAY:
        nll = 0.0
        for which in range(len(aids)):
            if math.isfinite(aids[which]):
                nll += take_aid(bank, which, aids[which], parameters)
        return nll
    if phase != EMPTY:
        aid_low_speed(bank[0, n], bank[0, :n], bank[0, n + 2 : n + 6], aids[SOG], aids[COG], parameters[0])
    return 0.0


@called_kernel
def take_aid(bank, which, value, parameters):
    """Correct by one aid. Returns its nll, at most that of an outlier whether it is used or not."""
    n, first, count = bank.shape[2], first_mode(bank), mode_count(bank)
    least = math.inf
    for k in range(first, first + count):
        p, x, work = bank[k, :n], bank[k, n], bank[k, n + 2 : n + 6]
        i, companion, sign, nu, variance = measured(which, value, x, parameters[k])
        s = scalar_innovation(p, work, i, companion, sign, variance)
        least = min(least, nu * nu / s)
        bank[k, n + NLLS, NLL] = aid_nll(nu * nu / s, s)
    nll = min(mixture_nll(bank), AID_OUTLIER_NLL)
    if least > AID_GATE:
        return nll
    for k in range(first, first + count):
        p, x, work = bank[k, :n], bank[k, n], bank[k, n + 2 : n + 6]
        i, companion, sign, nu, variance = measured(which, value, x, parameters[k])
        correct_scalar(x, p, work, i, companion, sign, nu, variance, math.inf)
    update_probabilities(bank)
    return nll


@lean_kernel
def settle(bank, parameters):
    """After an update: fold the speed, wrap the course, combine the modes, update the phase."""
    n = bank.shape[2]
    flags = bank[0, n + 1]
    was_under_way = flags[PHASE] == UNDER_WAY
    if was_under_way:
        fold_modes(bank)
        combine(bank)
    if flags[PHASE] != EMPTY:
        update_phase(bank[0, n], bank[0, :n], flags, parameters[0])
    if flags[PHASE] == UNDER_WAY and not was_under_way:
        split(bank, parameters)


@lean_kernel
def take_position(bank, first, second, geodetic, variance_scale, parameters):
    """Correct by a fix given as latitude and longitude (rad) or as north and east (m): `take_fix` for either."""
    flags = bank[0, bank.shape[2] + 1]
    north, east = first, second
    if geodetic:
        if flags[PHASE] == EMPTY:
            flags[LATITUDE], flags[LONGITUDE] = first, second
        north, east = displacement(first, second, flags[LATITUDE], flags[LONGITUDE])
    return take_fix(bank, north, east, variance_scale, parameters)


@lean_kernel
def recentre(bank):
    """Move the origin of the tangent plane to the present estimate."""
    n = bank.shape[2]
    x, flags = bank[0, n], bank[0, n + 1]
    north, east = x[NORTH], x[EAST]
    flags[LATITUDE], flags[LONGITUDE] = displaced(flags[LATITUDE], flags[LONGITUDE], north, east)
    x[NORTH] = x[EAST] = 0.0
    if len(bank) > 1:
        for k in range(1, 1 + mode_count(bank)):
            bank[k, n, NORTH] -= north
            bank[k, n, EAST] -= east


@kernel
def track(
    bounds,
    time,
    first,
    second,
    variance_scales,
    aids,
    geodetic,
    parameters,
    bank,
    output,
    nis,
    nll,
    aid_nlls,
    status,
    kept,
):
    """Run over records that stand behind one another, record i in rows bounds[i] to bounds[i + 1].

    Args:
        time: (n,) s, not decreasing in a record. first, second: (n,) latitude and longitude (rad) if `geodetic`, else
            north and east (m); NaN where a row is no fix. variance_scales: (n or 0,), see `take_fix`. aids: (n or 0,
            aids), NaN where nothing was measured.
        parameters, bank: the filter; the first record goes on from the state of the bank, each further one starts anew.
        output: (n, OUTPUTS), nis, nll, aid_nlls: (n,), status: (n,) uint8: filled. See `take_fix`, `take_aids`.
        kept: (n or 0, states + 2, states) receives covariance, state and flags after every row, for the smoother.
    """
    terms = np.zeros((_SLOTS if len(bank) == 1 and len(time) > _SLOTS else 0, STEP_ROWS, bank.shape[2]))
    for i in range(len(bounds) - 1):
        if i > 0:
            bank[:] = 0.0
        for k in range(bounds[i], bounds[i + 1]):
            if k > bounds[i]:
                advance(bank, time[k] - time[k - 1], parameters, terms)
            fixed = math.isfinite(first[k]) and math.isfinite(second[k])
            accepted = False
            nis[k] = nll[k] = math.nan
            aid_nlls[k] = 0.0
            if fixed:
                scale = variance_scales[k] if len(variance_scales) else 1.0
                accepted, nis[k], nll[k] = take_position(bank, first[k], second[k], geodetic, scale, parameters)
            aided = len(aids) > 0 and any_known(aids[k])
            if aided:
                aid_nlls[k] = take_aids(bank, aids[k], parameters)
            if fixed or aided:
                settle(bank, parameters)
            else:
                conclude(bank)
            if geodetic and fixed:
                recentre(bank)
            status[k] = status_of(bank, fixed, accepted)
            write_output(bank[0], geodetic, output[k])
            if len(kept):
                copy_block(bank[0], kept[k])
