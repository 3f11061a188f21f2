"""Filters of an archive's tracks: those of `estimation`, with the models of each class of vessel and noise level.

A track stores only the state of its filter. Discretised models are stored by step length, because intervals of whole
seconds recur; all filters share one workspace.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats, Ints
from steerway.core.compiled import called_kernel, jitable, lean_kernel
from steerway.core.earth import displaced, displacement
from steerway.core.linear_algebra import fill_lower
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
from steerway.estimation.filter.row import Row, Taken, state_row, take_row
from steerway.estimation.filter.vectors import Vec2, density, nis
from steerway.estimation.filter.weigh import NORMAL
from steerway.estimation.log.course import average
from steerway.estimation.vessel.aids import NO_AIDS

OUTPUTS = 9
"""Columns of an estimate: latitude, longitude, SOG, COG, course rate, 1σ of SOG, COG, course rate and position."""
_SLOTS, _SLOTS_PER_SECOND = 128, 7.0
"""Slots for stored steps, and slots per second of step length. 7 and 128 share no factor, so steps of 1 to 128 whole
seconds, as in AIS, each get a slot of their own."""
_LEAST_DENSITY = 1e-300
_ANYWHERE = 1e10
"""Position variance, m². Its 1σ of 100 km is more than the distance of any report within reach."""


class State(NamedTuple):
    """State of a filter: the arrays of its structures' Banks that a track stores. Several states share leading axes."""

    x: np.ndarray  # (m modes of all structures, n states)
    p: np.ndarray  # (m, n, n)
    probability: np.ndarray  # (m,) of a mode within its structure
    run: np.ndarray  # (s structures,) RUN


class Filters(NamedTuple):
    """Models of all classes and levels, stacked along a first axis, and the arrays that their predictions share."""

    models: Model  # arrays with a leading axis of models
    first: np.ndarray  # (classes and levels,) index of the first model, that of the first structure
    weights: np.ndarray  # (s,) of the structures
    change: np.ndarray  # (classes and levels,) (m/s)² per axis, variance added to the velocity before a prediction
    steerageway: np.ndarray  # (classes and levels,) m/s, lowest speed with a defined course
    steps: np.ndarray  # (models, _SLOTS, m) STEP by length; the next two fields belong to these steps, see Bank
    responses: np.ndarray
    changes: np.ndarray
    moments: np.ndarray  # workspace of a Bank
    shares: np.ndarray
    rows: np.ndarray
    product: np.ndarray
    fused: np.ndarray  # (s, FUSED)
    plain: bool  # whether the five-state filter runs all models


def filters_of(models: Sequence[Model], first: Ints, weights: Floats, change: Floats, steerageway: Floats) -> Filters:
    """Filters of models of equal size; the other arguments as in Filters."""
    one, space = models[0], (len(models), _SLOTS)
    m, n = len(one.modes), one.states
    parts = (np.stack(each) for each in zip(*(model[:5] for model in models), strict=True))
    modes, generator, processes, receiver, aids = parts
    stacked = Model(modes, generator, processes, receiver, aids, n, one.driving)
    work = empty_bank(one)
    return Filters(
        stacked,
        first,
        weights,
        change,
        steerageway,
        np.zeros((*space, m), STEP),
        np.zeros((*space, m, n), RESPONSE),
        np.zeros((*space, m, m)),
        work.moments,
        work.shares,
        work.rows,
        work.product,
        np.empty((len(weights), FUSED)),
        all(five_state.is_plain(each, NO_AIDS) for each in models),
    )


def empty_states(shape: tuple[int, ...], filters: Filters) -> State:
    """States of filters, an array of them with this shape, before the first fix."""
    s, n = len(filters.weights), filters.models.states
    m = s * filters.models.modes.shape[1]
    return State(
        np.zeros((*shape, m, n)), np.zeros((*shape, m, n, n)), np.zeros((*shape, m)), np.zeros((*shape, s), RUN)
    )


@jitable
def model_of(filters: Filters, which: int) -> Model:
    """The model with index `which`."""
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
    """The Bank of the state of one structure, with the step stored in a slot."""
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
    """The state with index k along the first axis."""
    return State(states.x[k], states.p[k], states.probability[k], states.run[k])


@jitable
def part_of(state: State, s: int) -> State:
    """The state of structure s."""
    m = len(state.probability) // len(state.run)
    a, b = s * m, (s + 1) * m
    return State(state.x[a:b], state.p[a:b], state.probability[a:b], state.run[s : s + 1])


@lean_kernel
def restart(state: State) -> None:
    """Let a filter start again at the next fix."""
    for s in range(len(state.run)):
        state.run[s].started = 0


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
    for s in range(len(state.run)):
        out.run[s] = state.run[s]


@lean_kernel
def slot_for(filters: Filters, which: int, h: float) -> int:
    """The slot for a step of h seconds; if it holds a step of another length, that step is marked as invalid (dt 0)."""
    slot = int(_SLOTS_PER_SECOND * h) % _SLOTS
    step = filters.steps[which, slot, 0]
    if step.dt != h:
        step.dt = 0.0
    return slot


@lean_kernel
def add_variance(p: Floats, i: int, variance: float) -> None:
    """Add a variance to the states i and i + 1 of every mode, p (m, n, n).

    This must be a separate kernel: numba 0.68 drops what a kernel writes to arrays that it gets from `bank_of`.
    """
    for k in range(len(p)):
        p[k, i, i] += variance
        p[k, i + 1, i + 1] += variance


@lean_kernel
def free_position(state: State) -> None:
    """Make the position unknown, so that the next fix sets the position and the velocity stays."""
    add_variance(state.p, NORTH, _ANYWHERE)
    for s in range(len(state.run)):
        run = state.run[s]
        run.outliers = run.was_outlier = 0.0


@lean_kernel
def predict(filters: Filters, which: int, state: State, dt: float) -> None:
    """Predict a filter by dt seconds for a class and level; a filter that has not started stays as it is."""
    if not (dt > 0.0 and state.run[0].started == 1):
        return
    first = filters.first[which]
    add_variance(state.p, SPEED, filters.change[which])
    if not filters.plain:
        for s in range(len(filters.weights)):
            predict_structure(filters, first + s, part_of(state, s), dt)
        return
    model = model_of(filters, first)
    parts = parts_of(state.x[0], state.p[0], model.modes[0], dt)
    h = dt / parts
    bank = bank_of(filters, first, slot_for(filters, first, h), state)
    for _ in range(parts):
        five_state.advance(bank, model, h)


@lean_kernel
def predict_structure(filters: Filters, which: int, state: State, dt: float) -> None:
    """Predict a structure by dt > 0 seconds with model `which`."""
    state.run[0].since += dt
    for j in range(steps_in(dt)):
        h = step_of(j, dt)
        take_step(bank_of(filters, which, slot_for(filters, which, h), state), model_of(filters, which), h)


@lean_kernel
def round_to(receivers: np.ndarray, digit: float, latitude: float) -> None:
    """Set the rounding step of the next fix in the receivers (models, 1) of all models.

    digit: last written digit (rad), 0 if it does not matter. latitude: rad.
    """
    if digit == 0.0 and receivers[0, 0].quantum_north == 0.0:
        return
    north, east = displacement(latitude + digit, digit, latitude, 0.0)
    for each in receivers:
        each[0].quantum_north, each[0].quantum_east = north, east


@lean_kernel
def take(filters: Filters, which: int, state: State, north: float, east: float) -> tuple[float, float]:
    """Update with a fix (m) at the filter's time. Returns its NIS and outlier probability, NaN for the first fix."""
    first, row, nis, wrong = filters.first[which], Row(0.0, north, east, 1.0), 0.0, 0.0
    if filters.plain:
        model, bank = model_of(filters, first), bank_of(filters, first, 0, state)
        rounded = model.receiver[0].quantum_north != 0.0
        taken = five_state.leave(bank, model, row) if rounded else five_state.take(bank, model, row)
        return taken.nis, taken.wrong
    for s in range(len(filters.weights)):
        taken = take_structure(filters, first + s, part_of(state, s), row)
        nis += filters.weights[s] * taken.nis
        wrong += filters.weights[s] * taken.wrong
    return nis, wrong


@lean_kernel
def take_structure(filters: Filters, which: int, state: State, row: Row) -> Taken:
    """Update a structure with a fix."""
    return take_row(bank_of(filters, which, 0, state), model_of(filters, which), row, filters.change[:0])


@called_kernel
def aid(filters: Filters, which: int, state: State, aids: Floats) -> None:
    """Update with the aids (a,) that are not NaN."""
    for s in range(len(filters.weights)):
        of_structure, k = part_of(state, s), filters.first[which] + s
        if filters.plain:
            fill_lower(of_structure.p[0])
        take_aids(bank_of(filters, k, 0, of_structure), model_of(filters, k), aids)


@called_kernel
def weigh(filters: Filters, which: int, state: State, north: float, east: float) -> tuple[float, float]:
    """Negative log-likelihood of a fix (density in 1/m²), and its lowest NIS over the modes."""
    fix, modes, total, least = Vec2(north, east), len(state.x) // len(filters.weights), 0.0, math.inf
    for k in range(len(state.x)):
        s, x, p = k // modes, state.x[k], state.p[k]
        model = model_of(filters, filters.first[which] + s)
        receiver = model.receiver[0]
        variance = receiver.fix_variance + (receiver.quantum_north**2 + receiver.quantum_east**2) / 24.0
        if filters.plain:
            fill_lower(p)
        seen = see(x, p, model.processes, receiver.time_variance, fix, variance, filters.rows)
        total += filters.weights[s] * state.probability[k] * density(seen.off, seen.s, NORMAL)
        least = min(least, nis(seen.off, seen.s))
    return -math.log(max(total, _LEAST_DENSITY)), least


@lean_kernel
def move(x: Floats, north: float, east: float) -> None:
    """Add an offset (m) to the positions of x (m, n)."""
    for k in range(len(x)):
        x[k, NORTH] += north
        x[k, EAST] += east


@lean_kernel
def recentre(track: np.record, state: State, place: tuple[float, float], at: tuple[float, float]) -> None:
    """Move the origin of a track's plane to the estimated position.

    place: latitude and longitude (rad) of a point; at: its north and east (m) in the old plane.
    """
    north, east = state.x[0, NORTH], state.x[0, EAST]
    track.latitude, track.longitude = displaced(place[0], place[1], north - at[0], east - at[1])
    move(state.x, -north, -east)


@lean_kernel
def write(filters: Filters, which: int, latitude: float, longitude: float, state: State, estimate: Floats) -> None:
    """Write the estimate (OUTPUTS,) of a filter whose plane has its origin at a position; undefined courses are NaN."""
    first, steerageway = filters.first[which], filters.steerageway[which]
    if filters.plain:
        five_state.write_estimate(bank_of(filters, first, 0, state), model_of(filters, first), steerageway, estimate)
    else:
        for s in range(len(filters.weights)):
            bank = bank_of(filters, first + s, 0, part_of(state, s))
            state_row(bank, model_of(filters, first + s), filters.fused[s])
        average(filters.fused, filters.weights, steerageway, estimate)
    if estimate[0] == 0.0 and estimate[1] == 0.0:  # as after every report
        estimate[0], estimate[1] = latitude, longitude
    else:
        estimate[0], estimate[1] = displaced(latitude, longitude, estimate[0], estimate[1])
