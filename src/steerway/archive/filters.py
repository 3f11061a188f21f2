"""The filters of an archive's tracks: `estimation`'s, with a model for each class of vessels and level of noise.

A track keeps the state of its filter alone. What predictions compute from their length is kept for each model, since
intervals of whole seconds come again and again; the workspace is common.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, jitable, lean_kernel
from steerway.core.earth import displaced, displacement
from steerway.core.linear_algebra import fill_lower
from steerway.core.records import NO_COURSE, OK, PREDICTED, REJECTED, STARTING
from steerway.estimation.filter import five_state
from steerway.estimation.filter.aids import take_aids
from steerway.estimation.filter.bank import parts_of, step_of, steps_in, take_step
from steerway.estimation.filter.fix import see
from steerway.estimation.filter.model import (
    EAST,
    FUSED,
    NORTH,
    RESPONSE,
    RUN,
    SPEED,
    STEP,
    Bank,
    Model,
    empty_bank,
)
from steerway.estimation.filter.row import Row, state_row, take_row
from steerway.estimation.filter.vectors import Vec2, density, nis
from steerway.estimation.filter.weigh import NORMAL
from steerway.estimation.log.course import COG, SOG, SOG_STD, average
from steerway.estimation.log.record import LONG
from steerway.estimation.log.run import UNKNOWN_SPEED
from steerway.estimation.vessel.aids import NO_AIDS

OUTPUTS = 9
"""Columns of an estimate: latitude, longitude, SOG, COG, course rate, the deviations of these three, of position."""
_SLOTS, _SLOTS_PER_SECOND = 128, 7.0
"""Steps kept by their length; intervals of whole seconds, as AIS has them, meet in no slot up to two minutes:
128 is a power of 2, 7 has no factor with it."""
_LEAST_DENSITY = 1e-300
_ANYWHERE = 1e10
"""m²: 100 km, further than a report within reach can be."""
_ALONE = np.ones(1)
"""Weights of one structure."""


class State(NamedTuple):
    """State of a filter, what a Bank has to keep; of many filters with further axes in front."""

    x: np.ndarray  # (m, n)
    p: np.ndarray  # (m, n, n)
    probability: np.ndarray  # (m,)
    run: np.ndarray  # (1,) RUN


class Filters(NamedTuple):
    """The models of all classes and levels, stacked along a first axis, and the arrays that their predictions share."""

    models: Model  # its arrays with an axis of models in front
    change: np.ndarray  # (models,) (m/s)² along either axis by which velocity changes before a prediction
    steerageway: np.ndarray  # (models,) m/s
    steps: np.ndarray  # (models, _SLOTS, m) STEP by length, and what belongs to them in a Bank
    responses: np.ndarray
    changes: np.ndarray
    moments: np.ndarray  # workspace of a Bank
    shares: np.ndarray
    rows: np.ndarray
    product: np.ndarray
    fused: np.ndarray  # (1, FUSED)
    plain: bool  # whether Table 1 serves all models


def filters_of(models: Sequence[Model], change: Floats, steerageway: Floats) -> Filters:
    """The filters of models of one size; change, steerageway: (models,) as there."""
    first, space = models[0], (len(models), _SLOTS)
    m, n = len(first.modes), first.states
    parts = (np.stack(each) for each in zip(*(model[:5] for model in models), strict=True))
    modes, generator, processes, receiver, aids = parts
    stacked = Model(modes, generator, processes, receiver, aids, n, first.driving)
    work = empty_bank(first)
    return Filters(
        stacked,
        change,
        steerageway,
        np.zeros((*space, m), STEP),
        np.zeros((*space, m, n), RESPONSE),
        np.zeros((*space, m, m)),
        work.moments,
        work.shares,
        work.rows,
        work.product,
        np.empty((1, FUSED)),
        all(five_state.is_plain(each, NO_AIDS) for each in models),
    )


def empty_states(shape: tuple[int, ...], filters: Filters) -> State:
    """States of so many filters that have seen nothing."""
    m, n = filters.models.modes.shape[1], filters.models.states
    return State(
        np.zeros((*shape, m, n)), np.zeros((*shape, m, n, n)), np.zeros((*shape, m)), np.zeros((*shape, 1), RUN)
    )


@jitable
def model_of(filters: Filters, which: int) -> Model:
    """One of the models."""
    all_ = filters.models
    return Model(
        all_.modes[which],
        all_.generator[which],
        all_.processes[which],
        all_.receiver[which],
        all_.aids[which],
        all_.states,
        all_.driving,
    )


@jitable
def bank_of(filters: Filters, which: int, slot: int, state: State) -> Bank:
    """The Bank of a state, with one of the steps that are kept."""
    return Bank(
        state.x,
        state.p,
        state.probability,
        state.run,
        filters.steps[which, slot],
        filters.responses[which, slot],
        filters.changes[which, slot],
        filters.moments,
        filters.shares,
        filters.rows,
        filters.product,
    )


@jitable
def state_at(states: State, k: int) -> State:
    """One of many states."""
    return State(states.x[k], states.p[k], states.probability[k], states.run[k])


@lean_kernel
def copy_state(state: State, out: State) -> None:
    """Copy the state of a filter."""
    m, n = state.x.shape
    for k in range(m):
        out.probability[k] = state.probability[k]
        for i in range(n):
            out.x[k, i] = state.x[k, i]
            for j in range(n):
                out.p[k, i, j] = state.p[k, i, j]
    out.run[0] = state.run[0]


@lean_kernel
def slot_for(filters: Filters, which: int, h: float) -> int:
    """The slot that keeps a step of h seconds; a step of another length in it is marked as unknown."""
    slot = int(_SLOTS_PER_SECOND * h) % _SLOTS
    step = filters.steps[which, slot, 0]
    if step.dt != h:
        step.dt = 0.0
    return slot


@lean_kernel
def add_variance(p: Floats, i: int, variance: float) -> None:
    """Add a variance to the states i and i + 1 of every mode, p (m, n, n).

    As a kernel of its own: what a kernel writes to arrays that it takes from `bank_of` itself, numba 0.68 leaves out.
    """
    for k in range(len(p)):
        p[k, i, i] += variance
        p[k, i + 1, i + 1] += variance


@lean_kernel
def free_position(state: State) -> None:
    """Let the position lie anywhere, so that the next fix sets it and the motion stays."""
    add_variance(state.p, NORTH, _ANYWHERE)
    run = state.run[0]
    run.outliers = run.was_outlier = 0.0


@lean_kernel
def predict(filters: Filters, which: int, state: State, dt: float) -> None:
    """Predict a filter by dt seconds by one of the models."""
    if not (dt > 0.0 and state.run[0].started == 1):
        return
    model = model_of(filters, which)
    add_variance(state.p, SPEED, filters.change[which])
    if filters.plain:
        parts = parts_of(state.x[0], state.p[0], model.modes[0], dt)
        h = dt / parts
        bank = bank_of(filters, which, slot_for(filters, which, h), state)
        for _ in range(parts):
            five_state.advance(bank, model, h)
        return
    state.run[0].since += dt
    for j in range(steps_in(dt)):
        h = step_of(j, dt)
        take_step(bank_of(filters, which, slot_for(filters, which, h), state), model, h)


@lean_kernel
def round_to(receivers: np.ndarray, digit: float, latitude: float) -> None:
    """Tell the receivers (models, 1) of all models the last digit (rad) of the next fix, at a latitude; 0: of none."""
    if digit == 0.0 and receivers[0, 0].quantum_north == 0.0:
        return
    north, east = displacement(latitude + digit, digit, latitude, 0.0)
    for each in receivers:
        each[0].quantum_north, each[0].quantum_east = north, east


@lean_kernel
def take(filters: Filters, which: int, state: State, north: float, east: float) -> tuple[float, float]:
    """Take a fix (m) at the present time. Returns its NIS and the probability of an outlier, NaN for the first."""
    model, bank, row = model_of(filters, which), bank_of(filters, which, 0, state), Row(0.0, north, east, 1.0)
    if filters.plain and model.receiver[0].quantum_north == 0.0:
        taken = five_state.take(bank, model, row)
    elif filters.plain:
        taken = five_state.leave(bank, model, row)
    else:
        taken = take_row(bank, model, row, filters.change[:0])
    return taken.nis, taken.wrong


@called_kernel
def aid(filters: Filters, which: int, state: State, aids: Floats) -> None:
    """Take the aids (a,) that are known."""
    model, bank = model_of(filters, which), bank_of(filters, which, 0, state)
    if filters.plain:
        fill_lower(state.p[0])
    take_aids(bank, model, aids)


@called_kernel
def weigh(filters: Filters, which: int, state: State, north: float, east: float) -> tuple[float, float]:
    """−log density (1/m²) of a fix, and its least NIS in a mode."""
    model = model_of(filters, which)
    receiver, fix, total, least = model.receiver[0], Vec2(north, east), 0.0, math.inf
    variance = receiver.fix_variance + (receiver.quantum_north**2 + receiver.quantum_east**2) / 24.0
    for k in range(len(state.x)):
        x, p = state.x[k], state.p[k]
        if filters.plain:
            fill_lower(p)
        seen = see(x, p, model.processes, receiver.time_variance, fix, variance, filters.rows)
        total += state.probability[k] * density(seen.off, seen.s, NORMAL)
        least = min(least, nis(seen.off, seen.s))
    return -math.log(max(total, _LEAST_DENSITY)), least


@lean_kernel
def recentre(track: np.record, state: State, place: tuple[float, float], at: tuple[float, float]) -> None:
    """Move the origin of a track's plane to the estimate, by its distance from a place (rad) at (m) in the plane."""
    north, east = state.x[0, NORTH], state.x[0, EAST]
    track.latitude, track.longitude = displaced(place[0], place[1], north - at[0], east - at[1])
    for k in range(len(state.x)):
        state.x[k, NORTH] -= north
        state.x[k, EAST] -= east


@lean_kernel
def write(filters: Filters, which: int, latitude: float, longitude: float, state: State, estimate: Floats) -> None:
    """Write the estimate (OUTPUTS,) of a filter with the origin of its plane; NaN for a course that is undefined."""
    model, bank = model_of(filters, which), bank_of(filters, which, 0, state)
    if filters.plain:
        five_state.write_estimate(bank, model, filters.steerageway[which], estimate)
    else:
        state_row(bank, model, filters.fused[0])
        average(filters.fused, _ALONE, filters.steerageway[which], estimate)
    if estimate[0] == 0.0 and estimate[1] == 0.0:  # as after every report
        estimate[0], estimate[1] = latitude, longitude
    else:
        estimate[0], estimate[1] = displaced(latitude, longitude, estimate[0], estimate[1])


@lean_kernel
def note_velocity(track: np.record, estimate: Floats, accepted: bool, interval: float) -> None:
    """Note whether the velocity is known and the vessel under way, `interval` s after the fix taken before."""
    if accepted and interval > LONG:
        track.known = 0.0
    if estimate[SOG_STD] < UNKNOWN_SPEED:
        track.known = 1.0
    track.underway = 0.0 if math.isnan(estimate[COG]) else 1.0


@lean_kernel
def status_of(track: np.record, estimate: Floats, fixed: bool, accepted: bool) -> int:
    """Status of a row, as a code of records.STATUSES, by its estimate; a velocity that is not known yet goes."""
    if track.known == 0.0:
        for i in range(SOG, len(estimate) - 1):
            estimate[i] = math.nan
        return STARTING
    if fixed and not accepted:
        return REJECTED
    if math.isnan(estimate[COG]):
        return NO_COURSE
    return OK if fixed else PREDICTED
