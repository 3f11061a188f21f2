"""Where a vessel will be: the banks of modes predicted on, without fixes.

Every mode goes on as its motion has it and gives way to the others at its rates; where a mode loses its course, its
place may lie in any direction (`bank.forget_direction`), so that the spread stays that of a disc, not of a line.
"""

import numpy as np

from steerway.core.compiled import called_kernel, kernel
from steerway.estimation.inference.bank import advance
from steerway.estimation.inference.model import EAST, FUSED, NORTH, empty_bank, room_to_keep
from steerway.estimation.inference.structures import model_of
from steerway.estimation.inference.track import recall, run_record
from steerway.estimation.inference.whole_log import Track

MOMENTS = 5
"""Mean north and east (m), variance of north, covariance, variance of east (m²)."""


def forecasts(track: Track, structures, horizons, rows=None) -> np.ndarray:
    """(rows, horizons, 5): MOMENTS in the plane `horizons` seconds (ascending) after these rows, or after the last."""
    horizons, weights, outs = np.asarray(horizons, float), [], []
    for each in structures:
        model, states, driving = model_of(each.parts, each.values)
        kept = room_to_keep(0 if rows is None else len(track.record.time), states)
        bank = empty_bank(states)
        *columns, restarts = track.record
        run_record(*columns, model, bank, driving, restarts, np.empty((0, FUSED + 2)), np.empty(0), 0, kept)
        out = np.empty((1 if rows is None else len(rows), len(horizons), MOMENTS))
        predict_rows(model, bank, driving, kept, np.asarray([-1] if rows is None else rows), horizons, out)
        weights.append(each.weight)
        outs.append(out)
    return mixed(np.stack(outs), np.array(weights))


@kernel
def predict_rows(model, bank, motion_states, kept, rows, horizons, out):
    """Fill `out` (rows, horizons, MOMENTS) from what a filter has kept of these rows; −1: from the bank as it is."""
    for i in range(len(rows)):
        if rows[i] >= 0:
            recall(kept, rows[i], bank.x, bank.p, bank.probability)
        reached = 0.0
        for j in range(len(horizons)):
            if horizons[j] > reached:
                advance(bank, model, horizons[j] - reached, motion_states)
                reached = horizons[j]
            place_moments(bank.x, bank.p, bank.probability, out[i, j])


@called_kernel
def place_moments(x, p, probability, out):
    """MOMENTS of the place, of all modes together, into `out`."""
    for i in range(MOMENTS):
        out[i] = 0.0
    for k in range(len(probability)):
        out[0] += probability[k] * x[k, NORTH]
        out[1] += probability[k] * x[k, EAST]
    for k in range(len(probability)):
        a, b = x[k, NORTH] - out[0], x[k, EAST] - out[1]
        out[2] += probability[k] * (p[k, 0, 0] + a * a)
        out[3] += probability[k] * (p[k, 0, 1] + a * b)
        out[4] += probability[k] * (p[k, 1, 1] + b * b)


def mixed(moments, weights):
    """(…, MOMENTS) of the mixture of structures (s, …, MOMENTS) of these weights."""
    mean = np.tensordot(weights, moments, 1)
    apart = moments[..., :2] - mean[..., :2]
    mean[..., 2] += np.tensordot(weights, apart[..., 0] ** 2, 1)
    mean[..., 3] += np.tensordot(weights, apart[..., 0] * apart[..., 1], 1)
    mean[..., 4] += np.tensordot(weights, apart[..., 1] ** 2, 1)
    return mean


def rotated(moments, azimuth):
    """Variance of true north, covariance and variance of east (…,) of MOMENTS in a plane of this azimuth."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    nn, ne, ee = moments[..., 2], moments[..., 3], moments[..., 4]
    return (
        c * c * nn - 2.0 * c * s * ne + s * s * ee,
        c * s * (nn - ee) + (c * c - s * s) * ne,
        s * s * nn + 2.0 * c * s * ne + c * c * ee,
    )
