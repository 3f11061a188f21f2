"""Chooses one source for positions and one for each kind of aid, from the rows so far.

Two receivers are never mixed: the difference of their antenna positions and errors would look like motion.
"""

import math
from collections import defaultdict, deque
from collections.abc import Callable
from functools import partial
from itertools import pairwise

from steerway.core.records import INSTRUMENT_COLUMNS
from steerway.formats.sources import OWN_SHARE, rank
from steerway.live.rows import InputRow

_KEPT = 20  # number of newest rows that give the median interval of a source
_SILENT = 3.0  # intervals after which a source counts as silent
_LEAST_SILENCE = 2.0  # shortest time after which a source counts as silent, s
_QUICKER = 1.5  # least ratio of rates at which a quicker source replaces the present one
_JITTER = 1.1  # two intervals count as equal up to this ratio


class _Choice:
    """Chooses among sources by rank, then by rate; a silent source is replaced."""

    def __init__(self) -> None:
        self.present = ""
        self.times: dict[str, deque[float]] = {}
        self.last: dict[str, float] = {}

    def add(self, source: str, time: float, now: float) -> None:
        """Note a row of a source; `time` is the row's own time, `now` the present (s)."""
        self.times.setdefault(source, deque(maxlen=_KEPT)).append(time)
        self.last[source] = now

    def is_better(self, source: str, rank_of: Callable[[str], float], by_rate: bool, now: float) -> bool:
        """Whether to change from the present source to this one."""
        if not self.present or abs(now - self.last[self.present]) > self.silence(self.present):
            return True
        place, present_place = rank_of(source), rank_of(self.present)
        if place != present_place:
            return place < present_place
        full = all(len(self.times[each]) == _KEPT for each in (source, self.present))
        return by_rate and full and self.interval(source) * _QUICKER < self.interval(self.present)

    def silence(self, source: str) -> float:
        """Time without a row after which a source counts as silent, s."""
        return max(_LEAST_SILENCE, _SILENT * self.interval(source))

    def interval(self, source: str) -> float:
        """Median interval of a source, s; 0 while unknown."""
        times = self.times.get(source, ())
        intervals = sorted(later - earlier for earlier, later in pairwise(times))
        return intervals[len(intervals) // 2] if intervals else 0.0


class SourceChoice:
    """The source of positions, and the source of each aid.

    wanted: names in order of priority, as in `formats.sources.rank`. Without names the first source is used until it is
        silent or another one has more than `_QUICKER` times its rate. As in a log, an aid comes from the source of
        positions if that reports it at half of its fixes or more. Otherwise the aid's source is chosen like a source of
        positions without `wanted`. SOG and COG never come from another receiver.
    """

    def __init__(self, wanted: tuple[str, ...] = ()):
        self.names = wanted
        self._positions = _Choice()
        self._aids: defaultdict[str, _Choice] = defaultdict(_Choice)

    @property
    def present(self) -> str:
        """The source of positions; "" before the first."""
        return self._positions.present

    def uses_position(self, row: InputRow, now: float) -> bool:
        """Whether a row's position is used. Silence is measured by `now`, because receivers' clocks may differ."""
        self._positions.add(row.source, row.time, now)
        if rank(row.source, self.names) is None:
            return False
        if row.source != self.present and self._positions.is_better(row.source, self._rank, not self.names, now):
            self._positions.present = row.source
        return row.source == self.present

    def prefer(self, source: str, now: float) -> None:
        """Use the positions of a source from now on."""
        self._positions.present = source
        self._positions.times.setdefault(source, deque(maxlen=_KEPT))
        self._positions.last[source] = now

    def uses_aid(self, column: str, row: InputRow, now: float) -> bool:
        """Whether the aid `column` is used from this row's source."""
        if column not in INSTRUMENT_COLUMNS and row.source != self.present and row.source in self._positions.times:
            return False
        choice = self._aids[column]
        choice.add(row.source, row.time, now)
        if row.source != choice.present and choice.is_better(row.source, partial(self._is_other, choice), True, now):
            choice.present = row.source
        return row.source == choice.present

    @property
    def interval(self) -> float:
        """Median interval of the present source, s; 0 while unknown."""
        return self._positions.interval(self.present)

    @property
    def silence(self) -> float:
        """Time without a position after which the present source counts as silent, s."""
        return self._positions.silence(self.present) if self.present else _LEAST_SILENCE

    def shift(self, by: float) -> None:
        """Add a clock correction to all stored times."""
        for choice in (self._positions, *self._aids.values()):
            choice.last = {source: last + by for source, last in choice.last.items()}

    def _is_other(self, choice: _Choice, source: str) -> bool:
        """Rank of a source for an aid: 0 for the source of positions if it reports the aid often enough, else 1."""
        is_rare = OWN_SHARE * choice.interval(source) > _JITTER * self.interval > 0.0
        return source != self.present or is_rare

    def _rank(self, source: str) -> float:
        place = rank(source, self.names)
        return math.inf if place is None else place
