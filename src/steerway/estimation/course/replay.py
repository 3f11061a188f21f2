"""Records through the filter: every vessel's fixes in, Motion out, at the fixes or at a rate, causal or smoothed."""

import math
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.estimation.course import smoothing
from steerway.estimation.course.accuracy import doubts_of
from steerway.estimation.course.model import LONGEST_GAP, STEP_SLACK, empty_memory, longest_step, whole
from steerway.estimation.course.tracking import SPOKEN, track, track_many
from steerway.estimation.course.two_sided import hypotheses, smoother
from steerway.estimation.profiles import AIDS

_SMALLEST_SHARE = 20_000
"""Rows below which a second thread costs more than it saves."""


def replay(model, aid, fixes: Fixes, rate: float | None = None, smoothed: bool = False) -> Motion:
    """The filter of a parameter vector over the fixes of any number of vessels; see `FiveStateFilter.filter`."""
    if rate is not None and not 0.0 < rate <= 1000.0:
        raise InputError(f"rate is {rate}, expected Hz between 0 and 1000")
    fixes = spoken_rows(fixes, aid)
    if rate is not None:
        fixes = _without_repeats(fixes, aid)
    if rate is None and not smoothed:
        return _filtered(model, aid, fixes)
    tracks = [_scheduled(model, aid, each, rate, smoothed) for _, each in fixes.tracks()]
    return _joined(tracks)


def spoken_rows(fixes: Fixes, aid) -> Fixes:
    """Rows that say something to this filter, in order."""
    says = fixes.has_position
    for name in aid:
        says |= np.isfinite(getattr(fixes, name))
    return fixes.rows(says).in_order()


def _news(fixes: Fixes, aid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Latitude, longitude and aids of every row, NaN where the row before, of the same time and vessel, says the same.

    What is told twice is one measurement, and is taken once; what two say of one time, or one of two, are two.
    """
    latitude, longitude, aids = fixes.latitude, fixes.longitude, _aiding_table(fixes, aid)
    again = 1 + np.flatnonzero(fixes.time[1:] == fixes.time[:-1])
    if fixes.mmsi is not None:
        again = again[fixes.mmsi[again] == fixes.mmsi[again - 1]]
    if len(again):
        same = (latitude[again] == latitude[again - 1]) & (longitude[again] == longitude[again - 1])
        latitude, longitude = latitude.copy(), longitude.copy()
        latitude[again[same]] = longitude[again[same]] = np.nan
    if len(again) and aid:
        aids[again] = np.where(aids[again] == aids[again - 1], np.nan, aids[again])
    return latitude, longitude, aids


def _say_again(status, repeats) -> None:
    """A fix told twice is worth what it was worth the first time."""
    for k in np.flatnonzero(repeats):
        status[k] = status[k - 1]


def _without_repeats(fixes: Fixes, aid) -> Fixes:
    latitude, _, aids = _news(fixes, aid)
    new = np.isfinite(latitude)
    if aid:
        new |= np.isfinite(aids).any(axis=1)
    return fixes if new.all() else fixes.rows(new)


def _aiding_table(fixes: Fixes, aid) -> np.ndarray:
    if not aid:
        return np.empty((0, len(AIDS)))
    silent = np.full(len(fixes), np.nan)
    return np.column_stack([getattr(fixes, name) if name in aid else silent for name in AIDS])


def doubts(fixes: Fixes) -> np.ndarray:
    """How far to doubt every row (see `accuracy`), each vessel for herself; empty where nothing was said of it."""
    if not np.isfinite(fixes.position_std).any():
        return np.empty(0)
    tracks = (each for _, each in fixes.tracks())
    told = [np.where(each.has_position, each.position_std, np.nan) for each in tracks]
    return np.concatenate([doubts_of(np.zeros(2), each) for each in told])


class Run:
    """What `track` fills."""

    def __init__(self, n):
        self.spoken = np.empty((n, SPOKEN))
        self.nis = np.empty(n)
        self.log_determinant = np.empty(n)
        self.aid_surprise = np.empty(n)
        self.status = np.empty(n, np.uint8)

    def motion(self, time, mmsi, chosen) -> Motion:
        columns = self.spoken[chosen].T
        names = ("latitude", "longitude", "sog", "cog", "course_rate", "sog_std", "cog_std", "course_rate_std")
        said = dict(zip(names, columns, strict=False))
        return Motion(
            time=time[chosen],
            **said,
            nis=self.nis[chosen],
            status=self.status[chosen],
            position_std=columns[8],
            mmsi=None if mmsi is None else mmsi[chosen],
        )


def outputs(run, rows=slice(None)):
    """What `track` takes of it, of all rows or of some."""
    return run.spoken[rows], run.nis[rows], run.log_determinant[rows], run.aid_surprise[rows], run.status[rows]


def _filtered(model, aid, fixes: Fixes) -> Motion:
    return run_rows(model, aid, fixes).motion(fixes.time, fixes.mmsi, fixes.has_position)


def run_rows(model, aid, fixes: Fixes) -> Run:
    """The filter over every row of every vessel in one pass, on as many threads as there is work for."""
    n = len(fixes)
    run = Run(n)
    (latitude, longitude, aids), doubtful = _news(fixes, aid), doubts(fixes)
    bounds = np.array([0, n]) if fixes.mmsi is None else np.r_[0, np.flatnonzero(np.diff(fixes.mmsi)) + 1, n]
    shares = min(len(bounds) - 1, os.cpu_count() or 1, n // _SMALLEST_SHARE + 1)
    cuts = np.linspace(0, len(bounds) - 1, max(shares, 1) + 1).astype(int)

    def work(i):
        first, last = bounds[cuts[i]], bounds[cuts[i + 1]]
        rows = slice(first, last)
        track_many(
            bounds[cuts[i] : cuts[i + 1] + 1] - first,
            fixes.time[rows],
            latitude[rows],
            longitude[rows],
            doubtful[rows] if len(doubtful) else doubtful,
            aids[rows] if aid else aids,
            True,
            model,
            *outputs(run, rows),
        )

    if shares <= 1:
        work(0)
    else:
        with ThreadPoolExecutor(shares) as pool:
            list(pool.map(work, range(shares)))
    if latitude is not fixes.latitude:
        _say_again(run.status, fixes.has_position & np.isnan(latitude))
    return run


def memories(model, aid, fixes: Fixes, last: bool = False) -> np.ndarray:
    """(n, states + 2, states) covariance, state and bookkeeping after every row of one vessel, or after the last."""
    memory = empty_memory(model)
    kept = room_to_keep(memory, 0 if last else len(fixes))
    first, second, aids = _news(fixes, aid)
    track(fixes.time, first, second, doubts(fixes), aids, True, model, memory, *outputs(Run(len(fixes))), kept)
    return whole(memory)[None, : kept.shape[1]] if last else kept


def _scheduled(model, aid, fixes: Fixes, rate, smoothed) -> Motion:
    """One vessel with output times of its own or smoothed: rows without a fix are added where they are needed."""
    longest = longest_step(model if model.ndim == 1 else model[0])
    time, origin, wanted = _schedule(fixes, rate, longest if smoothed else None)
    mmsi = None if fixes.mmsi is None else np.full(len(time), fixes.mmsi[0] if len(fixes) else 0)
    blank = origin < 0
    (first, second, aids), doubtful = _news(fixes, aid), doubts(fixes)
    first, second = first[origin], second[origin]
    first[blank] = second[blank] = np.nan
    if len(doubtful):
        doubtful = doubtful[origin]
    if aid:
        aids = aids[origin]
        aids[blank] = np.nan
    memory = empty_memory(model)
    kept = room_to_keep(memory, len(time) if smoothed else 0)
    run = Run(len(time))
    track(time, first, second, doubtful, aids, True, model, memory, *outputs(run), kept)
    if smoothed and model.ndim == 2:
        smoother.smooth_modes(
            (time, first, second, doubtful, aids, True), model, kept, run.spoken, hypotheses.HYPOTHESES
        )
    elif smoothed:
        smoothing.smooth(time, True, model, kept, run.spoken)
    _say_again(run.status, fixes.has_position[origin] & ~blank & np.isnan(first))
    return run.motion(time, mmsi, wanted)


def room_to_keep(memory, rows) -> np.ndarray:
    """Where `track` keeps what the smoother needs of a filter with this memory."""
    states = memory.shape[-1]
    return np.empty((rows, states + 2, states))


def _schedule(fixes: Fixes, rate, longest):
    """Times to visit, the row of `fixes` each comes from (−1: none), and which of them go out.

    Beside those of the fixes and of the rate there are as many as steps of at most `longest` take, unless it is None.
    """
    time = fixes.time
    origin = np.arange(len(time))
    wanted = fixes.has_position
    if rate is not None and len(time):
        grid = np.arange(math.ceil(time[0] * rate), math.floor(time[-1] * rate) + 1) / rate
        before = np.searchsorted(time, grid, side="right") - 1
        after = np.minimum(before + 1, len(time) - 1)
        in_long_gap = time[after] - time[np.maximum(before, 0)] > LONGEST_GAP
        meets_before = np.abs(grid - time[np.maximum(before, 0)]) < 1e-4
        meets_after = np.abs(time[after] - grid) < 1e-4
        wanted = np.zeros(len(time), bool)
        wanted[before[meets_before]] = True
        wanted[after[meets_after]] = True
        grid = grid[~(meets_before | meets_after | in_long_gap)]
        time, origin, wanted = _merged(time, origin, wanted, grid, True)
    if longest is not None:
        time, origin, wanted = _merged(time, origin, wanted, _fillers(time, longest), False)
    return time, origin, wanted


def _fillers(time, longest):
    """Times that divide every interval the smoother can cross into steps it can take."""
    gaps = np.diff(time)
    long = np.flatnonzero((gaps > longest * (1.0 + STEP_SLACK)) & (gaps <= LONGEST_GAP))
    pieces = [np.linspace(time[i], time[i + 1], math.ceil(gaps[i] / longest - STEP_SLACK) + 1)[1:-1] for i in long]
    return np.concatenate(pieces) if pieces else np.empty(0)


def _merged(time, origin, wanted, added, added_wanted):
    """Rows and added times (with no row of their own) in one order; at equal times rows first."""
    time = np.concatenate([time, added])
    order = np.argsort(time, kind="stable")
    origin = np.concatenate([origin, np.full(len(added), -1)])
    wanted = np.concatenate([wanted, np.full(len(added), added_wanted)])
    return time[order], origin[order], wanted[order]


def _joined(tracks: list[Motion]) -> Motion:
    if len(tracks) == 1:
        return tracks[0]
    columns = {name: np.concatenate([t.columns()[name] for t in tracks]) for name in tracks[0].columns()}
    return Motion(**columns)
