"""Fixed-lag smoothing of a stream: the estimate at a fix also uses the fixes of the seconds after it.

A model of one mode is smoothed by Rauch, Tung and Striebel's recursion from the latest row back. A model of several
modes is smoothed like a whole record (`filter.smoother`): a second filter runs backwards from the latest row. For one
mode the backward filter is less accurate than the recursion while few fixes follow.
"""

from collections import deque
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.linear_algebra import symmetric
from steerway.estimation.filter import smoother
from steerway.estimation.filter.bank import loses_course, step_of, steps_in
from steerway.estimation.filter.discrete import set_steps
from steerway.estimation.filter.fuse import fuse
from steerway.estimation.filter.model import FUSED, Bank, Model, empty_bank, room_to_keep
from steerway.estimation.filter.motion import predict
from steerway.estimation.filter.rauch_tung_striebel import Room, carry, smooth_row
from steerway.estimation.filter.reversal import Reversal, reversal_of, reversed_aids
from steerway.estimation.filter.row import Rows
from steerway.estimation.filter.smoother import room_to_meet, smooth_kept
from steerway.estimation.log.course import add_unresolved, averaged, fixes_apart
from steerway.estimation.running import Running
from steerway.estimation.stream_row import HEADER, KNOWN

_NEGLIGIBLE = 1e-3
"""Weight of a structure below which it is left out. If its SOG differs by 10 m/s, the mean changes by 1 cm/s at
most."""
_SLACK = 1e-6  # s


class _Row(NamedTuple):
    """A row of the stream, and the state of the filter after it."""

    time: float
    north: float
    east: float
    excess: float
    aids: Floats  # (1 or 0, a)
    header: Floats
    banks: list[tuple[Floats, Floats, Floats]]  # x, P and probabilities of the modes, for every structure


class Lagged(NamedTuple):
    """The smoothed estimate (9,) of a row in the plane of the filter; `header` (see `stream_row`) locates the plane."""

    time: float
    header: Floats
    estimate: Floats


class FixedLag:
    """Rows of the last `lag` s. `due` returns older rows, each smoothed by all rows after it."""

    def __init__(self, lag: float):
        self.lag = lag
        self._rows: deque[_Row] = deque()
        # time, header, `fuse` of every structure, their weights
        self._ready: list[tuple[float, Floats, list[Floats], list[float]]] = []
        self._structures: tuple[Model, ...] = ()
        self._weights: Floats = np.empty(0)
        self._reversed: dict[int, tuple[Reversal, smoother.Room]] = {}
        self._before: tuple[float, float] = (np.nan, np.nan)  # time and north of the row dropped last

    def add(self, running: Running, north: float, east: float, excess: float, aids: Floats) -> None:
        """Keep a row: its measurements, and the state of the stream after it."""
        if running.set.structures is not self._structures:
            self._flush()
            self._structures, self._reversed = running.set.structures, {}
        self._weights = running.weights.copy()
        kept = [(bank.x.copy(), symmetric(bank.p), bank.probability.copy()) for bank in running.banks]
        header = running.state[:HEADER].copy()
        self._rows.append(_Row(running.elapsed, north, east, excess, aids, header, kept))

    def drop_after(self, elapsed: float) -> None:
        """Drop rows later than `elapsed` (s), to which the stream was set back."""
        while self._rows and self._rows[-1].time > elapsed:
            self._rows.pop()

    def due(self, elapsed: float, steerageway: float) -> list[Lagged]:
        """The smoothed rows at least `lag` s old at the time `elapsed` (s), oldest first; all for an infinite time."""
        while self._rows and self._rows[0].time <= elapsed - self.lag + _SLACK:
            self._smooth_first()
        found, self._ready = self._ready, []
        return [Lagged(time, header, averaged(outs, w, steerageway)[0]) for time, header, outs, w in found]

    def _flush(self) -> None:
        while self._rows:
            self._smooth_first()

    def _smooth_first(self) -> None:
        """Smooth the oldest row by the later ones, and drop it; a row before the speed is known is not smoothed."""
        rows = list(self._rows)
        first, before = self._rows.popleft(), self._before
        self._before = first.time, first.north
        if first.header[KNOWN] != 1.0:
            return
        time, north, east, excess = np.array([each[:4] for each in rows]).T.copy()
        aids = reversed_aids(np.concatenate([each.aids for each in rows]))
        record = Rows(time, north, east, excess, aids, np.empty(0, np.int64))
        apart = fixes_apart(np.append(before[0], time), np.append(before[1], north))[1:2]
        outs, weights = [], []
        for which, weight in enumerate(self._weights):
            if weight > _NEGLIGIBLE:
                outs.append(self._by_structure(which, record, rows, apart))
                weights.append(weight)
        self._ready.append((first.time, first.header, outs, (np.array(weights) / sum(weights)).tolist()))

    def _by_structure(self, which: int, record: Rows, rows: list[_Row], apart: Floats) -> Floats:
        """(1, FUSED) `fuse` of the first row by one structure."""
        model = self._structures[which]
        if len(model.modes) == 1:
            x, p = (np.concatenate([each.banks[which][part] for each in rows]) for part in (0, 1))
            out, n = np.empty((1, FUSED + 2)), model.states
            workspace = Room(*(np.empty(shape) for shape in ((n, n), (n, n), (n, n), n, n, (4, n))))
            _recur(record.time, x, p, model, empty_bank(model), workspace, out[0])
            add_unresolved(model.processes, apart, out)
            return out
        if which not in self._reversed:
            self._reversed[which] = reversal_of(model), room_to_meet(model)
        reversal, room = self._reversed[which]
        x, p, probability = rows[0].banks[which]
        kept = room_to_keep(len(record.time), model)
        kept.x[0], kept.p[0], kept.probability[0], kept.probability[1:] = x, p, probability, np.nan
        out = np.empty((len(record.time), FUSED + 2))
        smooth_kept(record, reversal, empty_bank(model), kept, room, out)
        add_unresolved(model.processes, apart, out[:1])
        return out[:1]


@kernel
def _recur(time: Floats, x: Floats, p: Floats, model: Model, bank: Bank, room: Room, out: Floats) -> None:
    """Smooth x (rows, n) and P of one mode in place from the last row back, and `fuse` the first row into `out`.

    Where the course is lost between two rows, the earlier one is not smoothed.
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
