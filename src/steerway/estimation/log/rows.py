"""Rows of a record before a filter sees them: which are measurements, which repeat others, and when output is due."""

import math

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Bools, Floats, Ints
from steerway.core.errors import InputError
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import Fixes, Motion
from steerway.estimation.log.accuracy import variance_scales_of
from steerway.estimation.vessel.aids import AIDS, NO_AIDS


def expect_rate(rate: float | None) -> None:
    """Raises InputError for an output rate that is neither None nor possible."""
    if rate is not None and not 1e-6 <= rate <= 1000.0:
        raise InputError(f"rate is {rate}, expected Hz between 1e-6 and 1000")


def measured_rows(fixes: Fixes, aid: tuple[str, ...]) -> Fixes:
    """Rows that hold a measurement for this filter, in order."""
    measured = fixes.has_position
    for name in aid:
        measured |= np.isfinite(getattr(fixes, name))
    return fixes.rows(measured).in_order()


def without_duplicates(fixes: Fixes, aid: tuple[str, ...]) -> tuple[Floats, Floats, Floats]:
    """Latitude, longitude and aids of every row, NaN where the row before, of the same time and vessel, is equal.

    A value reported twice for one time is one measurement; two values, or two times, are two.
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


def repeat_status(status: NDArray[np.uint8], repeats: Bools) -> None:
    """A duplicate has the status of the row before."""
    for k in np.flatnonzero(repeats):
        status[k] = status[k - 1]


def distinct_rows(fixes: Fixes, aid: tuple[str, ...]) -> Fixes:
    """The rows that hold something beside what the row before, of the same time and vessel, holds."""
    latitude, _, aids = without_duplicates(fixes, aid)
    new = np.isfinite(latitude)
    if aid:
        new |= np.isfinite(aids).any(axis=1)
    return fixes if new.all() else fixes.rows(new)


def _aiding_table(fixes: Fixes, aid: tuple[str, ...]) -> Floats:
    if not aid:
        return NO_AIDS
    unknown = np.full(len(fixes), np.nan)
    return np.column_stack([getattr(fixes, name) if name in aid else unknown for name in AIDS])


def variance_scales(fixes: Fixes) -> Floats:
    """(n,) of every row (see `update.reported_accuracy`), each vessel by itself; empty without reported accuracy."""
    if not np.isfinite(fixes.position_std).any():
        return np.empty(0)
    tracks = (each for _, each in fixes.tracks())
    reported = [np.where(each.has_position, each.position_std, np.nan) for each in tracks]
    return np.concatenate([variance_scales_of(np.zeros(2), each) for each in reported])


def schedule(fixes: Fixes, rate: float | None) -> tuple[Floats, Ints, Bools]:
    """Times to visit, the row of `fixes` each comes from (−1: none), and which of them go out."""
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
        time, origin, wanted = merged(time, origin, wanted, grid, True)
    return time, origin, wanted


def merged(time: Floats, origin: Ints, wanted: Bools, added: Floats, added_wanted: bool) -> tuple[Floats, Ints, Bools]:
    """Rows and added times (with no row of their own) in one order; at equal times rows first."""
    time = np.concatenate([time, added])
    order = np.argsort(time, kind="stable")
    origin = np.concatenate([origin, np.full(len(added), -1)])
    wanted = np.concatenate([wanted, np.full(len(added), added_wanted)])
    return time[order], origin[order], wanted[order]


def joined(tracks: list[Motion]) -> Motion:
    """The motions of several vessels in one."""
    if len(tracks) == 1:
        return tracks[0]
    columns = {name: np.concatenate([t.columns()[name] for t in tracks]) for name in tracks[0].columns()}
    return Motion(**columns)
