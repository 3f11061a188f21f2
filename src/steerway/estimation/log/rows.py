"""Rows of a record before they are filtered: measurements, duplicates, and the times of output."""

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
    """Raises InputError unless the output rate (Hz) is None or from 1e-6 to 1000."""
    if rate is not None and not 1e-6 <= rate <= 1000.0:
        raise InputError(f"rate is {rate}, expected Hz between 1e-6 and 1000")


def measured_rows(fixes: Fixes, aid: tuple[str, ...]) -> Fixes:
    """The rows with a position or one of these aids, in order of time."""
    measured = fixes.has_position
    for name in aid:
        measured |= np.isfinite(getattr(fixes, name))
    return fixes.rows(measured).in_order()


def without_duplicates(fixes: Fixes, aid: tuple[str, ...]) -> tuple[Floats, Floats, Floats]:
    """Latitude, longitude and aids of every row; NaN if the row before has the same time, vessel and value.

    A value that is reported twice for one time is one measurement; two values, or two times, are two.
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
    """Give every duplicate the status of the row before, in place."""
    for k in np.flatnonzero(repeats):
        status[k] = status[k - 1]


def distinct_rows(fixes: Fixes, aid: tuple[str, ...]) -> Fixes:
    """The rows that are no duplicates: each has a value that the row before does not have for this time and vessel."""
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
    """(n,) `accuracy.variance_scale` of every row, per vessel; empty if no accuracy is reported."""
    if not np.isfinite(fixes.position_std).any():
        return np.empty(0)
    tracks = (each for _, each in fixes.tracks())
    reported = [np.where(each.has_position, each.position_std, np.nan) for each in tracks]
    return np.concatenate([variance_scales_of(np.zeros(2), each) for each in reported])


def schedule(fixes: Fixes, rate: float | None) -> tuple[Floats, Ints, Bools]:
    """Times (n,) that a filter visits, the row of `fixes` at each (−1 for none), and which of them are output."""
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
    """Rows and added times, which have no row (−1), in order of time; at equal times rows come first."""
    time = np.concatenate([time, added])
    order = np.argsort(time, kind="stable")
    origin = np.concatenate([origin, np.full(len(added), -1)])
    wanted = np.concatenate([wanted, np.full(len(added), added_wanted)])
    return time[order], origin[order], wanted[order]


def joined(tracks: list[Motion]) -> Motion:
    """The motions of several vessels as one table."""
    if len(tracks) == 1:
        return tracks[0]
    columns = {name: np.concatenate([t.columns()[name] for t in tracks]) for name in tracks[0].columns()}
    return Motion(**columns)
