"""Assign the reports under one MMSI to ships, and run one filter per ship.

A report is assigned to the track with the highest likelihood among those whose gate accepts it (nearest neighbour;
Y. Bar-Shalom and X.-R. Li, Multitarget-Multisensor Tracking, 1995, ch. 3); a different reported hull size lowers the
likelihood. A report out of reach of every track begins a tentative track. If reports then continue at both places,
there are two ships. If they continue only at the new place, the ship has moved: its track continues there, and an
event records the move. The assignment uses earlier reports only, so a record may be cut anywhere.

If a number has only one track, the innovation selects its noise level (Y. Bar-Shalom, X.-R. Li and T. Kirubarajan,
Estimation with Applications to Tracking and Navigation, 2001, sec. 11.2). The steady level comes first; it depends on
the interval between reports and on whether the vessel is under way. If the gate then rejects the report, the
manoeuvring level is used.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from steerway.archive.filters import (
    OUTPUTS,
    Filters,
    State,
    aid,
    copy_state,
    empty_states,
    free_position,
    predict,
    recentre,
    restart,
    round_to,
    state_at,
    take,
    write,
)
from steerway.archive.tracks import (
    COMPETING,
    LEVELS,
    MANOEUVRING,
    NOTHING,
    SLOTS,
    STEADY,
    TRACK,
    VESSEL,
    Reports,
    conclude_report,
    note_velocity,
    place_in_plane,
    predict_to,
    status_of,
    steady_level,
    track_of,
)
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import REJECTED
from steerway.core.statistics import FIX_GATE, UNBROKEN_REJECTION
from steerway.estimation.filter.vectors import Vec2

CONTINUED, REPOSITIONED, RESTARTED = range(3)
"""How a filter continues from the row before: unchanged; with a new position and the same velocity; not at all."""


class Fleet(NamedTuple):
    """Vessels, their tracks and the states of the tracks' filters; all zero before the first report."""

    vessels: np.ndarray  # (v,) VESSEL
    tracks: np.ndarray  # (v, SLOTS) TRACK
    states: State  # (v, SLOTS, …)


class Kept(NamedTuple):
    """Filter states of every row, stored for the smoother; zero rows if nothing is smoothed."""

    states: State  # (n or 0, …) filter state after the row
    plane: np.ndarray  # (n or 0, 2) latitude and longitude of the origin of the filter's plane, rad
    link: np.ndarray  # (n or 0,) CONTINUED, REPOSITIONED or RESTARTED


class Found(NamedTuple):
    """Results of every row; arrays (n,) unless a shape is given."""

    estimate: np.ndarray  # (n, OUTPUTS)
    nis: np.ndarray
    status: np.ndarray
    track: np.ndarray
    event: np.ndarray
    which: np.ndarray  # index of the model that predicted the row
    kept: Kept


@kernel
def associate(
    bounds: NDArray[np.int64], reports: Reports, filters: Filters, fleet: Fleet, found: Found, spare: State
) -> None:
    """Run over reports, with vessel v in rows bounds[v] to bounds[v + 1]; fills `found` and updates `fleet`.

    spare: workspace, State of two filters.
    """
    for v in range(len(bounds) - 1):
        rows = bounds[v], bounds[v + 1]
        follow(fleet.vessels[v], fleet.tracks[v], state_at(fleet.states, v), rows, reports, filters, found, spare)


@called_kernel
def follow(
    vessel: np.record,
    tracks: np.ndarray,
    states: State,
    rows: tuple[int, int],
    reports: Reports,
    filters: Filters,
    found: Found,
    spare: State,
) -> None:
    """Run over the rows of a vessel, from rows[0] to rows[1]."""
    time, before, ahead = reports.time, state_at(spare, 0), state_at(spare, 1)
    ahead_of, ahead_time = -1, 0.0
    for k in range(rows[0], rows[1]):
        fixed, tentative, accepted, link = math.isfinite(reports.latitude[k]), False, False, CONTINUED
        found.event[k], found.nis[k] = NOTHING, math.nan
        if fixed:
            round_to(filters.models.receiver, reports.digit[k], reports.latitude[k])
        chosen, alone = track_of(vessel, tracks, states, reports, k, filters)
        track, shown, estimate = tracks[chosen], state_at(states, chosen), found.estimate[k]
        if fixed:
            ahead_of = -1
            which, found.nis[k], accepted, link = take_report(filters, track, shown, reports, k, alone, before)
            write(filters, which, track.latitude, track.longitude, shown, estimate)
            found.which[k] = which
            note_report(track, estimate, accepted, reports, k)
            found.event[k], tentative = conclude_report(vessel, tracks, chosen)
        if tentative:
            chosen, accepted = int(vessel.current), False
            track, link = tracks[chosen], CONTINUED
        if tentative or not fixed:  # predict a copy: the track itself continues from its last report
            if ahead_of != chosen:
                copy_state(state_at(states, chosen), ahead)
                ahead_of, ahead_time = chosen, track.now
            shown = ahead
            level = COMPETING if track.now == time[k] else steady_level(track, time[k])
            which = int(track.mobile) * LEVELS + level
            if time[k] - track.last > LONGEST_GAP:
                restart(ahead)
            predict(filters, which, ahead, time[k] - ahead_time)
            ahead_time = time[k]
            write(filters, which, track.latitude, track.longitude, ahead, estimate)
            found.which[k] = which
        found.track[k] = int(track.number)
        status = status_of(track, estimate, fixed, accepted)
        found.status[k] = REJECTED if tentative else status
        if len(found.kept.link):
            keep(found.kept, k, track, shown, link)


@lean_kernel
def keep(kept: Kept, k: int, track: np.record, state: State, link: int) -> None:
    """Store the filter of a track after row k."""
    copy_state(state, state_at(kept.states, k))
    kept.plane[k, 0], kept.plane[k, 1], kept.link[k] = track.latitude, track.longitude, link


@called_kernel
def take_report(
    filters: Filters, track: np.record, state: State, reports: Reports, k: int, alone: bool, before: State
) -> tuple[int, float, bool, int]:
    """Update a track with row k. If it is `alone`, the steady noise level is tried before the manoeuvring level.

    Returns the index of the model that predicted the row, the NIS, whether the fix was accepted, and the link to the
    row before. before: workspace.
    """
    time, first = reports.time[k], int(track.mobile) * LEVELS
    level = COMPETING
    if alone:
        copy_state(state, before)
        level = steady_level(track, time)
    while True:
        which = first + level
        if alone:
            predict_to(filters, which, track, state, time)
        north, east = place_in_plane(track, state, reports.latitude[k], reports.longitude[k])
        nis, wrong = take(filters, which, state, north, east)
        # The NIS of a rounded fix includes the rounding variance: it can pass although the rounding cell does not fit.
        passes = nis <= FIX_GATE and not (wrong > 0.5 and reports.digit[k] > 0.0)
        if level < STEADY or passes:
            break
        copy_state(before, state)
        level = MANOEUVRING
    link = CONTINUED
    if wrong > 0.5:
        link = after_rejection(filters, which, track, state, time, Vec2(north, east))
    else:
        track.refused_from, track.resets = math.inf, 0.0
    track.now = time
    if len(reports.aids) > 0:
        aid(filters, which, state, reports.aids[k])
    recentre(track, state, (reports.latitude[k], reports.longitude[k]), (north, east))
    return which, nis, not wrong > 0.5, link


@called_kernel
def after_rejection(filters: Filters, which: int, track: np.record, state: State, time: float, place: Vec2) -> int:
    """Accept a rejected report at `place` (m) if rejections have lasted UNBROKEN_REJECTION. Returns the link.

    The first time the filter takes the new position and keeps its velocity. If reports are still rejected after that,
    the filter restarts.
    """
    if not time - track.refused_from >= UNBROKEN_REJECTION - 1e-6:
        track.refused_from = min(track.refused_from, time)
        return CONTINUED
    link = RESTARTED if track.resets > 0.0 else REPOSITIONED
    if link == RESTARTED:
        restart(state)
    else:
        free_position(state)
    track.refused_from, track.resets = math.inf, 1.0 - track.resets
    take(filters, which, state, place.n, place.e)
    return link


@lean_kernel
def note_report(track: np.record, estimate: Floats, accepted: bool, reports: Reports, k: int) -> None:
    """Update the record of a track from row k, after its filter has processed the row."""
    note_velocity(track, estimate, accepted, reports.time[k] - track.last)
    if accepted:
        track.last = reports.time[k]
        track.last_latitude, track.last_longitude = reports.latitude[k], reports.longitude[k]
    if reports.hull[k]:
        track.hull = reports.hull[k]


def empty_fleet(count: int, filters: Filters) -> Fleet:
    """Vessels before their first report."""
    return Fleet(np.zeros(count, VESSEL), np.zeros((count, SLOTS), TRACK), empty_states((count, SLOTS), filters))


def empty_found(rows: int, kept: int, filters: Filters) -> Found:
    """Uninitialised results for `rows` rows, with filter states stored for `kept` of them."""
    kinds = np.float64, np.uint8, np.int64, np.uint8, np.uint8
    room = Kept(empty_states((kept,), filters), np.empty((kept, 2)), np.empty(kept, np.int8))
    nis, status, track, event, which = (np.empty(rows, kind) for kind in kinds)
    return Found(np.empty((rows, OUTPUTS)), nis, status, track, event, which, room)
