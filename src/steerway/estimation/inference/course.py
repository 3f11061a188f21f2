"""SOG, COG and course rate of a record or a stream, by the structures that an inference found.

Every structure runs as a bank of modes. The estimate is their weighted mean; its variance holds their differences.
"""

import numpy as np

from steerway.estimation.inference.bank import LONGEST_STEP, MOST_STEPS
from steerway.estimation.inference.fit import Rows
from steerway.estimation.inference.model import FUSED, empty_bank, room_to_keep
from steerway.estimation.inference.smoother import ROOM, smooth_kept
from steerway.estimation.inference.structures import model_of
from steerway.estimation.inference.track import run_record

COURSE_STD = 0.6
"""rad; a course that is known worse is not stated."""
STEERAGEWAY = 0.3
"""m/s; no course is stated below it, as by the profiles (`steerway study low-speed`): what a receiver at rest reports
as motion is its own slow error."""
_EMPTY = np.empty(0)
NORTH, EAST, SOG, COG, RATE, SOG_STD, COG_STD, RATE_STD, POSITION_STD = range(9)
"""Columns of an estimate; SI, NaN where unknown."""


def filter_record(record: Rows, structures):
    """Causal estimate (n, 9), NIS (n,) and probability of an outlier (n,) of every row."""
    outs = []
    for each in structures:
        model, states, driving = model_of(each.parts, each.values)
        out = np.empty((len(record.time), FUSED + 2))
        *rows, restarts = record
        run_record(*rows, model, empty_bank(states), driving, restarts, out, _EMPTY, 0, room_to_keep(0, states))
        outs.append(out)
    weights = [each.weight for each in structures]
    nis, wrong = (sum(w * out[:, column] for w, out in zip(weights, outs, strict=True)) for column in (-2, -1))
    return averaged(outs, weights), nis, wrong


def smoothed_record(record: Rows, structures):
    """Estimate (n, 9) of every row that knows the whole record."""
    record, own = with_fillers(record)
    outs = []
    for each in structures:
        model, states, driving = model_of(each.parts, each.values)
        out, kept, bank = (
            np.empty((len(record.time), FUSED + 2)),
            room_to_keep(len(record.time), states),
            empty_bank(states),
        )
        *rows, restarts = record
        run_record(*rows, model, bank, driving, restarts, out[:0], _EMPTY, 0, kept)
        smooth_kept(record.time, model, bank, driving, kept, np.zeros((ROOM, states, states)), out)
        outs.append(out[own])
    return averaged(outs, [each.weight for each in structures])


def averaged(outs, weights):
    """Mean over structures of `fuse` (n, FUSED), and the spread within and between them, as (n, 9)."""
    outs, weights = np.stack([out[:, :FUSED] for out in outs]), np.asarray(weights)[:, None, None]
    likeliest = outs[int(np.argmax(weights))]
    values = outs[:, :, :5].copy()
    values[:, :, 3] = (values[:, :, 3] - likeliest[:, 3] + np.pi) % (2.0 * np.pi) - np.pi
    mean = (weights * values).sum(axis=0)
    between = (weights * (values - mean) ** 2).sum(axis=0)
    within = (weights * outs[:, :, 5:9]).sum(axis=0)
    mean[:, 3] = (mean[:, 3] + likeliest[:, 3] + np.pi) % (2.0 * np.pi) - np.pi
    within[:, :3] += between[:, 2:5]
    within[:, 3] += 0.5 * (between[:, 0] + between[:, 1])
    estimate = np.column_stack([mean, np.sqrt(within)])
    unknown = ~((estimate[:, COG_STD] < COURSE_STD) & (estimate[:, SOG] >= STEERAGEWAY))
    for column in (COG, RATE, COG_STD, RATE_STD):
        estimate[unknown, column] = np.nan
    return estimate


def with_fillers(record: Rows):
    """The record with rows added, so that no step of the smoother is too long, and the places of its own rows."""
    gaps = np.diff(record.time)
    pieces = np.ceil(gaps / LONGEST_STEP - 1e-3).astype(int).clip(1, MOST_STEPS)
    pieces[record.restarts - 1] = 1
    own = np.concatenate([[0], np.cumsum(pieces)])
    n = own[-1] + 1

    def spread(column):
        if not len(column):
            return column
        wide = np.full((n, *column.shape[1:]), np.nan)
        wide[own] = column
        return wide

    time = np.interp(np.arange(n), own, record.time)
    excess = np.nan_to_num(spread(record.excess), nan=1.0)
    return Rows(time, spread(record.north), spread(record.east), excess, spread(record.aids), own[record.restarts]), own
