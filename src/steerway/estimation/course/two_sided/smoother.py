"""Fixed-interval smoothing of a vessel that holds her course and turns by turns.

First the plain smoother of `smoothing` runs over the record, as if she were as lively as in either manner all along.
Near what it finds her motion is linear but for the manner she is in; there, in every stretch in which she has a course,
a bank of hypotheses that comes from the past meets one that comes from the future, row by row, and the mean of all
pairs is the estimate. Two directions for several modes are those of R. E. Helmick, W. D. Blair and S. A. Hoffman, IEEE
Trans. Information Theory 41(6), 1995; where theirs merge all histories into one Gaussian a mode at every step, which
cost a third of the accuracy of the course, these keep a handful (see `hypotheses`).
"""

import numpy as np

from steerway.core.compiled import kernel
from steerway.estimation.course.five_state import set_step
from steerway.estimation.course.model import ADRIFT, DT, MODE, STARTS_IN, UNDERWAY
from steerway.estimation.course.smoothing import smooth
from steerway.estimation.course.tracking import speak
from steerway.estimation.course.two_sided.deviations import BELIEFS, FIX, PLACE_LOST, fix_of, linearise, lose_place
from steerway.estimation.course.two_sided.future import foresee, recede, see_aids, see_fix
from steerway.estimation.course.two_sided.hypotheses import MANNERS, empty_bank, part, set_chances
from steerway.estimation.course.two_sided.meeting import SAID, meet
from steerway.estimation.course.two_sided.past import begin, go_on
from steerway.estimation.course.way import fold

_BLOCK = 128
"""Rows for which the bank of the past is kept at a time; it is kept at the beginning of each block, and goes anew."""


@kernel
def smooth_modes(record, models, kept, spoken, hypotheses):
    """State `spoken` (n, SPOKEN) of the record of `track` anew; its `kept` becomes what the plain smoother finds.

    Args:
        record: (time, first, second, doubts, aids, geodetic) of `track`.
        hypotheses: how many of each manner, `HYPOTHESES`.
    """
    states = kept.shape[2]
    stretches = stretches_of(kept)
    filtered = np.empty((len(stretches), 2, states + 2, states))
    for i in range(len(stretches)):
        filtered[i, 0], filtered[i, 1] = kept[stretches[i, 0]], kept[stretches[i, 1]]
    smooth(record[0], record[5], models[0], kept, spoken)
    manners = models[models[:, STARTS_IN] > 0.0]
    believed = np.zeros((len(kept), BELIEFS), np.bool_)
    for i in range(len(stretches)):
        first, last = stretches[i]
        smooth_stretch(record, kept, filtered[i], manners, hypotheses, believed, first, last, spoken)


@kernel
def stretches_of(kept):
    """(m, 2) first and last rows of the stretches in which she has a course."""
    n = kept.shape[2]
    ends = np.empty((len(kept), 2), np.int64)
    m = 0
    for k in range(len(kept)):
        if kept[k, n + 1, MODE] == UNDERWAY:
            if k == 0 or kept[k - 1, n + 1, MODE] != UNDERWAY:
                ends[m, 0] = k
                m += 1
            ends[m - 1, 1] = k
    return ends[:m].copy()


@kernel
def smooth_stretch(record, kept, filtered, manners, hypotheses, believed, first, last, spoken):
    """State anew the rows from `first` to `last`; `filtered` (2, n + 2, n) is what the filter knew at either."""
    n = kept.shape[2]
    blocks = (last - first) // _BLOCK + 1
    marks = np.empty((blocks, MANNERS, hypotheses + 1, n + 2, n))
    stored = np.empty((_BLOCK, MANNERS, hypotheses, n + 2, n))
    past, future = empty_bank(n, hypotheses), empty_bank(n, hypotheses)
    begin(past, filtered[0], kept[first], manners)
    if last + 1 < len(kept) and kept[last + 1, n + 1, MODE] == ADRIFT:
        foresee(future, filtered[1], kept[last])
    marks[0] = past
    for i in range(1, blocks):
        go_on(record, kept, manners, past, believed, first + (i - 1) * _BLOCK, first + i * _BLOCK, stored[:0])
        marks[i] = past
    for i in range(blocks - 1, -1, -1):
        start, end = first + i * _BLOCK, min(first + (i + 1) * _BLOCK - 1, last)
        go_on(record, kept, manners, marks[i], believed, start, end, stored)
        go_back(record, kept, manners, future, believed, start, end, first, stored, spoken)


@kernel
def go_back(record, kept, manners, future, believed, start, end, first, stored, spoken):
    """Meet the past, `stored`, in the rows from `end` to `start`, and take the bank of the future to the row before."""
    n = kept.shape[2]
    time, aids, geodetic = record[0], record[4], record[5]
    steps, chances = np.zeros((MANNERS, 3, n)), np.empty(MANNERS)
    f, q, offset, scale = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty(n)
    root, product, lower = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    hypotheses = stored.shape[2]
    roots, pairs = np.empty((MANNERS, hypotheses, n, n)), np.empty((MANNERS, hypotheses, hypotheses))
    room, said = np.empty((SAID + 3, n)), np.empty((SAID + 2, SAID))
    for k in range(end, start - 1, -1):
        meet(stored[k - start], future, pairs, said, scale, roots, product, lower, room)
        for i in range(SAID):
            said[SAID, i] += kept[k, n, i]
            said[SAID + 1, i] = kept[k, n + 1, i]
        fold(said[SAID], said[:SAID])
        speak(said, geodetic, spoken[k])
        if k == first:
            return
        dt = time[k] - time[k - 1]
        if k == end or dt != steps[0][DT]:
            set_chances(chances, dt, manners)
            for m in range(MANNERS):
                set_step(steps[m], dt, manners[m])
        if dt > 0.0:
            part(future, chances, True)
        if believed[k, FIX]:
            see_fix(future, fix_of(record, k, kept, manners[0]), manners[0], room[0])
        if len(aids):
            see_aids(future, aids[k], kept[k, n], believed[k], manners[0], room[0])
        for m in range(MANNERS):
            linearise(kept, k - 1, geodetic, steps[m], manners[m], f, offset, q)
            if believed[k, PLACE_LOST]:
                lose_place(q)
            recede(future[m], f, offset, q, scale, root, product, lower, room)
