"""LearningFilter: a filter that starts from a broad prior and infers vessel and receiver while it runs.

A window keeps the latest fixes. The inference of `estimate` runs on the window from time to time, in the background.
The estimate then blends to the new structures, without a jump, over some seconds (`running.FADE`).
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.gaps import LONGEST_GAP
from steerway.estimation.filter.model import Bank, Model, empty_bank
from steerway.estimation.filter.row import Rows, outputs, run_record
from steerway.estimation.fit.auto_aids import AUTO, VELOCITY, velocity_in
from steerway.estimation.fit.selection import infer
from steerway.estimation.log.digits import quantum_of
from steerway.estimation.log.record import Measurements, extrapolated, measurements
from steerway.estimation.running import Set, set_of
from steerway.estimation.stream import FiveStateFilter
from steerway.estimation.stream_row import LATITUDE, LONGITUDE
from steerway.estimation.vessel.aids import AIDS
from steerway.estimation.vessel.profile import Profile, prior_profile
from steerway.estimation.vessel.structures import Structure

LOG = logging.getLogger("steerway.live")
_WINDOW, _ROWS = 1200.0, 12_000
"""Bounds of the window: length, s, and number of rows (20 minutes at 10 Hz, or eight times `selection.MANY`)."""
_FIRST, _FEWEST = 60.0, 100
"""Least time, s, and least number of fixes before the first inference: about the least that `tune` needs."""
_LATER, _LATEST = 2.0, 600.0
"""Ratio of the times of successive inferences, and longest time between two, s: half the length of the window."""
_UNKNOWN = float("nan")
_NO_FIX = (_UNKNOWN, _UNKNOWN, 1.0)
_AIDS = 6
"""Columns of the window before the aids: time, position in the plane (2), excess, latitude and longitude."""


class LearningFilter(FiveStateFilter):
    """A `FiveStateFilter` that infers its profile while it runs.

    Args:
        start: first profile, None for the prior.
        aid: as for `FiveStateFilter`; "auto" uses the receiver's SOG and COG where they predict the fixes better.
        background: whether inferences run in a thread; otherwise (in a replay) a row waits for a due inference.
        keep: called with every inferred profile, in the thread of the inference.
    """

    def __init__(
        self,
        start: Profile | None = None,
        aid: tuple[str, ...] = (),
        background: bool = True,
        keep: Callable[[Profile], None] | None = None,
    ):
        self._auto = AUTO in aid
        used = tuple(each for each in aid if each != AUTO) + (VELOCITY if self._auto else ())
        super().__init__(start or prior_profile(), tuple(dict.fromkeys(used)), learns=start is None)
        self.background, self.keep = background, keep
        self.learned = start
        self._rows: deque[Floats] = deque(maxlen=_ROWS)
        self._due = _FIRST
        self._thread: threading.Thread | None = None
        self._found: tuple[Set, list[Bank], float, Measurements | None] | None = None
        self._measurements: Measurements | None = None

    def reset(self) -> None:
        """Return to the state before the first fix; the inferred profile stays."""
        super().reset()
        self._rows.clear()
        self._found, self._due, self._measurements = None, _FIRST, None

    def restore(self, snapshot: tuple[Set, Floats]) -> None:
        """Return to the state of a `snapshot`."""
        super().restore(snapshot)
        while self._rows and self._rows[-1][0] > self._running.elapsed:
            self._rows.pop()

    def row(
        self,
        dt: float,
        latitude: float = _UNKNOWN,
        longitude: float = _UNKNOWN,
        aids: Sequence[float] | Floats | None = None,
        position_std: float = _UNKNOWN,
    ) -> tuple[list[float], float, int]:
        """See `FiveStateFilter.row`."""
        if dt > LONGEST_GAP:
            self._rows.clear()
            self._measurements = None
        self._go_over()
        found = super().row(dt, latitude, longitude, aids, position_std)
        self._infer_if_due()
        return found

    def _advance(self, dt: float, first: float, second: float, excess: float, aids: Floats) -> None:
        measured = self._measured(self._running.elapsed + dt, first)
        super()._advance(dt, measured, second, excess, aids)
        if np.isfinite(first) or len(aids):
            given = aids[0] if len(aids) else _UNKNOWN
            place = self._running.state[[LATITUDE, LONGITUDE]] if self._geodetic and np.isfinite(first) else _UNKNOWN
            self._rows.append(_row(self._running.elapsed, (first, second, excess), given, place))
            while self._rows[0][0] < self._running.elapsed - _WINDOW:
                self._rows.popleft()

    def _measured(self, time: float, first: float) -> float:
        """The first coordinate of a fix; NaN for a fix that the receiver extrapolated."""
        if self._measurements is None or not np.isfinite(first):
            return first
        if not self._measurements.include(time):
            return _UNKNOWN
        self._measurements = self._measurements._replace(last=time)
        return first

    def _infer_if_due(self) -> None:
        elapsed = self._running.elapsed
        if self._thread is not None or self._found is not None or elapsed < self._due or len(self._rows) < _FEWEST:
            return
        self._due = min(_LATER * elapsed, elapsed + _LATEST)
        rows = list(self._rows)
        if not self.background:
            self._infer(rows)
            return
        self._thread = threading.Thread(target=self._infer, args=(rows,), daemon=True, name="inference")
        self._thread.start()

    def _infer(self, rows: list[Floats]) -> None:
        try:
            record, when = _record(rows)
            known = [name for name, column in zip(AIDS, record.aids.T, strict=False) if np.isfinite(column).any()]
            structures = self._structures(record, [name for name in known if name in self.aid])
            running, banks = set_of(structures), []
            for each in running.structures:
                banks.append(empty_bank(each))
                _run(record, each, banks[-1])
            self.learned = Profile.of(structures, "learned")
            if self.keep is not None:
                self.keep(self.learned)
            self._found = running, banks, rows[-1][0], when
        except Exception:  # the filter goes on with its present structures
            LOG.exception("the inference of vessel and receiver failed; the filter keeps its profile")
        finally:
            self._thread = None

    def _structures(self, record: Rows, aids: list[str]) -> tuple[Structure, ...]:
        if not self._auto:
            return infer(record, aids).structures
        structures = infer(record, [name for name in aids if name not in VELOCITY]).structures
        return infer(record, aids).structures if velocity_in(record, structures) else structures

    def _go_over(self) -> None:
        """Switch to the inferred structures, after running them over the fixes that came during the inference."""
        if self._found is None or self._running.set.fading:
            return
        (running, banks, until, self._measurements), self._found = self._found, None
        since = [each.copy() for each in self._rows if each[0] > until]
        for each in since:
            each[1] = self._measured(each[0], each[1])
        record = _columns([_row(until), *since, _row(self._running.elapsed)])
        for model, bank in zip(running.structures, banks, strict=True):
            _run(record, model, bank)
        self._running.take_up(running, banks)


def _run(record: Rows, model: Model, bank: Bank) -> None:
    """Filter a record with one model; its bank continues from its state, or starts."""
    run_record(record, model, bank, outputs(model))


def _row(
    time: float, fix: Sequence[float] = _NO_FIX, aids: float | Floats = _UNKNOWN, place: float | Floats = _UNKNOWN
) -> Floats:
    """A row of the window, in one array to save memory. fix: position in the plane and excess. place: (2,) rad."""
    row = np.empty(_AIDS + len(AIDS))
    row[:4], row[4:_AIDS], row[_AIDS:] = (time, *fix), place, aids
    return row


def _columns(rows: Sequence[Floats]) -> Rows:
    """The rows of a window as a record."""
    table = np.array(rows)
    aids = table[:, _AIDS:].copy()
    if not np.isfinite(aids).any():
        aids = np.empty((0, len(AIDS)))
    time, north, east, excess = table[:, :4].T.copy()
    return Rows(time, north, east, excess, aids, np.empty(0, np.int64))


def _record(rows: Sequence[Floats]) -> tuple[Rows, Measurements | None]:
    """The measured fixes of a window as a record in the plane of the filter, and when the receiver measures.

    Fixes that the receiver extrapolated are NaN.
    """
    record = _columns(rows)
    time, north, east, *_ = record
    fixed = np.flatnonzero(np.isfinite(north))
    guessed = extrapolated(time[fixed], north[fixed], east[fixed])
    north[fixed[guessed]] = _UNKNOWN
    latitude, longitude = np.array([each[4:_AIDS] for each in rows])[fixed].T
    quantum = quantum_of(time[fixed], latitude, longitude)
    return record._replace(quantum=quantum), measurements(time[fixed], guessed)
