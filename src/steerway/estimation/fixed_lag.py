"""Fixed-lag smoothing of a stream: the estimate at a fix also uses the fixes of the seconds after it.

A structure of one mode is smoothed by Rauch, Tung and Striebel's recursion from the latest row back. With several modes
the state at the fix meets a filter that comes backwards from the latest one, as in a whole record (`filter.smoother`).
With one mode that is worse than the recursion while few fixes follow.
"""

from collections import deque
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.linear_algebra import symmetric
from steerway.estimation.filter import rauch_tung_striebel
from steerway.estimation.filter.bank import loses_course, step_of, steps_in
from steerway.estimation.filter.discrete import set_steps
from steerway.estimation.filter.fuse import fuse
from steerway.estimation.filter.model import FUSED, Kept, Model, empty_bank
from steerway.estimation.filter.motion import predict
from steerway.estimation.filter.rauch_tung_striebel import carry, smooth_row
from steerway.estimation.filter.reversal import reversal_of, reversed_aids
from steerway.estimation.filter.row import Rows
from steerway.estimation.filter.smoother import room_to_meet, smooth_kept
from steerway.estimation.log.course import add_unresolved, averaged, fixes_apart
from steerway.estimation.stream_row import ELAPSED, HEADER, KNOWN

_NEGLIGIBLE = 1e-3
"""Weight of a structure below which it is not smoothed. Chosen: its part of SOG is then less than a centimetre a second
where structures differ by ten."""
_SLACK = 1e-6  # s


class _Row(NamedTuple):
    """A row of the stream and what the filter made of it."""

    time: float
    north: float
    east: float
    excess: float
    aids: Floats  # (1 or 0, a)
    header: Floats
    banks: list[tuple[Floats, Floats, Floats]]  # of every structure x, P and probabilities


class Lagged(NamedTuple):
    """The smoothed estimate (9,) of a row, in the plane of the filter, of which `header` is the place then."""

    time: float
    header: Floats
    estimate: Floats


class FixedLag:
    """The rows of the last `lag` s. `due` returns those that are older, each smoothed by all rows after it."""

    def __init__(self, lag: float):
        self.lag = lag
        self._rows: deque[_Row] = deque()
        self._ready: list[tuple] = []  # time, header, `fuse` of every structure, their weights
        self._structures: tuple[Model, ...] = ()
        self._weights: Floats = np.empty(0)
        self._reversed: dict = {}
        self._before: tuple[float, float] = (np.nan, np.nan)  # time and north of the row that was dropped last

    def add(self, state: Floats, structures, banks, measured: tuple) -> None:
        """A row: the stream's state with the weights behind its header, its structures and banks, and what was
        measured (north, east, excess, aids)."""
        if structures is not self._structures:
            self._flush()
            self._structures, self._reversed = structures, {}
        self._weights = state[HEADER : HEADER + len(banks)].copy()
        kept = [(bank.x.copy(), symmetric(bank.p), bank.probability.copy()) for bank in banks]
        self._rows.append(_Row(state.item(ELAPSED), *measured, state[:HEADER].copy(), kept))

    def drop_after(self, elapsed: float) -> None:
        """Forget rows that are taken back."""
        while self._rows and self._rows[-1].time > elapsed:
            self._rows.pop()

    def due(self, elapsed: float, steerageway: float) -> list[Lagged]:
        """The smoothed rows that are `lag` s old or older by now, oldest first; all rows for an infinite time."""
        while self._rows and self._rows[0].time <= elapsed - self.lag + _SLACK:
            self._smooth_first()
        found, self._ready = self._ready, []
        return [Lagged(*row, averaged(*of, steerageway)[0]) for *row, of in found]

    def _flush(self):
        while self._rows:
            self._smooth_first()

    def _smooth_first(self):
        """Smooth the oldest row by those behind it, and drop it; a row before the speed is known is left out."""
        rows = list(self._rows)
        first, before = self._rows.popleft(), self._before
        self._before = first.time, first.north
        if first.header[KNOWN] != 1.0:
            return
        columns = np.array([each[:4] for each in rows]).T.copy()
        record = Rows(*columns, reversed_aids(np.concatenate([each.aids for each in rows])), np.empty(0, np.int64))
        apart = fixes_apart(*(np.append(one, more) for one, more in zip(before, record[:2], strict=True)))[1:2]
        outs, weights = [], []
        for which, weight in enumerate(self._weights):
            if weight > _NEGLIGIBLE:
                outs.append(self._by_structure(which, record, rows, apart))
                weights.append(weight)
        self._ready.append((first.time, first.header, (outs, np.array(weights) / sum(weights))))

    def _by_structure(self, which, record, rows, apart):
        """(1, FUSED) `fuse` of the first row by one structure."""
        model, n = self._structures[which], len(record.time)
        if len(model.modes) == 1:
            x, p = (np.concatenate([each.banks[which][part] for each in rows]) for part in (0, 1))
            out, bank = np.empty((1, FUSED + 2)), empty_bank(model)
            _recur(record.time, x, p, model, bank, _room(model.states), out[0])
            add_unresolved(model.processes, apart, out)
            return out
        if which not in self._reversed:
            self._reversed[which] = reversal_of(model), room_to_meet(model)
        reversal, room = self._reversed[which]
        x, p, probability = rows[0].banks[which]
        kept = Kept(np.empty((n, *x.shape)), np.empty((n, *p.shape)), np.full((n, len(probability)), np.nan))
        kept.x[0], kept.p[0], kept.probability[0] = x, p, probability
        out = np.empty((n, FUSED + 2))
        smooth_kept(record, reversal, empty_bank(model), kept, room, out)
        add_unresolved(model.processes, apart, out[:1])
        return out[:1]


def _room(n) -> rauch_tung_striebel.Room:
    return rauch_tung_striebel.Room(*np.empty((3, n, n)), *np.empty((2, n)), np.empty((4, n)))


@kernel
def _recur(time, x, p, model, bank, room, out):
    """Smooth x (rows, n) and P of one mode in place from the last row back, and `fuse` the first one into `out`.

    Where the course is lost from one row to the next, the later ones say nothing of it.
    """
    bank.run[0].started = 1
    for k in range(len(time) - 2, -1, -1):
        bank.x[0], bank.p[0], room.gain[:] = x[k], p[k], p[k]
        dt, known = time[k + 1] - time[k], True
        for j in range(steps_in(dt) if dt > 0.0 else 0):
            set_steps(bank, model, step_of(j, dt))
            carry(room.gain, bank, model, room)
            predict(bank.x[0], bank.p[0], bank.steps[0], bank.responses[0], model.driving, bank.rows)
            known = known and not loses_course(bank.x[0], bank.p[0])
        if known:
            smooth_row(x[k], p[k], bank.x[0], bank.p[0], x[k + 1], p[k + 1], room)
    bank.probability[0] = 1.0
    fuse(x[:1], p[:1], bank.probability, model, bank.rows[0], out)
