"""Estimate Motion from Fixes, by a profile or by the structures that are inferred from the record."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap_array
from steerway.core.arrays import Bools, Floats
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import NO_COURSE, OK, PREDICTED, REJECTED, STARTING, Fixes, Motion
from steerway.core.slow_error import position_std, slow_std
from steerway.estimation.filter.model import FUSED, Kept, Model, bank_in, bank_size, room_to_keep
from steerway.estimation.filter.row import Asked, Rows
from steerway.estimation.fit.selection import Inference, infer
from steerway.estimation.log.copies import without_copies
from steerway.estimation.log.course import (
    COG,
    POSITION_STD,
    RATE,
    SOG,
    SOG_STD,
    STEERAGEWAY,
    averaged,
    fixes_apart,
    least_course_speed,
    run_model,
    smoothed_rows,
)
from steerway.estimation.log.digits import ends_of_repeats, quantum_of
from steerway.estimation.log.outage import doubt_slides
from steerway.estimation.log.plane import LONG_STEP, Plane, laid_out, placed, steps_between
from steerway.estimation.log.record import (
    LONG,
    extrapolated,
    of_other_receiver,
    part_of,
    predictions,
    usual_interval,
)
from steerway.estimation.log.rows import (
    distinct_rows,
    expect_rate,
    joined,
    measured_rows,
    repeat_status,
    schedule,
    variance_scales,
    without_duplicates,
)
from steerway.estimation.log.stamps import regular_times
from steerway.estimation.vessel.aids import AIDS, expect_aids
from steerway.estimation.vessel.flat import Weighed
from steerway.estimation.vessel.parts import PLAIN
from steerway.estimation.vessel.profile import Profile
from steerway.estimation.vessel.structures import Structure, medians_of

UNKNOWN_SPEED = 3.0
"""Largest 1σ, m/s, of a speed that is output after a start: about a third of the prior 1σ, `bank.START_SPEED_STD`."""
_BLOCK, _OVERLAP = 20_000, 2_000
"""Number of predictions in a block, which bounds the memory; and number of predictions after the block from which the
smoother starts. These are minutes, long enough to forget every motion."""
_NONE = np.empty(0)


def infer_log(fixes: Fixes, aid: tuple[str, ...] = ()) -> Inference:
    """The structures inferred from a vessel's record; for fixes at one time the plain structure with prior medians.

    Raises InputError for an unknown aid.
    """
    expect_aids(aid)
    track = Track(fixes, aid)
    known = [name for name in aid if np.isfinite(getattr(track.fixes, name)).any()]
    if usual_interval(track.record.time[np.isfinite(track.record.north)]) > 0.0:
        return infer(track.record, known)
    parts = (*PLAIN, *known)
    values, quantum = medians_of(parts), track.record.quantum
    return Inference((Structure(weight=1.0, parts=parts, values=values, quantum=quantum),), ())


def motion_of(
    fixes: Fixes,
    profile: Profile,
    aid: tuple[str, ...] = (),
    rate: float | None = None,
    smooth: bool = False,
) -> Motion:
    """The motion of every vessel by a profile: a row per fix, or `rate` rows a second.

    Raises InputError for a rate outside 1e-6 to 1000 Hz and for an unknown aid.
    """
    expect_rate(rate)
    expect_aids(aid)
    structures = profile.models(aid, smooth)
    tracks = (Track(each, aid, rate, bool(profile.structures)) for _, each in fixes.tracks())
    return joined([motion_of_track(track, structures, smooth, profile.steerageway) for track in tracks])


def motion_of_track(
    track: "Track", structures: Sequence[Weighed], smooth: bool = False, steerageway: float = STEERAGEWAY
) -> Motion:
    """The motion of one vessel by weighted structures."""
    fixes = track.fixes
    wanted, record = track.wanted, track.record
    least = least_course_speed(structures, steerageway)
    causal, estimate, nis, wrong = estimated(record, structures, least, smooth)
    starting = _starting(estimate, record)
    fixed = np.isfinite(record.north)
    for each in (causal, estimate) if estimate is not causal else (causal,):
        doubt_slides(record.time, fixed, causal, each)
    track.pass_over_far_fixes(estimate)
    latitude, longitude = track.places(estimate)
    cog = wrap_array(estimate[:, COG] + track.azimuth)
    status = np.select(
        [starting, wrong > 0.5, np.isnan(cog), np.isnan(record.north)],
        [STARTING, REJECTED, NO_COURSE, PREDICTED],
        OK,
    ).astype(np.uint8)
    repeat_status(status, track.repeats)
    estimate[starting, SOG:POSITION_STD] = np.nan
    deviations = estimate[:, SOG_STD:].T
    mmsi = None if fixes.mmsi is None else np.full(int(wanted.sum()), fixes.mmsi[0] if len(fixes) else 0)
    return Motion(
        time=track.time[wanted],
        latitude=latitude[wanted],
        longitude=longitude[wanted],
        sog=estimate[wanted, SOG],
        cog=np.where(starting, np.nan, cog)[wanted],
        course_rate=estimate[wanted, RATE],
        sog_std=deviations[0, wanted],
        cog_std=deviations[1, wanted],
        course_rate_std=deviations[2, wanted],
        position_std=position_std(deviations[3], track.slow)[wanted],
        position_relative_std=deviations[3, wanted],
        nis=nis[wanted],
        status=status[wanted],
        mmsi=mmsi,
    )


class Track:
    """A vessel's rows as a `record` in a plane, and the way back to latitude and longitude.

    time, wanted: (n,) time of every row (Unix s), and whether it is output.
    extrapolated, of_other_receiver: numbers of fixes left out as extrapolated and as those of another receiver (see
        `log.record`).
    recognises: whether the whole record is searched for copies of fixes, extrapolated fixes, fixes of another receiver
        and irregular stamps. Otherwise (flat numbers of a profile) every fix is used as it is.
    slow: (n,) 1σ (m) of the receiver's slow error at every row, see `core.slow_error`.
    repeats: (n,) bool, rows that duplicate the row before and have its status.
    regular: whether regular times replace the stamps of the fixes, see `stamps.regular_times`.
    """

    def __init__(self, fixes: Fixes, aid: tuple[str, ...], rate: float | None = None, recognises: bool = True) -> None:
        fixes = fixes.rows(np.isfinite(fixes.time))
        self.fixes = fixes = measured_rows(fixes, aid)
        if rate is not None:
            self.fixes = fixes = distinct_rows(fixes, aid)
        latitude, longitude, aids = without_duplicates(fixes, aid)
        fixed = np.isfinite(latitude) & np.isfinite(longitude)
        self._plane = _plane_of(latitude[fixed], longitude[fixed])
        first, second = np.full(len(fixes), np.nan), np.full(len(fixes), np.nan)
        first[fixed], second[fixed] = self._plane.first, self._plane.second
        stamps = fixes.time
        measured = regular_times(stamps[fixed], self._plane.first, self._plane.second) if recognises else None
        self.regular = measured is not None
        if measured is not None:
            fixes = replace(fixes, time=np.interp(np.arange(len(fixes)), np.flatnonzero(fixed), measured))
        self.time, origin, self.wanted = schedule(fixes, rate)
        self.extrapolated = self.of_other_receiver = 0
        quantum = quantum_of(fixes.time[fixed], latitude[fixed], longitude[fixed])
        if recognises:
            first[~_new(fixes.time, latitude, longitude, fixed, quantum)] = np.nan
            known = np.flatnonzero(np.isfinite(first))
            placed_at = fixes.time[known], first[known], second[known]
            guessed, other = extrapolated(*placed_at), of_other_receiver(*placed_at, max(quantum))
            first[known[guessed | other]] = np.nan
            self.extrapolated, self.of_other_receiver = int(guessed.sum()), int(other.sum())
        own = origin >= 0
        self.repeats = own & (fixes.has_position & ~fixed)[origin] & (not recognises)
        self._fix = (np.cumsum(fixed[origin] & own) - 1).clip(0)
        self.slow = slow_std(fixes.position_std[fixed])[self._fix] if fixed.any() else np.full(len(own), np.nan)
        table = np.where(own[:, None], aids[origin], np.nan) if len(aids) else np.empty((0, len(AIDS)))
        excess = variance_scales(fixes)
        if len(excess):
            excess = np.where(own, excess[origin], 1.0)
        first, second = np.where(own, first[origin], np.nan), np.where(own, second[origin], np.nan)
        restarts = np.flatnonzero(np.diff(self.time) > LONGEST_GAP) + 1
        self.record = Rows(self.time, first, second, excess, table, restarts, quantum)
        if rate is None:
            self.time = stamps

    def pass_over_far_fixes(self, estimate: Floats) -> None:
        """Place rows of an estimate (n, 9) by the next fix, or one before, if their own fix is an outlier far away."""
        plane = self._plane
        if len(plane.first):
            after = np.minimum(self._fix + 1, len(plane.first) - 1)
            fixes = np.stack([self._fix, plane.home[self._fix], after])
            away = np.hypot(estimate[:, 0] - plane.first[fixes], estimate[:, 1] - plane.second[fixes])
            nearest = fixes[np.argmin(away, axis=0), np.arange(len(self._fix))]
            self._fix = np.where(away[0] > LONG_STEP, nearest, self._fix)

    @property
    def azimuth(self) -> Floats:
        """(n,) direction of the plane's first axis at every row, rad east of north."""
        return self._plane.azimuth[self._fix] if len(self._plane.azimuth) else np.zeros(len(self.time))

    def places(self, estimate: Floats) -> tuple[Floats, Floats]:
        """Latitude and longitude (n,), rad, of an estimate (n, 9) in the plane; NaN in a record without fixes."""
        if not len(self._plane.first):
            return np.full(len(estimate), np.nan), np.full(len(estimate), np.nan)
        return placed(self._plane, self._fix, estimate[:, 0], estimate[:, 1])

    def place_of(self, row: int, first: float, second: float) -> tuple[float, float, float]:
        """Latitude and longitude (rad) of a point of the plane near this row, and the first axis's azimuth there."""
        fix = self._fix[row]
        latitude, longitude = placed(self._plane, np.array([fix]), np.array([first]), np.array([second]))
        return latitude[0], longitude[0], self._plane.azimuth[fix]


def _plane_of(latitude: Floats, longitude: Floats) -> Plane:
    if len(latitude):
        return laid_out(latitude, longitude)
    return Plane(latitude, longitude, _NONE, _NONE, _NONE, np.empty(0, np.int64))


def _new(time: Floats, latitude: Floats, longitude: Floats, fixed: Bools, quantum: tuple[float, float]) -> Bools:
    """(n,) bool: fixes that are not copies. If all fixes are at one place, none is a copy: the vessel is at rest."""
    new = fixed.copy()
    if fixed.sum() > 1:
        north, east, _ = steps_between(latitude[fixed], longitude[fixed])
        if north.any() or east.any():
            north, east = (np.append(0.0, np.cumsum(each)) for each in (north, east))
            kept, _ = without_copies(time[fixed], north, east, quantum)
            new[fixed] = np.isfinite(kept)
    return new


def _starting(estimate: Floats, record: Rows) -> Bools:
    """(n,) bool: rows after a start or a long gap until the speed is known."""
    known = estimate[:, SOG_STD] < UNKNOWN_SPEED
    starting = np.zeros(len(known), bool)
    fixes = np.flatnonzero(np.isfinite(record.north))
    behind_gaps = fixes[1:][np.diff(record.time[fixes]) > LONG]
    bounds = [0, *np.union1d(record.restarts, behind_gaps).tolist(), len(known)]
    for begin, end in pairwise(bounds):
        first = int(np.argmax(known[begin:end])) if known[begin:end].any() else end - begin
        starting[begin : begin + first] = True
    return starting


class Estimated(NamedTuple):
    """Estimates (columns of `log.course`) of the rows of a record by weighted structures."""

    causal: Floats  # (n, 9), from the rows up to each
    smoothed: Floats  # (n, 9), from all rows; the causal one without `smooth`
    nis: Floats  # (n,)
    wrong: Floats  # (n,) probability of an outlier


def estimated(record: Rows, structures: Sequence[Weighed], least_speed: float, smooth: bool = False) -> Estimated:
    """The estimates of every row. To smooth rounded fixes, a second run leaves out most of their repeats."""
    if smooth and any(record.quantum):
        thinned = record._replace(north=ends_of_repeats(record.time, record.north, record.east))
        return _in_blocks(record, structures, least_speed)._replace(
            smoothed=_in_blocks(thinned, structures, least_speed, True).smoothed
        )
    return _in_blocks(record, structures, least_speed, smooth)


def _in_blocks(record: Rows, structures: Sequence[Weighed], least_speed: float, smooth: bool = False) -> Estimated:
    """`estimated` block by block: each filter continues from its state at the end of the block before."""
    n = len(record.time)
    causal, nis, wrong = np.empty((n, 9)), np.empty(n), np.empty(n)
    smoothed = np.empty((n, 9)) if smooth else causal
    models, weights = [each.model for each in structures], [each.weight for each in structures]
    memories = [np.zeros(bank_size(len(model.modes), model.states)) for model in models]
    apart, steps = fixes_apart(record.time, record.north), np.append(0, np.cumsum(predictions(record)))
    end = 0
    while end < n:
        begin = end
        end, last = np.searchsorted(steps, steps[begin] + np.array([_BLOCK, _BLOCK + _OVERLAP])).clip(begin + 1, n)
        part = _going_on(record, begin, last if smooth else end)
        before = begin - 1 if begin else 0
        rows, own = slice(begin, end), slice(begin - before, end - before)
        filtered, whole = [], []
        for model, memory in zip(models, memories, strict=True):
            out, kept = _filtered(part, model, memory, end - before, smooth)
            filtered.append(out[own])
            if smooth:
                whole.append(smoothed_rows(part, model, kept, apart[before:last])[own])
        causal[rows] = averaged(filtered, weights, least_speed)
        nis[rows], wrong[rows] = (
            sum(w * out[:, k] for w, out in zip(weights, filtered, strict=True)) for k in (-2, -1)
        )
        if smooth:
            smoothed[rows] = averaged(whole, weights, least_speed)
    return Estimated(causal, smoothed, nis, wrong)


def _going_on(record: Rows, begin: int, end: int) -> Rows:
    """The rows from `begin` to before `end`, preceded by a row without measurements, from which a filter continues."""
    part = part_of(record, max(begin - 1, 0), end)
    if begin:
        part.north[0] = np.nan
        part.aids[:1] = np.nan
    return part


def _filtered(part: Rows, model: Model, memory: Floats, end: int, keep: bool) -> tuple[Floats, Kept]:
    """`fuse`, NIS and outlier probability of the rows before `end`, and, if `keep`, the modes after all rows.

    memory: the filter's bank, advanced to `end`. The rows from `end` on are filtered only to keep modes.
    """
    shape, n = (len(model.modes), model.states), len(part.time)
    out, kept = np.empty((end, FUSED + 2)), room_to_keep(n if keep else 0, model)
    run_model(part_of(part, 0, end), model, bank_in(memory, *shape), Asked(out, _NONE, kept, 0))
    if keep and end < n:
        further = Kept(*(each[end - 1 :] for each in kept))
        run_model(_going_on(part, end, n), model, bank_in(memory.copy(), *shape), Asked(out[:0], _NONE, further, 0))
    return out, kept
