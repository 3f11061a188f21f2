"""Episodes: intervals in which an estimate refused fixes, restarted, had no fixes, or disagrees with other data."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.earth import displacement
from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent
from steerway.core.gaps import shortest_gap
from steerway.core.records import NO_COURSE, REJECTED, STARTING, Fixes, Motion
from steerway.core.statistics import DEVIATION_OF_MEDIAN
from steerway.core.timestamps import iso
from steerway.estimation.log.outage import SLIDES, outages

REFUSED, RESTARTED, GAP, DISAGREES, CONTRADICTED = "refused", "restarted", "gap", "disagrees", "contradicted"
_NO_STEERAGEWAY = "no steerageway"
_WORDS = {
    REFUSED: "fixes refused as wrong",
    RESTARTED: "the estimate restarted",
    GAP: "no fixes",
    DISAGREES: "the velocity differs from position differences by more than 5 standard deviations",
    CONTRADICTED: "the receiver's own SOG differs from the estimate by more than 5 standard deviations",
}
_SPAN = 2.0
"""Time between the two fixes of a position difference, s: it averages noise, but not manoeuvres."""
_ALLOWED, _LEAST = 5.0, 3
"""Largest difference that still agrees, in standard deviations, and fewest rows in an episode. By chance, less than one
of 100,000 rows exceeds this difference."""
_APART = 2
"""Largest step, in rows, between neighbouring rows of one episode."""
_BRIEFLY = {
    RESTARTED: "estimate restarted",
    GAP: "no fixes",
    DISAGREES: "velocity differs from position differences",
    CONTRADICTED: "receiver's own SOG differs",
    _NO_STEERAGEWAY: "no steerageway: course not defined",
}
MOST_EVENTS = 300
"""Most events on a page; the longest are kept."""
_LEAST_STANDSTILL = 10.0
"""s, shortest loss of steerageway that a page lists; shorter ones are visible in its charts."""


@dataclass(frozen=True)
class Episode:
    """An episode: kind, first and last moment (Unix s, UTC), number of rows, vessel (None: own vessel)."""

    kind: str
    start: float
    stop: float
    rows: int
    mmsi: int | None = None

    def as_dict(self) -> dict[str, object]:
        """Plain numbers and texts."""
        vessel = {} if self.mmsi is None else {"mmsi": self.mmsi}
        return vessel | {
            "kind": self.kind,
            "start": iso(round(self.start, 3)),
            "stop": iso(round(self.stop, 3)),
            "duration_s": round(self.stop - self.start, 3),
            "rows": self.rows,
            "what": _WORDS[self.kind],
        }


def episodes_of(fixes: Fixes, motion: Motion) -> list[Episode]:
    """All episodes of an estimate of these fixes, in order of vessel and time."""
    placed = {mmsi: track for mmsi, track in fixes.rows(fixes.has_position).in_order().tracks()}
    found = []
    for mmsi, track in motion.tracks():
        restarts = _runs(RESTARTED, track.time, track.status == STARTING, mmsi)
        own = _runs(REFUSED, track.time, track.status == REJECTED, mmsi)
        own += [each for each in restarts if each.start > track.time[0]]
        if mmsi in placed and len(placed[mmsi]) > 1:
            holes = gaps(placed[mmsi].time, mmsi is not None)
            own += [Episode(GAP, start, stop, 0, mmsi) for start, stop in holes]
        if mmsi is None and len(placed[mmsi]) > 1:
            own += [*_disagreements(placed[mmsi], track, mmsi), *_contradictions(placed[mmsi], track, mmsi)]
        found += sorted(own, key=lambda each: each.start)
    return found


def events(fixes: Fixes, motion: Motion) -> list[tuple[float, float, str]]:
    """(start, stop, words), in Unix s, of the events on a page of one vessel: episodes and losses of steerageway."""
    still = _runs(_NO_STEERAGEWAY, motion.time, motion.status == NO_COURSE, None)
    found = episodes_of(fixes, motion) + [each for each in still if each.stop - each.start >= _LEAST_STANDSTILL]
    longest = sorted(found, key=lambda each: each.start - each.stop)[:MOST_EVENTS]
    return sorted((each.start, each.stop, _briefly(each)) for each in longest)


def _briefly(episode: Episode) -> str:
    if episode.kind == REFUSED:
        return "fix rejected" if episode.rows == 1 else f"{episode.rows} fixes rejected"
    return _BRIEFLY[episode.kind]


def _runs(kind: str, time: Floats, marked: NDArray[np.bool_], mmsi: int | None, least: int = 1) -> list[Episode]:
    """One episode for every run of at least `least` marked rows; runs within `_APART` rows are joined."""
    rows = np.flatnonzero(marked)
    if not len(rows):
        return []
    parts = np.split(rows, np.flatnonzero(np.diff(rows) > _APART) + 1)
    return [Episode(kind, float(time[p[0]]), float(time[p[-1]]), len(p), mmsi) for p in parts if len(p) >= least]


def gaps(time: np.ndarray, reports: bool = False) -> list[tuple[float, float]]:
    """Gaps (start, stop) between the fixes or AIS reports of one vessel, as defined in `core.gaps`."""
    intervals = np.diff(time)
    wide = np.flatnonzero(intervals > shortest_gap(intervals, reports))
    return [(float(time[k]), float(time[k + 1])) for k in wide]


def _disagreements(fixes: Fixes, motion: Motion, mmsi: int | None) -> list[Episode]:
    time = fixes.time
    before = np.searchsorted(time, time - _SPAN + 1e-3, side="right") - 1
    before = np.minimum(before, np.arange(len(time)) - 1).clip(0)
    elapsed = time - time[before]
    usual = max(_SPAN, float(np.median(np.diff(time))))
    known = (elapsed > 0.0) & (elapsed < 2.0 * usual)
    if known.sum() < _LEAST:
        return []
    at = np.searchsorted(motion.time, time - 1e-4).clip(0, len(motion) - 1)
    apart = np.full((2, len(time)), np.nan)
    moved = [_moved(fixes, i, j) for i, j in zip(before[known], np.flatnonzero(known), strict=True)]
    means = _mean_velocities(motion, at[before[known]], at[known])
    apart[:, known] = np.array(moved).T / elapsed[known] - means
    if not np.isfinite(apart).any():
        return []
    spread = DEVIATION_OF_MEDIAN * float(np.nanmedian(np.abs(apart)))
    allowed = _ALLOWED * np.sqrt(spread**2 + motion.sog_std[at] ** 2)
    return _runs(DISAGREES, time, np.hypot(*apart) > allowed, mmsi, _LEAST)


def _contradictions(fixes: Fixes, motion: Motion, mmsi: int | None) -> list[Episode]:
    """Episodes in which the receiver's own SOG differs. Up to `SLIDES` s after an outage, σ is widened for a sliding
    position and would hide a difference: there, σ is limited to its median.
    """
    at = np.searchsorted(motion.time, fixes.time - 1e-4).clip(0, len(motion) - 1)
    apart, deviation = np.abs(motion.sog[at] - fixes.sog), motion.sog_std[at].copy()
    if np.isfinite(apart).sum() < _LEAST:
        return []
    usual = float(np.nanmedian(deviation))
    for k in outages(fixes.time):
        back = slice(k + 1, int(np.searchsorted(fixes.time, fixes.time[k + 1] + SLIDES)))
        deviation[back] = np.fmin(deviation[back], usual)
    spread = DEVIATION_OF_MEDIAN * float(np.nanmedian(apart))
    return _runs(CONTRADICTED, fixes.time, apart > _ALLOWED * np.hypot(spread, deviation), mmsi, _LEAST)


def _moved(fixes: Fixes, i: np.intp, j: np.intp) -> tuple[float, float]:
    return displacement(fixes.latitude[j], fixes.longitude[j], fixes.latitude[i], fixes.longitude[i])


def _mean_velocities(motion: Motion, first: NDArray[np.int64], last: NDArray[np.int64]) -> Floats:
    """(2, n) mean velocity north and east of the estimate between rows; 0 while course is undefined."""
    cog = np.where(np.isfinite(motion.cog), motion.cog, 0.0)
    sog = np.where(np.isfinite(motion.cog), motion.sog, 0.0)
    dt = np.diff(motion.time)
    found = []
    for speed in (sog * np.cos(cog), sog * np.sin(cog)):
        path = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * dt))
        found.append((path[last] - path[first]) / np.maximum(motion.time[last] - motion.time[first], 1e-9))
    return np.array(found)


def in_words(found: list[dict[str, object]]) -> str:
    """The number of episodes of each kind, in words."""
    kinds = [str(each["kind"]) for each in found]
    return ", ".join(f"{kinds.count(kind)} × {kind}" for kind in _WORDS if kind in kinds) or "none"


def expect_writable(path: str | Path) -> None:
    """Raises InputError for a path that ends in neither .csv nor .json."""
    if Path(path).suffix not in (".csv", ".json"):
        raise InputError(f"episodes {path} ends in {Path(path).suffix or 'nothing'!r}, expected .csv or .json")


def write_episodes(found: list[Episode], path: str | Path) -> None:
    """Write episodes as CSV or JSON, by the path's ending. Raises InputError for any other ending."""
    expect_writable(path)
    rows = [each.as_dict() for each in found]
    table = pl.DataFrame(rows or [Episode(GAP, 0.0, 0.0, 0).as_dict()]).head(len(rows))
    text = json.dumps(rows, indent=1) + "\n" if Path(path).suffix == ".json" else table.write_csv()
    with complete_or_absent(path) as file:
        file.write(text.encode())
