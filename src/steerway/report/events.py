"""Events of one vessel's log for a page: the episodes of the estimate, and times without steerageway."""

import numpy as np

from steerway.core.records import NO_COURSE, Fixes, Motion
from steerway.report.episodes import DISAGREES, GAP, REFUSED, RESTARTED, Episode, episodes_of

MOST_EVENTS = 300
"""The longest are kept."""
_LEAST_STANDSTILL = 10.0
"""s without steerageway that are listed; shorter losses are visible in the charts."""
_WORDS = {
    RESTARTED: "estimate restarted",
    GAP: "no fixes",
    DISAGREES: "velocity differs from position differences",
}


def events(fixes: Fixes, motion: Motion) -> list[tuple[float, float, str]]:
    """(start, stop, what) each, in Unix s; of one vessel."""
    found = [(each.start, each.stop, _what(each)) for each in episodes_of(fixes, motion)]
    for first, last in _runs(motion.status == NO_COURSE):
        if motion.time[last] - motion.time[first] >= _LEAST_STANDSTILL:
            found.append((motion.time[first], motion.time[last], "no steerageway: course not defined"))
    longest = sorted(found, key=lambda each: each[0] - each[1])[:MOST_EVENTS]
    return sorted((float(start), float(stop), what) for start, stop, what in longest)


def _what(episode: Episode) -> str:
    if episode.kind == REFUSED:
        return "fix rejected" if episode.rows == 1 else f"{episode.rows} fixes rejected"
    return _WORDS[episode.kind]


def _runs(chosen: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True, of (n,) bool."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    return [(int(first), int(stop) - 1) for first, stop in zip(edges[::2], edges[1::2], strict=True)]
