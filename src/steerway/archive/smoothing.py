"""Fixed-interval smoothing of the tracks of a unit: each from its last row back."""

import numpy as np

from steerway.core.compiled import kernel
from steerway.estimation.course.smoothing.rauch_tung_striebel import smooth

LONGEST_CROSSED = 1800.0
"""s: beyond it the filter starts anew, and nothing later says anything of before."""


@kernel
def _smooth_pieces(bounds, row_of, time, parameters, kept, estimate):
    for i in range(len(bounds) - 1):
        rows = slice(bounds[i], bounds[i + 1])
        smooth(time[rows], True, parameters, row_of[rows], kept[rows], estimate[rows])


def smoothed(order, pieces, row_of, time, parameters, kept, estimate) -> np.ndarray:
    """The estimate (n, OUTPUTS) in the given order of rows, smoothed within pieces.

    Args:
        order: (n,) rows by track and time. pieces: (m + 1,) where in that order pieces begin. row_of: (n,) by which of
            the parameters (any, k) each row was predicted. time, kept, estimate: as `association.associate` has them.
    """
    time, kept, estimate = time[order], kept[order], estimate[order]
    _smooth_pieces(pieces, row_of[order], time, parameters, kept, estimate)
    return estimate
