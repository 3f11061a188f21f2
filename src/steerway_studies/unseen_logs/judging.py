"""The contestants on a log: the default estimate, causal and smoothed, and a plain EKF. The reference judges their
errors, the coverage of their intervals, and their rejected fixes.
"""

import math
from dataclasses import dataclass

import numpy as np

import steerway
from steerway.core import NORMAL_95, rms, wrap_array
from steerway.estimation import choose_profile
from steerway_studies.unseen_logs import plain_ekf
from steerway_studies.unseen_logs.recordings import JudgedLog

DEFAULT, SMOOTHED, EKF = "default", "smoothed", "plain_ekf"


@dataclass(frozen=True, eq=False)
class Reported:
    """A contestant's estimate at every fix: (n,) each, NaN where unknown. `refused`: the fixes that it rejected."""

    sog: np.ndarray
    cog: np.ndarray
    rate: np.ndarray
    sog_std: np.ndarray
    cog_std: np.ndarray
    rate_std: np.ndarray
    refused: np.ndarray


def contestants(recording: JudgedLog) -> dict[str, Reported]:
    """All contestants by name."""
    fixes, places = recording.fixes, recording.places
    profile, found = choose_profile(fixes), {}
    for name, smooth in ((DEFAULT, False), (SMOOTHED, True)):
        found[name] = of_motion(fixes.time, steerway.estimate(fixes, profile, smooth=smooth))
    said = plain_ekf.fitted(fixes.time, places).T
    found[EKF] = Reported(said[0], said[1], said[2], said[3], said[4], said[5], np.zeros(len(fixes), dtype=bool))
    return found


def of_motion(time, motion: steerway.Motion) -> Reported:
    """A Motion at the times of the fixes (n,)."""
    row = np.searchsorted(motion.time, time - 1e-4).clip(0, len(motion) - 1)
    refused = motion.to_frame()["status"].to_numpy() == "rejected"
    stds = motion.sog_std, motion.cog_std, motion.course_rate_std
    return Reported(*(each[row] for each in (motion.sog, motion.cog, motion.course_rate, *stds, refused)))


SETTLING = 20.0  # s, and
SETTLING_FIXES = 10
WAY = 0.6
"""Speed (m/s) of the reference above which course and rate are judged."""
FEWEST = 100
"""Least number of rows for which an error is computed."""
_RIGHT = 0.99


@dataclass(frozen=True)
class Verdict:
    """RMS errors (m/s, rad, rad/s), shares inside the 95 % interval; NaN if unknown or from too few rows."""

    sog: float
    cog: float
    rate: float
    sog_cover: float
    cog_cover: float
    rate_cover: float
    rows: int
    course_rows: int
    course_defined: float
    refused: int
    refused_judged: int
    refused_right: int


def judged_rows(recording: JudgedLog, said: dict[str, Reported]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) bool each, the same for every contestant: rows judged for SOG, for COG and for the rate.

    Rows after 20 s and ten fixes, where the reference, the default and the plain EKF all have a value.
    """
    time = recording.fixes.time
    sog, cog, rate = recording.reference.at(time)
    settled = (time >= time[0] + SETTLING) & (np.arange(len(time)) >= SETTLING_FIXES)
    ours, ekf = said[DEFAULT], said[EKF]
    both = settled & np.isfinite(ours.sog) & np.isfinite(ekf.sog)
    moving = both & (np.where(np.isfinite(sog), sog, ours.sog) > WAY) & np.isfinite(ours.cog)
    return both & np.isfinite(sog), moving & np.isfinite(sog) & np.isfinite(cog), moving & np.isfinite(rate)


def verdict(recording: JudgedLog, said: Reported, rows) -> Verdict:
    """Verdict on one contestant on one log; `rows` from `judged_rows`."""
    reference, time = recording.reference, recording.fixes.time
    sog, cog, rate = reference.at(time)
    sog_noise, across_noise, rate_noise = reference.noise
    with np.errstate(divide="ignore", invalid="ignore"):
        course_noise = across_noise / sog
    errors = said.sog - sog, wrap_array(said.cog - cog), said.rate - rate
    stds = said.sog_std, said.cog_std, said.rate_std
    found, covers = [], []
    for error, std, noise, there in zip(errors, stds, (sog_noise, course_noise, rate_noise), rows, strict=True):
        there = there & np.isfinite(error)
        found.append(rms(error[there]) if there.sum() >= FEWEST else math.nan)
        inside = np.abs(error) <= NORMAL_95 * np.hypot(std, noise)
        there = there & np.isfinite(std)
        covers.append(float(inside[there].mean()) if there.sum() >= FEWEST else math.nan)
    way = rows[0] & (sog > WAY)
    right, judged = right_refused(recording, said.refused)
    return Verdict(
        *found,
        *covers,
        rows=int(rows[0].sum()),
        course_rows=int(rows[1].sum()),
        course_defined=float(np.isfinite(said.cog[way]).mean()) if way.any() else math.nan,
        refused=int(said.refused.sum()),
        refused_judged=judged,
        refused_right=right,
    )


def right_refused(recording: JudgedLog, refused) -> tuple[int, int]:
    """(number that were right, number judged) of the rejected fixes, by the reference.

    A rejected fix was right if its displacement from the last used fix agrees with the reference's velocity. The limit
    of the difference is its 99 % quantile over steps between used fixes, times the root of the number of intervals.
    """
    time = recording.fixes.time
    rows = np.flatnonzero(refused)
    taken = np.flatnonzero(~refused)
    if not len(rows) or len(taken) < FEWEST:
        return 0, 0
    usual = _disagreement(recording, taken[:-1], taken[1:])
    if np.isfinite(usual).sum() < FEWEST:
        return 0, 0
    limit, interval = np.nanquantile(usual, _RIGHT), float(np.median(np.diff(np.unique(time))))
    before = np.searchsorted(taken, rows) - 1
    rows, before = rows[before >= 0], taken[before[before >= 0]]
    off = _disagreement(recording, before, rows)
    known = np.isfinite(off)
    intervals = np.maximum((time[rows] - time[before]) / interval, 1.0)
    return int((off[known] <= limit * np.sqrt(intervals[known])).sum()), int(known.sum())


def _disagreement(recording, first, last):
    """Difference (m) between the displacements of fixes and those of the reference, from `first` to `last`."""
    time, places = recording.fixes.time, recording.places
    moved = places[last] - places[first]
    north, east = recording.reference.travelled(time[first], time[last])
    if np.isfinite(north).any():
        return np.hypot(moved[:, 0] - north, moved[:, 1] - east)
    return np.abs(np.hypot(*moved.T) - recording.reference.way(time[first], time[last]))
