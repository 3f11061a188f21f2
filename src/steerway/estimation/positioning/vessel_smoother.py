"""Fixed-interval smoothing of a record of fixes and forces by a `VesselFilter`.

Rauch, Tung and Striebel, AIAA Journal 3(8), 1965. The backward pass predicts each row again.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap
from steerway.core.arrays import Bools, Floats
from steerway.core.checks import array_of
from steerway.core.compiled import kernel
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.filter.rauch_tung_striebel import Room, ignore, smoothing_step
from steerway.estimation.positioning.low_speed import HEADING, advance_mean, spread, transition
from steerway.estimation.positioning.vessel_filter import VesselFilter


class VesselRecord(NamedTuple):
    """States (rows, n) and covariances (rows, n, n), filtered and smoothed, and the NIS of every fix (rows,)."""

    filtered: Floats
    filtered_covariance: Floats
    smoothed: Floats
    smoothed_covariance: Floats
    nis: Floats


def smooth(
    estimator: VesselFilter, forces: ArrayLike, fixes: ArrayLike, headings: ArrayLike, dt: float
) -> VesselRecord:
    """Run `estimator` from its present state over a record of rows `dt` s apart, and smooth it.

    Args:
        forces: (rows − 1, 3) actuator forces from each row to the next, surge N, sway N, yaw N·m.
        fixes: (rows, 2) north and east (m), NaN in rows without a fix.
        headings: (rows,) compass (rad), NaN in rows without one.

    Raises InputError for other shapes.
    """
    headings = array_of("headings", headings, (None,))
    rows, n = len(headings), len(estimator.state)
    fixes, forces = array_of("fixes", fixes, (rows, 2)), array_of("forces", forces, (max(rows - 1, 0), 3))
    states, covariances = np.empty((rows, n)), np.empty((rows, n, n))
    densities, anew, nis = np.empty((rows, n)), np.zeros(rows, dtype=np.bool_), np.full(rows, math.nan)
    for k in range(rows):
        if k:
            estimator.predict(forces[k - 1], dt)
        if math.isfinite(headings[k]):
            estimator.update_heading(headings[k])
        if math.isfinite(fixes[k, 0]):
            nis[k] = estimator.update(fixes[k, 0], fixes[k, 1])
            anew[k] = estimator.retaken
        states[k], covariances[k], densities[k] = estimator.state, estimator.covariance, estimator.densities
    back, back_covariances = states.copy(), covariances.copy()
    _backward(back, back_covariances, forces, densities, anew, estimator.model, dt)
    return VesselRecord(states, covariances, back, back_covariances, nis)


@kernel
def _backward(
    states: Floats, covariances: Floats, forces: Floats, densities: Floats, anew: Bools, model: Floats, dt: float
) -> None:
    rows, n = states.shape
    work, square, vectors = np.empty((3, n, n)), np.empty((3, n, n)), np.empty((6, n))
    room = Room(square[0], square[1], square[2], vectors[0], vectors[1], vectors[2:])
    middle, excess, predicted = np.empty(n), np.empty(n), np.empty(n)
    p_next, p_later = np.empty((n, n)), np.empty((n, n))
    for k in range(rows - 2, -1, -1):
        predicted[:], p_next[:] = states[k], covariances[k]
        advance_mean(predicted, forces[k], model, dt, middle)
        transition(middle, model, dt, work[0], work[1], work[2])
        spread(p_next, work[0], densities[k + 1], dt, work[1])
        excess[:], p_later[:] = states[k + 1], covariances[k + 1]
        if anew[k + 1]:
            ignore(0, excess, predicted, p_next)
            ignore(1, excess, predicted, p_next)
        for i in range(n):
            excess[i] -= predicted[i]
        excess[HEADING] = wrap(excess[HEADING])
        smoothing_step(states[k], covariances[k], work[0], p_next, excess, p_later, room)
        states[k, HEADING] = wrap(states[k, HEADING])
        fill_lower(covariances[k])
