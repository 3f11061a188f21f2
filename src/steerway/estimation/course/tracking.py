"""One filter over time: predict to a moment, take what was said there, judge what it means.

The same two kernels, `advance` and `take`, serve the streaming filter, the record and the batch of records.
"""

import math

import numpy as np

from steerway.core.compiled import kernel, lean_kernel
from steerway.core.earth import displaced, displacement
from steerway.core.records import NO_COURSE, OK, PREDICTED, REJECTED
from steerway.core.records import STARTING as STARTING_STATUS
from steerway.estimation.course.aiding import COG, SOG, aid_adrift, aid_underway
from steerway.estimation.course.five_state import set_step
from steerway.estimation.course.mixture import (
    aid_modes,
    correct_modes,
    course_is_lost,
    fold_modes,
    join,
    part_ways,
    predict_modes,
    set_steps,
    shift_modes,
    take_place_modes,
    weigh_fix,
)
from steerway.estimation.course.model import (
    ADRIFT,
    COURSE,
    DT,
    EAST,
    EMPTY,
    ERROR_PAIRS,
    ERROR_STATE,
    GATE,
    LATITUDE,
    LONGEST_GAP,
    LONGITUDE,
    LOST_COURSE_VARIANCE,
    MODE,
    NORTH,
    OUTLIER,
    PATIENCE,
    POSITION_VARIANCE,
    RATE,
    RETRIES,
    SPEED,
    STARTING,
    STEP_SLACK,
    STRAY,
    TIME_VARIANCE,
    UNDERWAY,
    empty_memory,
    longest_step,
)
from steerway.estimation.course.position_update import correct, innovation, normalised_square
from steerway.estimation.course.way import fold, judge, predict_adrift, start, take_place
from steerway.estimation.course.yawing import predict_underway

_OF_TWO_NORMALS = 2.0 * math.log(2.0 * math.pi)


@lean_kernel
def advance(memory, dt, model):
    """Predict by dt ≥ 0 seconds. Before the filter speaks without a further fix, `conclude`."""
    main = memory if memory.ndim == 2 else memory[0]
    parameters = model if model.ndim == 1 else model[0]
    n = main.shape[1]
    p, x, book, step = main[:n], main[n], main[n + 1], main[n + 6 : n + 9]
    if book[MODE] == EMPTY or not dt > 0.0:
        return
    if dt > LONGEST_GAP:
        book[MODE] = EMPTY
        return
    if book[STRAY] >= 0.0:
        book[STRAY] += dt
    steps = max(math.ceil(dt / longest_step(parameters) - STEP_SLACK), 1)
    if dt / steps != step[DT]:
        set_step(step, dt / steps, parameters)
        if memory.ndim == 3:
            set_steps(memory, dt / steps, model)
    for _ in range(steps):
        if book[MODE] == UNDERWAY:
            if memory.ndim == 3:
                predict_modes(memory, model)
                lost = course_is_lost(memory)
            else:
                predict_underway(x, p, step, parameters)
                lost = p[COURSE, COURSE] > LOST_COURSE_VARIANCE
            if lost:
                judge(x, p, book, parameters)
        else:
            predict_adrift(x, p, step, parameters)


@lean_kernel
def conclude(memory):
    """Bring what the vessel is said to do up to date with the modes she may be in; one mode always is."""
    if memory.ndim == 3:
        if memory[0, memory.shape[2] + 1, MODE] == UNDERWAY:
            join(memory)


@lean_kernel
def take_fix(memory, north, east, doubt, model):
    """Correct by a fix in the present tangent plane. Returns (accepted, NIS, log det S).

    `doubt` is how many times its usual variance the white noise of this fix has.

    Of several modes the last is what with the NIS makes −2 log of the density of the fix, as log det S does for one.
    """
    main = memory if memory.ndim == 2 else memory[0]
    parameters = model if model.ndim == 1 else model[0]
    n = main.shape[1]
    p, x, book = main[:n], main[n], main[n + 1]
    if book[MODE] == EMPTY:
        start(x, p, book, north, east, doubt, parameters)
        book[STRAY], book[RETRIES] = -1.0, 0.0
        return True, math.nan, math.nan
    if memory.ndim == 3:
        if book[MODE] == UNDERWAY:
            nis, log_determinant, least = weigh_fix(memory, north, east, doubt, model)
            accepted = least <= parameters[GATE] or believed(nis, log_determinant, parameters)
            if accepted:
                correct_modes(memory, north, east, doubt, model)
        else:
            accepted, nis, log_determinant = correct_whole(main, north, east, doubt, parameters)
    else:
        accepted, nis, log_determinant = correct_whole(main, north, east, doubt, parameters)
    if accepted:
        if book[STRAY] < 0.0:
            book[RETRIES] = 0.0
        book[STRAY] = -1.0
    elif book[STRAY] < 0.0:
        book[STRAY] = 0.0
    elif book[STRAY] >= parameters[PATIENCE] - 1e-6:
        retake(memory, north, east, doubt, model)
    return accepted, nis, log_determinant


@lean_kernel
def mistimed(x, book, s_nn, s_ne, s_ee, model):
    """Covariance of an innovation with what the vessel may have sailed before or after the moment the fix claims."""
    if book[MODE] == UNDERWAY:
        north, east = x[SPEED] * math.cos(x[COURSE]), x[SPEED] * math.sin(x[COURSE])
    else:
        north, east = x[2], x[3]
    variance = model[TIME_VARIANCE]
    return s_nn + variance * north * north, s_ne + variance * north * east, s_ee + variance * east * east


@lean_kernel
def believed(nis, log_determinant, model):
    """Whether a fix is within what is usual of the vessel, or else likelier than an outlier."""
    return nis <= model[GATE] or nis + log_determinant + _OF_TWO_NORMALS <= model[OUTLIER]


@lean_kernel
def correct_whole(main, north, east, doubt, model):
    """Correct one filter by a fix unless the gate refuses it. Returns (accepted, NIS, log det S)."""
    n = main.shape[1]
    p, x, work = main[:n], main[n], main[n + 2 : n + 6]
    g, pairs, variance = int(model[ERROR_STATE]), int(model[ERROR_PAIRS]), doubt * model[POSITION_VARIANCE]
    nu_n, nu_e, s_nn, s_ne, s_ee = innovation(x, p, north, east, variance, variance, g, pairs)
    if model[TIME_VARIANCE] > 0.0:
        s_nn, s_ne, s_ee = mistimed(x, main[n + 1], s_nn, s_ne, s_ee, model)
    nis = normalised_square(nu_n, nu_e, s_nn, s_ne, s_ee)
    log_determinant = math.log(s_nn * s_ee - s_ne * s_ne)
    accepted = believed(nis, log_determinant, model)
    if accepted:
        correct(x, p, work, nu_n, nu_e, s_nn, s_ne, s_ee, g, pairs)
    return accepted, nis, log_determinant


@lean_kernel
def retake(memory, north, east, doubt, model):
    """After unbroken rejections take the position anew and keep the motion; if that did not help, begin anew."""
    main = memory if memory.ndim == 2 else memory[0]
    parameters = model if model.ndim == 1 else model[0]
    n = main.shape[1]
    p, x, book = main[:n], main[n], main[n + 1]
    if book[RETRIES] > 0.0:
        start(x, p, book, north, east, doubt, parameters)
        book[RETRIES] = 0.0
    else:
        take_place(x, p, north, east, doubt, parameters)
        if memory.ndim == 3:
            take_place_modes(memory, north, east, doubt, model)
        book[RETRIES] = 1.0
    book[STRAY] = -1.0


@lean_kernel
def take_aids(memory, aids, model):
    """Correct by the aids (5,) that are not NaN. Returns −2 log of the density of what they say, under way."""
    main = memory if memory.ndim == 2 else memory[0]
    parameters = model if model.ndim == 1 else model[0]
    n = main.shape[1]
    p, x, book, work = main[:n], main[n], main[n + 1], main[n + 2 : n + 6]
    if book[MODE] == UNDERWAY:
        if memory.ndim == 3:
            return aid_modes(memory, aids, model)
        return aid_underway(x, p, work, aids, model)
    if book[MODE] != EMPTY:
        aid_adrift(x, p, work, aids[SOG], aids[COG], parameters)
    return 0.0


@lean_kernel
def something_is_known(aids):
    """Whether any of the aids (5,) is not NaN."""
    for value in aids:
        if math.isfinite(value):
            return True
    return False


@lean_kernel
def settle(memory, model):
    """After an update: fold the speed, wrap the course, gain or lose way."""
    main = memory if memory.ndim == 2 else memory[0]
    parameters = model if model.ndim == 1 else model[0]
    n = main.shape[1]
    p, x, book = main[:n], main[n], main[n + 1]
    had_way = book[MODE] == UNDERWAY
    if had_way:
        if memory.ndim == 3:
            fold_modes(memory)
            join(memory)
        else:
            fold(x, p)
    if book[MODE] != EMPTY:
        judge(x, p, book, parameters)
    if memory.ndim == 3:
        if book[MODE] == UNDERWAY and not had_way:
            part_ways(memory, model)


@lean_kernel
def take_position(memory, first, second, geodetic, doubt, model):
    """Correct by a fix given as latitude and longitude (rad) or as north and east (m): `take_fix` for either."""
    if not geodetic:
        return take_fix(memory, first, second, doubt, model)
    main = memory if memory.ndim == 2 else memory[0]
    book = main[main.shape[1] + 1]
    if book[MODE] == EMPTY:
        book[LATITUDE], book[LONGITUDE] = first, second
    north, east = displacement(first, second, book[LATITUDE], book[LONGITUDE])
    return take_fix(memory, north, east, doubt, model)


@lean_kernel
def recentre(memory):
    """Lay the tangent plane around the present estimate: the position moves into the plane's origin."""
    main = memory if memory.ndim == 2 else memory[0]
    n = main.shape[1]
    x, book = main[n], main[n + 1]
    book[LATITUDE], book[LONGITUDE] = displaced(book[LATITUDE], book[LONGITUDE], x[NORTH], x[EAST])
    if memory.ndim == 3:
        shift_modes(memory, x[NORTH], x[EAST])
    x[NORTH] = x[EAST] = 0.0


@lean_kernel
def status_of(memory, fixed, accepted):
    """What the row is worth, as a code of records.STATUSES."""
    main = memory if memory.ndim == 2 else memory[0]
    mode = main[main.shape[1] + 1, MODE]
    if mode <= STARTING:
        return STARTING_STATUS
    if fixed and not accepted:
        return REJECTED
    if mode == ADRIFT:
        return NO_COURSE
    return OK if fixed else PREDICTED


@lean_kernel
def speak(memory, geodetic, out):
    """Write what the filter says now.

    Latitude and longitude (or north and east), SOG, COG, course rate, the deviations of these three, of the position.
    """
    main = memory if memory.ndim == 2 else memory[0]
    n = main.shape[1]
    p, x, book = main[:n], main[n], main[n + 1]
    mode = book[MODE]
    out[:] = math.nan
    if mode == EMPTY:
        return
    out[0], out[1] = x[NORTH], x[EAST]
    if geodetic:
        out[0], out[1] = displaced(book[LATITUDE], book[LONGITUDE], x[NORTH], x[EAST])
    out[8] = math.sqrt(0.5 * (p[0, 0] + p[1, 1]))
    if mode == UNDERWAY:
        out[2], out[3], out[4] = x[SPEED], x[COURSE], x[RATE]
        out[5], out[6], out[7] = math.sqrt(p[2, 2]), math.sqrt(p[3, 3]), math.sqrt(p[4, 4])
    elif mode == ADRIFT:
        out[2] = math.hypot(x[2], x[3])
        out[5] = math.sqrt(0.5 * (p[2, 2] + p[3, 3]))


SPOKEN = 9
"""Columns of `speak`."""


@lean_kernel
def keep(memory, out):
    """Copy covariance, state and bookkeeping of what the vessel is said to do into (n + 2, n)."""
    main = memory if memory.ndim == 2 else memory[0]
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = main[i, j]


@kernel
def track(
    time,
    first,
    second,
    doubts,
    aids,
    geodetic,
    model,
    memory,
    spoken,
    nis,
    log_determinant,
    aid_surprise,
    status,
    kept,
):
    """Run over a record.

    Args:
        time: (n,) s, not decreasing. first, second: (n,) latitude and longitude (rad) if `geodetic`, else north and
            east (m); NaN where a row is no fix. doubts: (n or 0,), see `take_fix`. aids: (n or 0, 5), NaN where
            nothing was said.
        model, memory: the filter; memory goes on from where it stands.
        spoken: (n, SPOKEN), nis, log_determinant, aid_surprise: (n,), status: (n,) uint8: filled. See `take_fix`,
            `take_aids`.
        kept: (n or 0, states + 2, states) receives covariance, state and bookkeeping after every row, for the smoother.
    """
    for k in range(len(time)):
        if k > 0:
            advance(memory, time[k] - time[k - 1], model)
        fixed = math.isfinite(first[k]) and math.isfinite(second[k])
        accepted = False
        nis[k] = log_determinant[k] = math.nan
        aid_surprise[k] = 0.0
        if fixed:
            accepted, nis[k], log_determinant[k] = take_position(
                memory, first[k], second[k], geodetic, doubts[k] if len(doubts) else 1.0, model
            )
        aided = len(aids) > 0 and something_is_known(aids[k])
        if aided:
            aid_surprise[k] = take_aids(memory, aids[k], model)
        if fixed or aided:
            settle(memory, model)
        else:
            conclude(memory)
        if geodetic and fixed:
            recentre(memory)
        status[k] = status_of(memory, fixed, accepted)
        speak(memory, geodetic, spoken[k])
        if len(kept):
            keep(memory, kept[k])


@kernel
def track_many(
    bounds, time, first, second, doubts, aids, geodetic, model, spoken, nis, log_determinant, aid_surprise, status
):
    """`track` for each of many records that stand behind one another, record i in rows bounds[i] to bounds[i + 1]."""
    none_kept = np.empty((0, 1, 1))
    for i in range(len(bounds) - 1):
        rows = slice(bounds[i], bounds[i + 1])
        their_aids = aids[rows] if len(aids) else aids
        track(
            time[rows],
            first[rows],
            second[rows],
            doubts[rows] if len(doubts) else doubts,
            their_aids,
            geodetic,
            model,
            empty_memory(model),
            spoken[rows],
            nis[rows],
            log_determinant[rows],
            aid_surprise[rows],
            status[rows],
            none_kept,
        )
