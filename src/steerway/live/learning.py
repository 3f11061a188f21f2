"""A filter that learns its profile in a background thread, and reports at which rows it does so.

A recording contains the numbers of these rows, so that a replay learns at the same rows.
"""

import ctypes
import sys
from collections.abc import Callable, Mapping
from typing import Any

from steerway.core.arrays import Floats
from steerway.estimation.learning import LearningFilter
from steerway.estimation.vessel.profile import Profile

BEGINS, TAKES = "begins", "takes"
"""Names of reports. `BEGINS`: an inference begins, from the rows so far. `TAKES`: the filter takes the new profile."""


class RecordedLearning(LearningFilter):
    """A `LearningFilter` that reports (`BEGINS` or `TAKES`, number of the row) to `note`."""

    note: Callable[[str, int], None] | None = None
    _count = 0

    def row(self, *arguments: Any, **more: Any) -> tuple[list[float], float, int]:
        """See `LearningFilter.row`."""
        self._count += 1
        return super().row(*arguments, **more)

    def _infer(self, rows: list[Floats]) -> None:
        super()._infer(rows)
        _return_memory()

    def _infer_if_due(self) -> None:
        due = self._due
        super()._infer_if_due()
        if self._due != due:
            self._report(BEGINS)

    def _go_over(self) -> None:
        waits = self._found is not None and not self._running.set.fading
        super()._go_over()
        if waits:
            self._report(TAKES)

    def _report(self, what: str) -> None:
        if self.note is not None:
            self.note(what, self._count)


class ReplayedLearning(RecordedLearning):
    """Learns at recorded rows. The keys of `moments` are (`BEGINS` or `TAKES`, number of the row)."""

    def __init__(self, start: Profile | None, aid: tuple[str, ...], moments: Mapping[tuple[str, int], bool]):
        super().__init__(start, aid, background=False)
        self._moments = moments
        self._inferred = self._found  # none yet, of the same type

    def _infer_if_due(self) -> None:
        if (BEGINS, self._count) in self._moments:
            self._infer(list(self._rows))
            self._inferred, self._found = self._found, None

    def _go_over(self) -> None:
        if (TAKES, self._count) in self._moments:
            self._found, self._inferred = self._inferred, None
            LearningFilter._go_over(self)


def _return_memory() -> None:
    """Give memory freed by an inference back to the system. Otherwise 4.5 MB of heap stay resident."""
    if sys.platform == "linux" and (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)):  # musl has none
        trim(0)
