"""The filter that learns its profile, with the moments noted at which it does: they depend on other threads.

A recording has them, so that a replay learns at the same rows.
"""

import ctypes
import sys
from collections.abc import Callable, Mapping
from typing import Any

from steerway.estimation.learning import LearningFilter
from steerway.estimation.vessel.inferred import InferredProfile

BEGINS, TAKES = "begins", "takes"
"""An inference begins with the rows so far; what it found is taken up."""


class RecordedLearning(LearningFilter):
    """A `LearningFilter` that reports (what, number of the row) to `note`."""

    note: Callable[[str, int], None] | None = None
    _count = 0

    def row(self, *arguments: Any, **more: Any) -> Any:
        """As of `LearningFilter.row`."""
        self._count += 1
        return super().row(*arguments, **more)

    def _infer(self, rows: Any) -> None:
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
    """Learns at the rows that a recording names: `moments` by row, of `BEGINS` and `TAKES`."""

    def __init__(self, start: InferredProfile | None, aid: tuple[str, ...], moments: Mapping[tuple[str, int], bool]):
        super().__init__(start, aid, background=False)
        self._moments = moments
        self._inferred: Any = None

    def _infer_if_due(self) -> None:
        if (BEGINS, self._count) in self._moments:
            self._infer(list(self._rows))
            self._inferred, self._found = self._found, None

    def _go_over(self) -> None:
        if (TAKES, self._count) in self._moments:
            self._found, self._inferred = self._inferred, None
            LearningFilter._go_over(self)


def _return_memory() -> None:
    """Give what an inference has freed back to the system: 4.5 MB of the heap stay resident without it."""
    if sys.platform == "linux" and (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)):  # of glibc, not of musl
        trim(0)
