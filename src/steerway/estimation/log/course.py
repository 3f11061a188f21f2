"""SOG, COG and course rate of a record or a stream, by weighted structures.

Every structure runs as a bank of modes. The estimate is the structures' weighted mean; its variance includes their
differences.
"""

import math
from collections.abc import Sequence

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel
from steerway.estimation.filter import five_state
from steerway.estimation.filter.fuse import COURSE_STD, add_unresolved_rate, add_unresolved_speed
from steerway.estimation.filter.model import FUSED, ON_ACCELERATION, ON_FIX, Bank, Kept, Model, empty_bank
from steerway.estimation.filter.reversal import reversal_of, reversed_aids
from steerway.estimation.filter.row import Asked, Rows, run_record
from steerway.estimation.filter.smoother import room_to_meet, smooth_kept
from steerway.estimation.vessel.flat import Weighed

STEERAGEWAY = 0.3
"""Speed, m/s, above which the course of every receiver is output if its σ is small. Below it, the slow error of a
receiver at rest looks like motion."""
_PER_NOISE, _WHILE = 3.0, 10.0
"""For a receiver with little noise, course is output above a speed of 3/s times its noise. This noise is that of a fix
plus the change of the slow error within 10 s. For 0.1 m, the least noise of low-cost receivers, this is 0.3 m/s.
Compared on a log at a berth (positions of six digits, SOG of 0.03 m/s by the receiver): 0.7 % of the rows have a course
with a limit of 0.3 m/s, 67 % without."""
NORTH, EAST, SOG, COG, RATE, SOG_STD, COG_STD, RATE_STD, POSITION_STD = range(9)
"""Columns of an estimate; SI, NaN where unknown."""


def run_model(record: Rows, model: Model, bank: Bank, asked: Asked) -> None:
    """Run a model's filter over a record: the five-state filter alone where the model needs no more."""
    (five_state.run if five_state.is_plain(model, record.aids) else run_record)(record, model, bank, asked)


def least_course_speed(structures: Sequence[Weighed], steerageway: float = STEERAGEWAY) -> float:
    """Speed (m/s) below which structures output no course: `steerageway`, or less for a receiver with little noise."""
    total = sum(each.weight for each in structures)
    variance = sum(each.weight * _noise_variance(each.model) for each in structures) / total
    return min(steerageway, _PER_NOISE * math.sqrt(variance))


def _noise_variance(model: Model) -> float:
    """Variance (m²) of the change of a fix's error within seconds, rounding included.

    The displacement in 1 s by an acceleration that persists counts too, because it moves a vessel at rest to and fro.
    """
    receiver = model.receiver[0]
    rounding = (receiver["quantum_north"] ** 2 + receiver["quantum_east"] ** 2) / 24.0
    steps = receiver["step_rate"] * _WHILE * receiver["step_variance"]
    slow = model.processes[model.processes["acts_on"] == ON_FIX]
    changes = 2.0 * slow["variance"] * -np.expm1(-slow["decay"] * _WHILE)
    pushed = model.processes["variance"][model.processes["acts_on"] == ON_ACCELERATION]
    return float(receiver["fix_variance"] + rounding + steps + changes.sum() + 0.25 * pushed.sum())


def smoothed_rows(record: Rows, model: Model, kept: Kept, apart: Floats) -> Floats:
    """Smoothed `fuse` (n, FUSED) of every row, from what the model's filter kept of the record.

    apart: (n,) s, see `fixes_apart`.
    """
    backward, out = record._replace(aids=reversed_aids(record.aids)), np.empty((len(record.time), FUSED))
    smooth_kept(backward, reversal_of(model), empty_bank(model), kept, room_to_meet(model), out)
    add_unresolved(model.processes, apart, out)
    return out


@kernel
def add_unresolved(processes: np.ndarray, apart: Floats, outs: Floats) -> None:
    """Add the variance of motion that fixes at intervals of `apart` (n,) s do not resolve to `fuse` (n, FUSED)."""
    for k in range(len(outs)):
        add_unresolved_speed(processes, apart[k], outs[k])
        add_unresolved_rate(processes, apart[k], outs[k])


def fixes_apart(time: Floats, north: Floats) -> Floats:
    """(n,) s between the fixes around every row; at a fix, the shorter interval; 0 with fewer than two fixes."""
    fixed = time[np.isfinite(north)]
    if len(fixed) < 2:
        return np.zeros(len(time))
    intervals = np.diff(fixed)
    before, after = (np.searchsorted(fixed, time, side).clip(1, len(intervals)) - 1 for side in ("left", "right"))
    return np.minimum(intervals[before], intervals[after])


def averaged(outs: Sequence[Floats], weights: Sequence[float], steerageway: float = STEERAGEWAY) -> Floats:
    """(n, 9) estimate: mean of the structures' `fuse` (n, FUSED), with the spread within and between structures."""
    estimate = np.empty((len(outs[0]), POSITION_STD + 1))
    _average_rows(np.stack([out[:, :FUSED] for out in outs], axis=1), np.asarray(weights, float), steerageway, estimate)
    return estimate


@kernel
def _average_rows(outs: Floats, weights: Floats, steerageway: float, estimate: Floats) -> None:
    """`average` of every row: outs (n, structures, FUSED)."""
    for k in range(len(estimate)):
        average(outs[k], weights, steerageway, estimate[k])


@called_kernel
def average(outs: Floats, weights: Floats, steerageway: float, estimate: Floats) -> None:
    """Weighted mean of structures (s, FUSED), and the spread within and between them, into `estimate` (9,)."""
    likeliest = 0
    for s in range(1, len(outs)):
        if weights[s] > weights[likeliest]:
            likeliest = s
    reference = outs[likeliest, COG]
    for i in range(NORTH, RATE + 1):
        mean = 0.0
        for s in range(len(outs)):
            mean += weights[s] * (wrap(outs[s, i] - reference) if i == COG else outs[s, i])
        spread = 0.0
        for s in range(len(outs)):
            value = wrap(outs[s, i] - reference) if i == COG else outs[s, i]
            spread += weights[s] * (value - mean) ** 2
        estimate[i] = mean if i != COG else wrap(mean + reference)
        if i >= SOG:
            within = 0.0
            for s in range(len(outs)):
                within += weights[s] * outs[s, i + 3]
            estimate[i + 3] = math.sqrt(within + spread)
        elif i == NORTH:
            estimate[POSITION_STD] = spread
        else:
            estimate[POSITION_STD] += spread
    within = 0.5 * estimate[POSITION_STD]
    for s in range(len(outs)):
        within += weights[s] * outs[s, 8]
    estimate[POSITION_STD] = math.sqrt(within)
    if not (estimate[COG_STD] < COURSE_STD and estimate[SOG] >= steerageway):
        estimate[COG] = estimate[RATE] = estimate[COG_STD] = estimate[RATE_STD] = math.nan
