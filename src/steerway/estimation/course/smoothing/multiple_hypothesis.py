"""Multiple-hypothesis smoothing: fixed-interval estimates of a vessel with two modes.

First the Rauch–Tung–Striebel smoother runs over the record, with the noise of either mode all along. Around its
trajectory the motion is linear given the mode; there, in every stretch with a course, a forward bank of hypotheses is
combined with a backward one, row by row, and the mean of all pairs is the estimate. Two-filter smoothing of several
modes is that of R. E. Helmick, W. D. Blair and S. A. Hoffman, IEEE Trans. Information Theory 41(6), 1995; where theirs
merges all histories into one Gaussian a mode at every step, which cost a third of the accuracy of the course, this one
keeps four (see `hypotheses`).
"""

import numpy as np

from steerway.core.compiled import kernel
from steerway.estimation.course.motion.layout import DT, LOW_SPEED, PHASE, STARTS_IN, STEP_ROWS, UNDER_WAY
from steerway.estimation.course.motion.models import set_step
from steerway.estimation.course.output import write_output
from steerway.estimation.course.smoothing.backward import predict_backward, start_backward, take_aids, take_fix
from steerway.estimation.course.smoothing.forward import run_forward, start_forward
from steerway.estimation.course.smoothing.fusion import VESSEL_STATES, combine
from steerway.estimation.course.smoothing.hypotheses import MODES, empty_hypotheses, set_change_probabilities, spawn
from steerway.estimation.course.smoothing.linearised import (
    FIX,
    POSITION_RESET,
    ROW_FLAGS,
    fix_of,
    forget_position,
    linearise,
)
from steerway.estimation.course.smoothing.rauch_tung_striebel import FIRST_ROW, smooth
from steerway.estimation.course.steerageway import fold

_BLOCK = 128
"""Rows for which the forward bank is stored at a time, and computed again from the start of the block: for memory."""


def smooth_modes(record, parameters, kept, output, hypotheses):
    """Write `output` (n, OUTPUTS) of the record of `track` anew; its `kept` becomes that of the plain smoother.

    Args:
        record: (time, first, second, variance_scales, aids, geodetic) of `track`.
        hypotheses: how many of each mode, `HYPOTHESES`.
    """
    states = kept.shape[2]
    stretches = stretches_of(kept)
    filtered = np.empty((len(stretches), 2, states + 2, states))
    for i in range(len(stretches)):
        filtered[i, 0], filtered[i, 1] = kept[stretches[i, 0]], kept[stretches[i, 1]]
    smooth(record[0], record[5], parameters, FIRST_ROW, kept, output)
    modes = parameters[parameters[:, STARTS_IN] > 0.0]
    accepted = np.zeros((len(kept), ROW_FLAGS), np.bool_)
    for i in range(len(stretches)):
        first, last = stretches[i]
        smooth_stretch(record, kept, filtered[i], modes, hypotheses, accepted, first, last, output)


@kernel
def stretches_of(kept):
    """(m, 2) first and last rows of the stretches with a course."""
    n = kept.shape[2]
    ends = np.empty((len(kept), 2), np.int64)
    m = 0
    for k in range(len(kept)):
        if kept[k, n + 1, PHASE] == UNDER_WAY:
            if k == 0 or kept[k - 1, n + 1, PHASE] != UNDER_WAY:
                ends[m, 0] = k
                m += 1
            ends[m - 1, 1] = k
    return ends[:m].copy()


def smooth_stretch(record, kept, filtered, modes, hypotheses, accepted, first, last, output):
    """Write the rows from `first` to `last` anew; `filtered` (2, n + 2, n) is the filter state at either."""
    n = kept.shape[2]
    blocks = (last - first) // _BLOCK + 1
    marks = np.empty((blocks, MODES, hypotheses + 1, n + 2, n))
    stored = np.empty((_BLOCK, MODES, hypotheses, n + 2, n))
    past, future = empty_hypotheses(n, hypotheses), empty_hypotheses(n, hypotheses)
    start_forward(past, filtered[0], kept[first], modes)
    if last + 1 < len(kept) and kept[last + 1, n + 1, PHASE] == LOW_SPEED:
        start_backward(future, filtered[1], kept[last])
    marks[0] = past
    for i in range(1, blocks):
        run_forward(record, kept, modes, past, accepted, first + (i - 1) * _BLOCK, first + i * _BLOCK, stored[:0])
        marks[i] = past
    for i in range(blocks - 1, -1, -1):
        start, end = first + i * _BLOCK, min(first + (i + 1) * _BLOCK - 1, last)
        run_forward(record, kept, modes, marks[i], accepted, start, end, stored)
        run_backward(record, kept, modes, future, accepted, start, end, first, stored, output)


@kernel
def run_backward(record, kept, modes, future, accepted, start, end, first, stored, output):
    """Combine with the forward bank, `stored`, from row `end` to `start`; the backward bank goes to the row before."""
    n = kept.shape[2]
    time, aids, geodetic = record[0], record[4], record[5]
    steps, change = np.zeros((MODES, STEP_ROWS, n)), np.empty(MODES)
    both, offset, scale = np.empty((n, 2 * n)), np.empty(n), np.empty(n)
    f, q = np.empty((n, n)), np.empty((n, n))
    root, product, lower = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    hypotheses = stored.shape[2]
    roots, pairs = np.empty((MODES, hypotheses, n, n)), np.empty((MODES, hypotheses, hypotheses))
    room, mean = np.empty((VESSEL_STATES + 3, n)), np.empty((VESSEL_STATES + 2, VESSEL_STATES))
    for k in range(end, start - 1, -1):
        combine(stored[k - start], future, pairs, mean, scale, roots, product, lower, room)
        for i in range(VESSEL_STATES):
            mean[VESSEL_STATES, i] += kept[k, n, i]
            mean[VESSEL_STATES + 1, i] = kept[k, n + 1, i]
        fold(mean[VESSEL_STATES], mean[:VESSEL_STATES])
        write_output(mean, geodetic, output[k])
        if k == first:
            return
        dt = time[k] - time[k - 1]
        if k == end or dt != steps[0][DT]:
            set_change_probabilities(change, dt, modes)
            for m in range(MODES):
                set_step(steps[m], dt, modes[m])
        if dt > 0.0:
            spawn(future, change, True)
        if accepted[k, FIX]:
            take_fix(future, fix_of(record, k, kept, modes[0]), modes[0], room[0])
        if len(aids):
            take_aids(future, aids[k], kept[k, n], accepted[k], modes[0], room[0])
        for m in range(MODES):
            linearise(kept, k - 1, geodetic, steps[m], modes[m], both, f, offset, q)
            if accepted[k, POSITION_RESET]:
                forget_position(q)
            predict_backward(future[m], f, offset, q, scale, root, product, lower, room)
