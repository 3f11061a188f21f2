"""Fixed-interval smoothing of the tracks of a unit: each from its last row back."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from steerway.archive.association import ANEW, SET_DOWN, Kept
from steerway.archive.filters import (
    OUTPUTS,
    Filters,
    State,
    add_variance,
    bank_of,
    copy_state,
    empty_states,
    model_of,
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

LONGEST_CROSSED = 1800.0
"""s: beyond it the filter starts anew, and nothing later says anything of before."""


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
    """Smooth what is kept (n, …) of pieces from bounds[i] to bounds[i + 1] in place, and write their estimates anew.

    spare: State of two filters, workspace; work: (OUTPUTS,) and a Room.
    """
    shown, room = work
    ahead, later = state_at(spare, 0), state_at(spare, 1)
    for i in range(len(bounds) - 1):
        for k in range(bounds[i + 1] - 1, bounds[i] - 1, -1):
            state, plane = state_at(kept.states, k), kept.plane[k]
            if state.run[0].started == 0:
                continue
            fill_lower(state.p[0])
            if k + 1 < bounds[i + 1] and kept.link[k + 1] != ANEW and kept.states.run[k + 1, 0].started == 1:
                copy_state(state, ahead)
                copy_state(state_at(kept.states, k + 1), later)
                move(later.x, displacement(kept.plane[k + 1, 0], kept.plane[k + 1, 1], plane[0], plane[1]))
                if _predict(filters, which[k + 1], ahead, time[k + 1] - time[k], room):
                    _smooth_by(state, ahead, later, kept.link[k + 1] == SET_DOWN, room)
            write(filters, which[k], plane[0], plane[1], state, shown)
            for j in range(len(shown)):
                if j < SOG or j == POSITION_STD or not math.isnan(estimate[k, SOG]):
                    estimate[k, j] = shown[j]


@lean_kernel
def move(x: Floats, way: tuple[float, float]) -> None:
    """Move the positions of x (m, n)."""
    for k in range(len(x)):
        x[k, NORTH] += way[0]
        x[k, EAST] += way[1]


@called_kernel
def _smooth_by(state: State, ahead: State, later: State, set_down: bool, room: Room) -> None:
    """Smooth the state of a row, predicted as `ahead`, by the later one, smoothed, in the same plane.

    set_down: whether the position of that has nothing to do with the row.
    """
    of_later, of_row = later.run[0], state.run[0]
    if set_down or of_later.step_north != of_row.step_north or of_later.step_east != of_row.step_east:
        ignore(NORTH, later.x[0], ahead.x[0], ahead.p[0])
        ignore(EAST, later.x[0], ahead.x[0], ahead.p[0])
    smooth_row(state.x[0], state.p[0], ahead.x[0], ahead.p[0], later.x[0], later.p[0], room)


@called_kernel
def _predict(filters: Filters, which: int, state: State, dt: float, room: Room) -> bool:
    """Predict a state of one mode as `filters.predict` does, and its covariance with what it was, `room.gain`.

    Returns False where the course is lost on the way: the moments that are then matched are no linear prediction.
    """
    x, p, model = state.x[0], state.p[0], model_of(filters, which)
    copy_square(p, room.gain)
    if not dt > 0.0:
        return True
    add_variance(state.p, SPEED, filters.change[which])
    parts = parts_of(x, p, model.modes[0], dt) if filters.plain else steps_in(dt)
    for j in range(parts):
        h = dt / parts if filters.plain else step_of(j, dt)
        slot = slot_for(filters, which, h)
        bank = bank_of(filters, which, slot, state)
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
    """The estimate (n, OUTPUTS) in the given order of rows, smoothed within pieces.

    Args:
        order: (n,) rows by track and time. pieces: (m + 1,) where in that order pieces begin. which: (n,) by which of
            the models each row was predicted. time, estimate: as `association.associate` has them. kept: Kept of parts
            of the rows.
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
