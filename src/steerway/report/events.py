"""Events of a log in time order: intervals without fixes, rejected fixes, loss of steerageway."""

import numpy as np

from steerway.core.records import NO_COURSE, REJECTED, Fixes, Motion
from steerway.report.summary import gaps

MOST_EVENTS = 300
"""The longest are kept."""
_LEAST_STANDSTILL = 10.0
"""s without steerageway that are listed; shorter losses are visible in the charts."""


def events(fixes: Fixes, motion: Motion) -> list[tuple[float, float, str]]:
    """(start, stop, what) each, in Unix s; of one vessel."""
    found = [(start, stop, "no fixes") for start, stop in gaps(fixes.time[fixes.has_position])]
    for first, last in _runs(motion.status == REJECTED):
        count = last - first + 1
        found.append(
            (motion.time[first], motion.time[last], "fix rejected" if count == 1 else f"{count} fixes rejected")
        )
    for first, last in _runs(motion.status == NO_COURSE):
        if motion.time[last] - motion.time[first] >= _LEAST_STANDSTILL:
            found.append((motion.time[first], motion.time[last], "no steerageway: course not defined"))
    longest = sorted(found, key=lambda each: each[0] - each[1])[:MOST_EVENTS]
    return sorted((float(start), float(stop), what) for start, stop, what in longest)


def _runs(chosen: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True, of (n,) bool."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    return [(int(first), int(stop) - 1) for first, stop in zip(edges[::2], edges[1::2], strict=True)]
