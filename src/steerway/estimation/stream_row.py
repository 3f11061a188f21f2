"""One row of a streamed filter: its whole state in one array, and the kernels that step and read it."""

import math
from typing import NamedTuple

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel
from steerway.core.gaps import LONGEST_GAP
from steerway.estimation.filter import five_state
from steerway.estimation.filter.model import FUSED, bank_in, model_in
from steerway.estimation.filter.row import Row, state_row, take_row
from steerway.estimation.log.accuracy import variance_scale
from steerway.estimation.log.copies import TURNED
from steerway.estimation.log.course import COG, EAST, NORTH, SOG, SOG_STD
from steerway.estimation.log.outage import SHORTEST, SLIDES, doubt, is_faster, is_outage
from steerway.estimation.log.plane import LONG_STEP, place_near, step_to
from steerway.estimation.log.record import LONG
from steerway.estimation.log.run import UNKNOWN_SPEED

(
    LATITUDE,  # of the last fix, rad
    LONGITUDE,
    FIRST,  # coordinates of the last fix in the plane, m
    SECOND,
    AZIMUTH,  # direction of the first axis of the plane at the last fix, rad east of north
    PLACED,  # 1 after the first fix
    KNOWN,  # 1 once the speed is known
    USUAL,  # state of `variance_scale`
    USUAL_COUNT,
    ELAPSED,  # s since the first row
    FADED,  # s since another set of structures was taken up
    COARSE,  # least step between fixes along one axis, m
    SINCE,  # s since the last fix that was not a copy
    LAST_SOG,  # m/s after the last row
    USUAL_INTERVAL,  # s between the last two fixes without an outage between them
    RETURNED,  # ELAPSED at the first fix after the last outage, 0 without one
    SOG_BEFORE,  # m/s at the last fix before this outage
    COG_BEFORE,  # rad in the plane
    SLIDES_IN,  # 1 if positions after this outage are suspected to slide, see `log.outage`
    FIXED_SOG,  # m/s at the last fix
    FIXED_COG,
    ASTRAY,  # 1 if the last step was long, and did not lead back home
    HOME,  # LATITUDE to AZIMUTH of the last fix before the last long step, see `plane.Plane.home`
) = range(23)
"""State of the filter before the banks. With fields of a NamedTuple instead, a streamed step takes a quarter longer."""
HEADER = HOME + AZIMUTH + 1
_ONE_BANK = HEADER + 1
"""Index at which the bank of a single structure begins, after its weight."""
NIS, WRONG, LOG_DENSITY = FUSED, FUSED + 1, FUSED + 2
"""Columns after those of `fuse`: NIS, probability of an outlier, log density of the row."""


class Alike(NamedTuple):
    """Structures of equal dimensions, which one kernel call steps."""

    banks: Floats  # (structures, `bank_size`)
    models: Floats  # (structures, …), see `packed`
    outs: Floats  # (structures, FUSED + 3)


@kernel
def step(
    banks: Floats, models: Floats, dt: float, first: float, second: float, excess: float, aids: Floats, outs: Floats
) -> None:
    """Step structures of equal dimensions by one row (see `Row`), as `run_record` does; aids: one row or none.

    outs (structures, FUSED + 3) ← `state_row`, NIS, WRONG and LOG_DENSITY.
    """
    for k in range(len(outs)):
        model, out = model_in(models[k]), outs[k]
        bank = bank_in(banks[k], len(model.modes), model.states)
        row = Row(dt, first, second, excess)
        taken = take_row(bank, model, row, aids[0] if len(aids) else models[k, :0])
        state_row(bank, model, out)
        out[NIS], out[WRONG], out[LOG_DENSITY] = taken.nis, taken.wrong, taken.log_density


@kernel
def step_plain(
    banks: Floats, models: Floats, dt: float, first: float, second: float, excess: float, aids: Floats, outs: Floats
) -> None:
    """As `step`, for structures that run by Table 1; aids are ignored and `state_row` is not written."""
    for k in range(len(outs)):
        model, out = model_in(models[k]), outs[k]
        taken = five_state.take(bank_in(banks[k], 1, 5), model, Row(dt, first, second, excess))
        out[NIS], out[WRONG], out[LOG_DENSITY] = taken.nis, taken.wrong, taken.log_density


@lean_kernel
def predict_plain(state: Floats, numbers: Floats, dt: float) -> None:
    """Advance a single structure that runs by Table 1, by dt (s)."""
    bank = bank_in(state[_ONE_BANK:], 1, 5)
    if dt > LONGEST_GAP:
        state[KNOWN], bank.run[0].started = 0.0, 0
        return
    state[SINCE] += dt
    state[ELAPSED] += dt
    five_state.wait(bank, model_in(numbers), dt)


@lean_kernel
def take_plain(
    state: Floats, numbers: Floats, first: float, second: float, reported: float, steerageway: float, estimate: Floats
) -> float:
    """Correct a single structure that runs by Table 1, by a fix, and fill the estimate (9,). Returns the NIS."""
    bank, model = bank_in(state[_ONE_BANK:], 1, 5), model_in(numbers)
    excess = variance_scale(state[USUAL : USUAL_COUNT + 1], reported)
    note_interval(state, 0.0)
    taken = five_state.take(bank, model, Row(0.0, first, second, excess))
    five_state.write_estimate(bank, model, steerageway, estimate)
    settle(state, estimate)
    note_fix(state, estimate)
    return taken.nis


@lean_kernel
def note_interval(state: Floats, dt: float) -> None:
    """Before the correction by a fix dt (s) from now: note the end of an outage; after a long one SOG is unknown."""
    interval = state[SINCE]
    if interval > LONG:
        state[KNOWN] = 0.0
    if is_outage(interval, state[USUAL_INTERVAL]):
        state[RETURNED], state[SLIDES_IN] = state[ELAPSED] + dt, 0.0
        state[SOG_BEFORE], state[COG_BEFORE] = state[FIXED_SOG], state[FIXED_COG]
    elif 0.0 < interval < SHORTEST:
        state[USUAL_INTERVAL] = interval
    state[SINCE] = 0.0


@lean_kernel
def settle(state: Floats, estimate: Floats) -> None:
    """After a row: note the speed, whether it is known and whether it shows a slide; then `doubt_slide`."""
    state[LAST_SOG] = estimate[SOG]
    if estimate[SOG_STD] < UNKNOWN_SPEED:
        state[KNOWN] = 1.0
    if may_slide(state) and is_faster(estimate[SOG], state[SOG_BEFORE]):
        state[SLIDES_IN] = 1.0
    doubt_slide(state, estimate)


@lean_kernel
def note_fix(state: Floats, estimate: Floats) -> None:
    """After a fix: note its velocity."""
    state[FIXED_SOG], state[FIXED_COG] = estimate[SOG], estimate[COG]


@lean_kernel
def may_slide(state: Floats) -> bool:
    """Whether the last outage ended less than SLIDES s ago, so that positions may still slide, see `outage`."""
    return state[RETURNED] > 0.0 and state[ELAPSED] - state[RETURNED] < SLIDES


@lean_kernel
def doubt_slide(state: Floats, estimate: Floats) -> None:
    """Apply `outage.doubt` to an estimate (9,) while `may_slide` is true."""
    if may_slide(state):
        doubt(estimate, state[SOG_BEFORE], state[COG_BEFORE], state[SLIDES_IN] == 1.0)


@lean_kernel
def read_plain(state: Floats, numbers: Floats, steerageway: float, estimate: Floats) -> None:
    """Fill the estimate (9,) of a single structure that runs by Table 1."""
    five_state.write_estimate(bank_in(state[_ONE_BANK:], 1, 5), model_in(numbers), steerageway, estimate)


@kernel
def read(banks: Floats, models: Floats, outs: Floats) -> None:
    """Fill `state_row` of structures of equal dimensions into outs."""
    for k in range(len(outs)):
        model = model_in(models[k])
        bank = bank_in(banks[k], len(model.modes), model.states)
        state_row(bank, model, outs[k, :FUSED])


@kernel
def walk(state: Floats, latitude: float, longitude: float) -> tuple[float, float]:
    """Move the origin of the header to a fix (rad). Returns the coordinates of the fix in the plane (m).

    A fix is reached from the one before, or from HOME if a long step leads back there, see `plane.LONG_STEP`.
    """
    if state[PLACED] == 0.0:
        state[PLACED] = 1.0
        state[LATITUDE], state[LONGITUDE] = latitude, longitude
        state[HOME:HEADER] = state[: AZIMUTH + 1]
        return state[FIRST], state[SECOND]
    place, home = (state[LATITUDE], state[LONGITUDE]), (state[HOME + LATITUDE], state[HOME + LONGITUDE])
    north, east, convergence, is_long, from_home = step_to(place, home, (latitude, longitude))
    if is_long:
        origin = state[HOME:HEADER].copy()
        if state[ASTRAY] == 0.0:
            state[HOME:HEADER] = state[: AZIMUTH + 1]
        if from_home:
            state[: AZIMUTH + 1] = origin
    state[ASTRAY] = 1.0 if is_long and not from_home else 0.0
    c, s = math.cos(state[AZIMUTH]), math.sin(state[AZIMUTH])
    state[FIRST] += c * north + s * east
    state[SECOND] += c * east - s * north
    state[AZIMUTH] += convergence
    for way, other in ((abs(north), abs(east)), (abs(east), abs(north))):
        if way > TURNED * other and (way < state[COARSE] or state[COARSE] == 0.0):
            state[COARSE] = way
    state[LATITUDE], state[LONGITUDE] = latitude, longitude
    return state[FIRST], state[SECOND]


@kernel
def origin_of(state: Floats, estimate: Floats) -> Floats:
    """LATITUDE to AZIMUTH (5,) of the origin by which an estimate (9,) is placed: the last fix, or HOME if that is
    nearer than a last fix far away."""
    ahead, aside = estimate[NORTH] - state[FIRST], estimate[EAST] - state[SECOND]
    home_ahead, home_aside = estimate[NORTH] - state[HOME + FIRST], estimate[EAST] - state[HOME + SECOND]
    away = math.hypot(ahead, aside)
    if away > LONG_STEP and math.hypot(home_ahead, home_aside) < away:
        return state[HOME:HEADER]
    return state[: AZIMUTH + 1]


@kernel
def place_of(state: Floats, estimate: Floats) -> tuple[float, float]:
    """Latitude and longitude (rad) of an estimate (9,)."""
    origin = origin_of(state, estimate)
    ahead, aside = estimate[NORTH] - origin[FIRST], estimate[EAST] - origin[SECOND]
    return place_near(origin[LATITUDE], origin[LONGITUDE], origin[AZIMUTH], ahead, aside)


def true_course(state: Floats, estimate: Floats) -> float:
    """Course (rad) of an estimate (9,) from true north."""
    cog = estimate.item(COG) + origin_of(state, estimate).item(AZIMUTH)
    return cog if -math.pi <= cog < math.pi else (cog + math.pi) % (2.0 * math.pi) - math.pi
