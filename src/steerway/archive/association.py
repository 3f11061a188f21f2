"""Reports under one MMSI to ships: the filter of every ship, and which of them a report belongs to.

A report goes to the track whose prediction makes it most probable, by the filter's own gate (nearest neighbour;
Y. Bar-Shalom and X.-R. Li, Multitarget-Multisensor Tracking, 1995, ch. 3), weighed by the hull that is reported. One
out of the reach of every track begins a tentative track. Where reports go on at both places there are two ships; where
they go on at the new place alone the ship has moved there: its track goes on, and a jump is noted. All is causal, so
that it does not matter where a record is cut.

The noise of a track that is alone has levels, of which the innovation chooses (Y. Bar-Shalom, X.-R. Li and T.
Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, sec. 11.2): that of a vessel which goes on
as it does, by the time from report to report and by whether it is under way, and, where the gate refuses the report
then, that of one which manoeuvres.
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
    note_velocity,
    predict,
    recentre,
    round_to,
    state_at,
    status_of,
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
    place_in_plane,
    predict_to,
    steady_level,
    track_of,
)
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import REJECTED
from steerway.core.statistics import FIX_GATE, UNBROKEN_REJECTION
from steerway.estimation.filter.vectors import Vec2

GOES_ON, SET_DOWN, ANEW = range(3)
"""How a filter goes on from the row before: as it does; at another position, in the same motion; not at all."""


class Fleet(NamedTuple):
    """What is known of vessels: zero at first."""

    vessels: np.ndarray  # (v,) VESSEL
    tracks: np.ndarray  # (v, SLOTS) TRACK
    states: State  # (v, SLOTS, …)


class Kept(NamedTuple):
    """What is kept of rows for the smoother; of none where nothing is to be smoothed."""

    states: State  # (n or 0, …) of the filter after the row
    plane: np.ndarray  # (n or 0, 2) origin of its plane, rad
    link: np.ndarray  # (n or 0,) how it goes on from the row before


class Found(NamedTuple):
    """What every row gives; (n,) each."""

    estimate: np.ndarray  # (n, OUTPUTS)
    nis: np.ndarray
    status: np.ndarray
    track: np.ndarray
    event: np.ndarray
    which: np.ndarray  # of the models: that by which the row was predicted
    kept: Kept


@kernel
def associate(
    bounds: NDArray[np.int64], reports: Reports, filters: Filters, fleet: Fleet, found: Found, spare: State
) -> None:
    """Run over reports, those of vessel v in rows bounds[v] to bounds[v + 1]; fills `found`, goes on with `fleet`.

    spare: State of two filters, workspace.
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
    """Run over the rows of a vessel, from rows[0] to rows[1]. It counts no references to arrays, as a kernel does."""
    time, before, ahead = reports.time, state_at(spare, 0), state_at(spare, 1)
    ahead_of, ahead_time = -1, 0.0
    for k in range(rows[0], rows[1]):
        fixed, tentative, accepted, link = math.isfinite(reports.latitude[k]), False, False, GOES_ON
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
            track, link = tracks[chosen], GOES_ON
        if tentative or not fixed:  # shown is where the track is now; the track itself goes on from its last report
            if ahead_of != chosen:
                copy_state(state_at(states, chosen), ahead)
                ahead_of, ahead_time = chosen, track.now
            shown = ahead
            level = COMPETING if track.now == time[k] else steady_level(track, time[k])
            which = int(track.mobile) * LEVELS + level
            if time[k] - track.last > LONGEST_GAP:
                ahead.run[0].started = 0
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
    """Keep the filter of a track after row k."""
    copy_state(state, state_at(kept.states, k))
    kept.plane[k, 0], kept.plane[k, 1], kept.link[k] = track.latitude, track.longitude, link


@called_kernel
def take_report(
    filters: Filters, track: np.record, state: State, reports: Reports, k: int, alone: bool, before: State
) -> tuple[int, float, bool, int]:
    """Take row k: of a track that is alone as of a vessel that goes on as it does, else as of one that manoeuvres.

    Returns the model by which it was predicted, its NIS, whether it is no outlier, and how the filter goes on. before:
    workspace.
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
        # The NIS of a rounded fix has the variance of its last digit, and lets pass what its cell refuses.
        passes = nis <= FIX_GATE and not (wrong > 0.5 and reports.digit[k] > 0.0)
        if level < STEADY or passes:
            break
        copy_state(before, state)
        level = MANOEUVRING
    link = GOES_ON
    if wrong > 0.5:
        link = after_refusal(filters, which, track, state, time, Vec2(north, east))
    else:
        track.refused_from, track.resets = math.inf, 0.0
    track.now = time
    if len(reports.aids) > 0:
        aid(filters, which, state, reports.aids[k])
    recentre(track, state, (reports.latitude[k], reports.longitude[k]), (north, east))
    return which, nis, not wrong > 0.5, link


@called_kernel
def after_refusal(filters: Filters, which: int, track: np.record, state: State, time: float, place: Vec2) -> int:
    """Where reports have been refused for long, take this one, at a place (m), nevertheless. Returns how it goes on.

    The position moves there, and the motion is kept; if that does not help, the filter begins anew.
    """
    if not time - track.refused_from >= UNBROKEN_REJECTION - 1e-6:
        track.refused_from = min(track.refused_from, time)
        return GOES_ON
    link = ANEW if track.resets > 0.0 else SET_DOWN
    if link == ANEW:
        state.run[0].started = 0
    else:
        free_position(state)
    track.refused_from, track.resets = math.inf, 1.0 - track.resets
    take(filters, which, state, place.n, place.e)
    return link


@lean_kernel
def note_report(track: np.record, estimate: Floats, accepted: bool, reports: Reports, k: int) -> None:
    """Note what row k says of a track, when its filter has dealt with it."""
    note_velocity(track, estimate, accepted, reports.time[k] - track.last)
    if accepted:
        track.last, track.last_latitude, track.last_longitude = (
            reports.time[k],
            reports.latitude[k],
            reports.longitude[k],
        )
    if reports.hull[k]:
        track.hull = reports.hull[k]


def empty_fleet(count: int, filters: Filters) -> Fleet:
    """Vessels before their first report."""
    return Fleet(np.zeros(count, VESSEL), np.zeros((count, SLOTS), TRACK), empty_states((count, SLOTS), filters))


def empty_found(rows: int, kept: int, filters: Filters) -> Found:
    """Where so many rows are found, and so many kept."""
    kinds = np.float64, np.uint8, np.int64, np.uint8, np.uint8
    room = Kept(empty_states((kept,), filters), np.empty((kept, 2)), np.empty(kept, np.int8))
    nis, status, track, event, which = (np.empty(rows, kind) for kind in kinds)
    return Found(np.empty((rows, OUTPUTS)), nis, status, track, event, which, room)
