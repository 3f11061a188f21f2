"""Records through the filter: every vessel's fixes in, Motion out, at the fixes or at a rate, causal or smoothed."""

import math
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from steerway.core.records import Fixes, Motion
from steerway.estimation.course.motion.layout import LONGEST_STEP, STEP_SLACK, empty_bank
from steerway.estimation.course.output import OUTPUTS
from steerway.estimation.course.smoothing.hypotheses import HYPOTHESES
from steerway.estimation.course.smoothing.multiple_hypothesis import smooth_modes
from steerway.estimation.course.smoothing.rauch_tung_striebel import FIRST_ROW, must_divide, smooth
from steerway.estimation.course.tracking import track
from steerway.estimation.log.rows import (
    LONGEST_GAP,
    distinct_rows,
    expect_rate,
    joined,
    measured_rows,
    merged,
    repeat_status,
    schedule,
    variance_scales,
    without_duplicates,
)

_SMALLEST_SHARE = 20_000
"""Rows below which a second thread costs more than it saves: some 3 ms of filtering."""


def replay(parameters, aid, fixes: Fixes, rate: float | None = None, smoothed: bool = False) -> Motion:
    """The filter of `parameters` over the fixes of any number of vessels; see `FiveStateFilter.filter`."""
    expect_rate(rate)
    fixes = measured_rows(fixes, aid)
    if rate is not None:
        fixes = distinct_rows(fixes, aid)
    if rate is None and not smoothed:
        return run_rows(parameters, aid, fixes).motion(fixes.time, fixes.mmsi, fixes.has_position)
    tracks = [_scheduled(parameters, aid, each, rate, smoothed) for _, each in fixes.tracks()]
    return joined(tracks)


class TrackOutput:
    """What `track` fills, n rows."""

    def __init__(self, n):
        self.estimate = np.empty((n, OUTPUTS))
        self.nis = np.empty(n)
        self.nll = np.empty(n)
        self.aid_nll = np.empty(n)
        self.status = np.empty(n, np.uint8)

    def arrays(self, rows=slice(None)) -> tuple[np.ndarray, ...]:
        """All as `track` takes it, or some rows."""
        return self.estimate[rows], self.nis[rows], self.nll[rows], self.aid_nll[rows], self.status[rows]

    def motion(self, time, mmsi, chosen) -> Motion:
        """The rows `chosen`."""
        columns = self.estimate[chosen].T
        names = ("latitude", "longitude", "sog", "cog", "course_rate", "sog_std", "cog_std", "course_rate_std")
        return Motion(
            time=time[chosen],
            **dict(zip(names, columns, strict=False)),
            nis=self.nis[chosen],
            status=self.status[chosen],
            position_std=columns[8],
            mmsi=None if mmsi is None else mmsi[chosen],
        )


def run_rows(parameters, aid, fixes: Fixes) -> TrackOutput:
    """The filter over every row of every vessel in one pass, on as many threads as there is work for."""
    n = len(fixes)
    output = TrackOutput(n)
    (latitude, longitude, aids), scales = without_duplicates(fixes, aid), variance_scales(fixes)
    bounds = np.array([0, n]) if fixes.mmsi is None else np.r_[0, np.flatnonzero(np.diff(fixes.mmsi)) + 1, n]
    shares = min(len(bounds) - 1, os.cpu_count() or 1, n // _SMALLEST_SHARE + 1)
    cuts = np.linspace(0, len(bounds) - 1, max(shares, 1) + 1).astype(int)

    def work(i):
        rows = slice(bounds[cuts[i]], bounds[cuts[i + 1]])
        run_track(
            bounds[cuts[i] : cuts[i + 1] + 1] - rows.start,
            (fixes.time[rows], latitude[rows], longitude[rows], scales[rows], aids[rows], True),
            parameters,
            empty_bank(parameters),
            output.arrays(rows),
        )

    if shares <= 1:
        work(0)
    else:
        with ThreadPoolExecutor(shares) as pool:
            list(pool.map(work, range(shares)))
    if latitude is not fixes.latitude:
        repeat_status(output.status, fixes.has_position & np.isnan(latitude))
    return output


def run_track(bounds, record, parameters, bank, arrays, kept=None) -> None:
    """`track` on a record (time, first, second, variance_scales, aids, geodetic); `kept` None keeps nothing."""
    track(bounds, *record, parameters, bank, *arrays, room_to_keep(bank, 0) if kept is None else kept)


def kept_rows(parameters, aid, fixes: Fixes, last: bool = False) -> np.ndarray:
    """(n, states + 2, states) covariance, state and flags after every row of one vessel, or after the last."""
    bank, n = empty_bank(parameters), len(fixes)
    kept = room_to_keep(bank, 0 if last else n)
    latitude, longitude, aids = without_duplicates(fixes, aid)
    record = (fixes.time, latitude, longitude, variance_scales(fixes), aids, True)
    run_track(np.array([0, n]), record, parameters, bank, TrackOutput(n).arrays(), kept)
    return bank[:1, : kept.shape[1]] if last else kept


def _scheduled(parameters, aid, fixes: Fixes, rate, smoothed) -> Motion:
    """One vessel with output times of its own or smoothed: rows without a fix are added where they are needed."""
    several = len(parameters) > 1
    longest = parameters[0, LONGEST_STEP]
    rows = schedule(fixes, rate)
    if smoothed and several:
        rows = merged(*rows, _fillers(rows[0], longest), False)
    record, output, kept = _run_schedule(parameters, aid, fixes, rows, smoothed)
    if smoothed and several:
        smooth_modes(record, parameters, kept, output.estimate, HYPOTHESES)
    elif smoothed:
        divide = must_divide(record[0], parameters[0], kept)
        if divide.any():
            rows = merged(*rows, _fillers(record[0], longest, divide[:-1]), False)
            record, output, kept = _run_schedule(parameters, aid, fixes, rows, smoothed)
        smooth(record[0], True, parameters, FIRST_ROW, kept, output.estimate)
    time, origin, wanted = rows
    repeat_status(output.status, fixes.has_position[origin] & (origin >= 0) & np.isnan(record[1]))
    mmsi = None if fixes.mmsi is None else np.full(len(time), fixes.mmsi[0] if len(fixes) else 0)
    return output.motion(time, mmsi, wanted)


def _run_schedule(parameters, aid, fixes, rows, keep):
    """The filter over the rows of `schedule`: its record, what it gave, and what the smoother needs of it."""
    time, origin, _ = rows
    blank = origin < 0
    (first, second, aids), scales = without_duplicates(fixes, aid), variance_scales(fixes)
    first, second = first[origin], second[origin]
    first[blank] = second[blank] = np.nan
    if len(scales):
        scales = scales[origin]
    if aid:
        aids = aids[origin]
        aids[blank] = np.nan
    record = (time, first, second, scales, aids, True)
    bank, output = empty_bank(parameters), TrackOutput(len(time))
    kept = room_to_keep(bank, len(time) if keep else 0)
    run_track(np.array([0, len(time)]), record, parameters, bank, output.arrays(), kept)
    return record, output, kept


def room_to_keep(bank, rows) -> np.ndarray:
    """Where `track` keeps what the smoother needs of a filter."""
    states = bank.shape[-1]
    return np.empty((rows, states + 2, states))


def _fillers(time, longest, chosen=True):
    """Times that divide the `chosen` intervals, of those the smoother can cross, into steps of at most `longest`."""
    gaps = np.diff(time)
    long = np.flatnonzero((gaps > longest * (1.0 + STEP_SLACK)) & (gaps <= LONGEST_GAP) & chosen)
    pieces = [np.linspace(time[i], time[i + 1], math.ceil(gaps[i] / longest - STEP_SLACK) + 1)[1:-1] for i in long]
    return np.concatenate(pieces) if pieces else np.empty(0)
