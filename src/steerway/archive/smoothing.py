"""Fixed-interval smoothing of the tracks of a unit, each backwards from its last row."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from steerway.archive.association import REPOSITIONED, RESTARTED, Kept
from steerway.archive.filters import (
    OUTPUTS,
    Filters,
    State,
    add_variance,
    bank_of,
    copy_state,
    empty_states,
    model_of,
    move,
    slot_for,
    state_at,
    write,
)
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.filter import five_state
from steerway.estimation.filter.bank import loses_course, parts_of, step_of, steps_in
from steerway.estimation.filter.discrete import set_steps
from steerway.estimation.filter.model import EAST, NORTH, RATE, SPEED
from steerway.estimation.filter.motion import predict
from steerway.estimation.filter.rauch_tung_striebel import Room, carry, ignore, smooth_row
from steerway.estimation.log.course import POSITION_STD, SOG


@kernel
def _smooth_pieces(
    bounds: NDArray[np.int64],
    which: NDArray[np.int64],
    time: Floats,
    filters: Filters,
    kept: Kept,
    estimate: Floats,
    spare: State,
    work: tuple[Floats, Room],
) -> None:
    """Smooth the rows from bounds[i] to bounds[i + 1] of `kept` (n, …) in place, and overwrite their estimates.

    spare, work: workspace; State of two filters, and (OUTPUTS,) with a Room.
    """
    shown, room = work
    ahead, later = state_at(spare, 0), state_at(spare, 1)
    for i in range(len(bounds) - 1):
        for k in range(bounds[i + 1] - 1, bounds[i] - 1, -1):
            state, plane = state_at(kept.states, k), kept.plane[k]
            if state.run[0].started == 0:
                continue
            fill_lower(state.p[0])
            if k + 1 < bounds[i + 1] and kept.link[k + 1] != RESTARTED and kept.states.run[k + 1, 0].started == 1:
                copy_state(state, ahead)
                copy_state(state_at(kept.states, k + 1), later)
                north, east = displacement(kept.plane[k + 1, 0], kept.plane[k + 1, 1], plane[0], plane[1])
                move(later.x, north, east)
                if _predict(filters, which[k + 1], ahead, time[k + 1] - time[k], room):
                    _smooth_by(state, ahead, later, kept.link[k + 1] == REPOSITIONED, room)
            write(filters, which[k], plane[0], plane[1], state, shown)
            for j in range(len(shown)):
                if j < SOG or j == POSITION_STD or not math.isnan(estimate[k, SOG]):
                    estimate[k, j] = shown[j]


@called_kernel
def _smooth_by(state: State, ahead: State, later: State, repositioned: bool, room: Room) -> None:
    """Smooth the state of a row with its prediction `ahead` and the smoothed state `later` of the next row.

    All are in the same plane. repositioned: the later position was set by a fix alone, and is ignored here.
    """
    of_later, of_row = later.run[0], state.run[0]
    if repositioned or of_later.step_north != of_row.step_north or of_later.step_east != of_row.step_east:
        ignore(NORTH, later.x[0], ahead.x[0], ahead.p[0])
        ignore(EAST, later.x[0], ahead.x[0], ahead.p[0])
    smooth_row(state.x[0], state.p[0], ahead.x[0], ahead.p[0], later.x[0], later.p[0], room)


@called_kernel
def _predict(filters: Filters, which: int, state: State, dt: float, room: Room) -> bool:
    """Predict a state of one mode as `filters.predict` does. `room.gain`: covariance of the states before and after.

    Returns False if the course becomes undefined on the way, because the prediction is then not linear.
    """
    k, x, p = filters.first[which], state.x[0], state.p[0]
    model = model_of(filters, k)
    copy_square(p, room.gain)
    if not dt > 0.0:
        return True
    add_variance(state.p, SPEED, filters.change[which])
    parts = parts_of(x, p, model.modes[0], dt) if filters.plain else steps_in(dt)
    for j in range(parts):
        h = dt / parts if filters.plain else step_of(j, dt)
        slot = slot_for(filters, k, h)
        bank = bank_of(filters, k, slot, state)
        if bank.steps[0].dt != h:
            if filters.plain:
                five_state.discretise(bank.steps[0], bank.responses[0, RATE], model.modes[0], h)
            else:
                set_steps(bank, model, h)
        carry(room.gain, bank, model, room)
        if filters.plain:
            five_state.predict(x, p, bank.steps[0], bank.responses[0, RATE])
        else:
            predict(x, p, bank.steps[0], bank.responses[0], model.driving, bank.rows)
        if loses_course(x, p):
            return False
    return True


@lean_kernel
def copy_square(p: Floats, out: Floats) -> None:
    """Copy a symmetric matrix."""
    for i in range(len(p)):
        for j in range(len(p)):
            out[i, j] = p[i, j]


def smoothed(
    order: NDArray[np.int64],
    pieces: NDArray[np.int64],
    which: NDArray[np.int64],
    time: Floats,
    filters: Filters,
    kept: Sequence[Kept],
    estimate: Floats,
) -> np.ndarray:
    """The smoothed estimate (n, OUTPUTS), in the order of `order`. Each piece of a track is smoothed separately.

    Args:
        order: (n,) row numbers by track and time. pieces: (m + 1,) where each piece begins in `order`; the last is n.
            which: (n,) index of the model that predicted each row. time, estimate: as in `association.associate`. kept:
            filter states of the rows, one Kept after another.
    """
    n, estimate = filters.models.states, estimate[order]
    joined = [np.concatenate(parts)[order] for parts in zip(*((*k.states, *k[1:]) for k in kept), strict=True)]
    whole = Kept(State(*joined[:4]), *joined[4:])
    gain, lower, product = np.empty((3, n, n))
    scale, error = np.empty((2, n))
    room = Room(gain, lower, product, scale, error, np.empty((4, n)))
    work = np.empty(OUTPUTS), room
    _smooth_pieces(pieces, which[order], time[order], filters, whole, estimate, empty_states((2,), filters), work)
    return estimate
