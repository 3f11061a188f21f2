"""Which source is used, by what came so far: one for positions, one for each kind of aid.

Two receivers are never mixed: the distance of their antennas and of their errors would appear as motion.
"""

import math
from collections import deque
from itertools import pairwise

from steerway.live.base.rows import InputRow

_KEPT = 20  # positions of a source over which its interval is taken
_SILENT = 3.0  # intervals after which a source counts as silent
_LEAST_SILENCE = 2.0  # s, and never sooner
_QUICKER = 1.5  # times the rate of the present source at which another replaces it


class SourceChoice:
    """The source of positions, and for each column the source of that aid.

    wanted: names in order of priority, each also meaning the sources it begins ("GP" for "GP in tcp://…"). Without any,
        the first one that comes, until it is silent or another is `_QUICKER`.
    """

    def __init__(self, wanted: tuple[str, ...] = ()):
        self.names = wanted
        self.wanted = tuple(name.casefold() for name in wanted)
        self.present = ""
        self.changes = 0
        self._times: dict[str, deque] = {}
        self._last: dict[str, float] = {}
        self._aid_sources: dict[str, tuple[str, float]] = {}

    def takes(self, row: InputRow, now: float) -> bool:
        """Whether this position is used. Silence is measured by `now`, since clocks of receivers may differ."""
        rank = self._rank(row.source)
        if rank is None:
            return False
        times = self._times.setdefault(row.source, deque(maxlen=_KEPT))
        times.append(row.time)
        self._last[row.source] = now
        if row.source != self.present and self._is_better(row.source, rank, now):
            self.changes += self.present != ""
            self.present = row.source
        return row.source == self.present

    def prefer(self, source: str, now: float) -> None:
        """Take the positions of a source from now on."""
        self.changes += self.present not in ("", source)
        self.present = source
        self._times.setdefault(source, deque(maxlen=_KEPT))
        self._last[source] = now

    def gives(self, column: str, row: InputRow, now: float) -> bool:
        """Whether this source gives a column: that of the positions if it has the column, else the first."""
        source, last = self._aid_sources.get(column, ("", -math.inf))
        is_silent = abs(now - last) > _LEAST_SILENCE + _SILENT
        if row.source in (source, self.present) or is_silent:
            self._aid_sources[column] = (row.source, now)
            return True
        return False

    @property
    def interval(self) -> float:
        """Median interval of the present source, s; 0 while unknown."""
        return self._interval(self.present)

    @property
    def silence(self) -> float:
        """s without a position after which the present source counts as silent."""
        return self._silence(self.present) if self.present else _LEAST_SILENCE

    def shift(self, by: float) -> None:
        """The clock of `now` has stepped."""
        self._last = {source: last + by for source, last in self._last.items()}
        self._aid_sources = {column: (source, last + by) for column, (source, last) in self._aid_sources.items()}

    def _rank(self, source):
        """The place of a source among the wanted; None when it is not wanted."""
        if not self.wanted:
            return 0
        name = source.casefold()
        ranks = (rank for rank, each in enumerate(self.wanted) if name == each or name.startswith(f"{each} "))
        return next(ranks, None)

    def _is_better(self, source, rank, now):
        if not self.present or self._is_silent(self.present, now):
            return True
        present_rank = self._rank(self.present)
        if rank != present_rank:
            return rank < present_rank
        full = all(len(self._times[each]) == _KEPT for each in (source, self.present))
        return not self.wanted and full and self._interval(source) * _QUICKER < self._interval(self.present)

    def _is_silent(self, source, now):
        return abs(now - self._last[source]) > self._silence(source)

    def _silence(self, source):
        return max(_LEAST_SILENCE, _SILENT * self._interval(source))

    def _interval(self, source):
        """Median interval of a source, s; 0 while unknown."""
        times = self._times.get(source, ())
        intervals = sorted(later - earlier for earlier, later in pairwise(times))
        return intervals[len(intervals) // 2] if intervals else 0.0
