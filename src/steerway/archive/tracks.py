"""The tracks under one number: which of them a report belongs to, when another begins, and what that tells."""

import math
from typing import NamedTuple

import numpy as np

from steerway.archive.filters import Filters, State, predict, state_at, weigh
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.gaps import LONGEST_GAP
from steerway.core.statistics import FIX_GATE


def record_of(names: str, **inner: np.dtype) -> np.dtype:
    """Records of numbers with these names, and of inner records."""
    return np.dtype((np.record, [*((name, np.float64) for name in names.split()), *inner.items()]))


class Reports(NamedTuple):
    """Rows of vessels that stand behind one another, by time; (n,) each."""

    time: np.ndarray  # s
    latitude: np.ndarray  # rad, NaN of a row that is no report but asks for output
    longitude: np.ndarray
    digit: np.ndarray  # rad, the last one in which positions are written; 0: too fine to matter
    aids: np.ndarray  # (n or 0, aids)
    hull: np.ndarray
    mobile: np.ndarray  # class of the vessel
    asked: np.ndarray  # of a row that asks: the track, or CURRENT_TRACK, that of the last report


SLOTS = 4
"""Tracks under one MMSI at a time."""
FREE, TENTATIVE, LEFT, TRACKED = range(4)
"""Uses of a slot. LEFT: where a ship was before it moved, tentative too."""
TRACK = record_of(
    "use number last now hits since hull mobile known underway refused_from resets last_latitude last_longitude"
    " latitude longitude"
)
"""A slot. Its use, of those above; number of the track, from 0 on; time of the last report that the filter took; time
to which the filter is predicted; reports taken since it is tentative, and how many the other tracks had taken when it
became so; hull, 0 of none reported; class of the vessel; 1 where the velocity is known, and where the vessel is under
way; time of the first of unbroken refusals, infinite of none, and how often that moved the position since a report was
taken; place of the last report that the filter took, and the origin of its plane (rad)."""
VESSEL = record_of("current next taken")
"""A vessel: slot of the last report, number of the next track, reports taken by tracks."""
NOTHING, JUMP, MOVED, ANOTHER = range(4)
"""What a row tells: nothing; a position out of reach; the ship is there now; there is another ship."""

CURRENT_TRACK = -1

INTERVALS = (20.0, 100.0)
"""s from report to report that divide the steady levels."""
COMPETING, MANOEUVRING, STEADY = range(3)
LEVELS = STEADY + 2 * (len(INTERVALS) + 1)
"""Levels of noise: of tracks of which there are several, of a vessel that manoeuvres, and from STEADY on of one that
goes on as it does, at rest and under way for each class of intervals."""

_REACH, _REACH_PER_SECOND = 300.0, 25.0
"""m, and for each second (49 kn), from the last report that a filter took within which another may be of the ship."""
_NEAR = _REACH / 6.4e6
"""rad of latitude and longitude together that are less, whatever the latitude: no radius of curvature is larger."""
_CONFIRMING = 3
"""Reports that make a tentative track one; two make a velocity of any two."""
_AMONG = 2
"""Reports of other tracks meanwhile that make it another ship."""
_TENTATIVE_TIME = LONGEST_GAP
_OTHER_HULL = 15.0
"""Nll of a report whose hull is not that of the track: hulls are sent apart from positions and are mixed up."""
_REJECTED = 22.0
"""Nll of a report within reach that the gate of a track refuses, as in a hard turn."""
_UNPROVEN = 10.0
"""… and what it is raised by for a track that is tentative."""
_UNDETERMINED = 25.0
"""Nll of a report for a track within reach whose filter has no state: of a uniform density over a square of 300 km."""


@lean_kernel
def predict_to(filters: Filters, which: int, track: np.record, state: State, time: float) -> None:
    """Predict the filter of a track to a time; after a long gap it begins anew."""
    if time - track.last > LONGEST_GAP:
        state.run[0].started = 0
    predict(filters, which, state, time - track.now)


@lean_kernel
def place_in_plane(track: np.record, state: State, latitude: float, longitude: float) -> tuple[float, float]:
    """North and east (m) of a place in the plane of a track, which begins there where its filter does."""
    if state.run[0].started == 0:
        track.latitude, track.longitude = latitude, longitude
    return between(track, latitude, longitude)


@lean_kernel
def between(track: np.record, latitude: float, longitude: float) -> tuple[float, float]:
    """North and east (m) of a place seen from the origin of a track's plane, at the latitude midway."""
    midway = 0.5 * (latitude + track.latitude)
    return displacement(midway + latitude - track.latitude, longitude, midway, track.longitude)


@called_kernel
def track_of(
    vessel: np.record, tracks: np.ndarray, states: State, reports: Reports, k: int, filters: Filters
) -> tuple[int, bool]:
    """(slot of the track that row k belongs to, whether it is the only one).

    A vessel's first report begins a track; one out of the reach of all begins another, tentative.
    """
    time, latitude, longitude = reports.time[k], reports.latitude[k], reports.longitude[k]
    cur = int(vessel.current)
    if tracks[cur].use == FREE:
        begin(tracks[cur], state_at(states, cur), time, reports.mobile[k], TRACKED)
        tracks[cur].number, vessel.next = 0.0, 1.0
        return cur, True
    if not math.isfinite(latitude):
        return slot_of(tracks, reports.asked[k], cur), False
    if is_alone(vessel, tracks) and is_within_reach(tracks[cur], time, latitude, longitude):
        return cur, True
    chosen = choose(tracks, states, reports, k, filters)
    if chosen < 0:
        chosen = vacant(vessel, tracks)
        begin(tracks[chosen], state_at(states, chosen), time, reports.mobile[k], TENTATIVE)
        tracks[chosen].since = vessel.taken
    return chosen, False


@called_kernel
def slot_of(tracks: np.ndarray, number: int, otherwise: int) -> int:
    """The slot of a track."""
    for s in range(len(tracks)):
        if tracks[s].use == TRACKED and tracks[s].number == number:
            return s
    return otherwise


@called_kernel
def choose(tracks: np.ndarray, states: State, reports: Reports, k: int, filters: Filters) -> int:
    """The slot that report k belongs to; −1 out of the reach of all."""
    time, latitude, longitude, hull = reports.time[k], reports.latitude[k], reports.longitude[k], reports.hull[k]
    best, least = -1, math.inf
    for s in range(len(tracks)):
        track, state = tracks[s], state_at(states, s)
        if track.use == FREE:
            continue
        tracked = track.use == TRACKED
        if not tracked and time - track.last > _TENTATIVE_TIME:
            track.use = FREE
            continue
        which = int(track.mobile) * LEVELS + COMPETING
        predict_to(filters, which, track, state, time)
        track.now = time
        accepted, cost = tracked, _UNDETERMINED
        if state.run[0].started == 1:
            north, east = between(track, latitude, longitude)
            cost, nis = weigh(filters, which, state, north, east)
            accepted = nis <= FIX_GATE
        if not (accepted or tracked) or not is_within_reach(track, time, latitude, longitude):
            continue
        if not accepted:
            cost = _REJECTED
        if hull > 0 and track.hull > 0 and hull != track.hull:
            cost += _OTHER_HULL
        if not tracked:
            cost += _UNPROVEN
        if cost < least:
            best, least = s, cost
    return best


@lean_kernel
def is_alone(vessel: np.record, tracks: np.ndarray) -> bool:
    """Whether the track of the last report is the only one, as nearly always."""
    for s in range(len(tracks)):
        if tracks[s].use != (TRACKED if s == int(vessel.current) else FREE):
            return False
    return True


@lean_kernel
def is_within_reach(track: np.record, time: float, latitude: float, longitude: float) -> bool:
    """Whether a ship may have come from the last report that the filter of its track took."""
    if abs(latitude - track.last_latitude) + abs(longitude - track.last_longitude) < _NEAR:
        return True
    north, east = displacement(latitude, longitude, track.last_latitude, track.last_longitude)
    return math.hypot(north, east) <= _REACH + _REACH_PER_SECOND * (time - track.last)


@lean_kernel
def steady_level(track: np.record, time: float) -> int:
    """The level at a time of a vessel that goes on as it does."""
    level = STEADY
    for edge in INTERVALS:
        if time - track.now > edge:
            level += 2
    return level + int(track.underway)


@called_kernel
def begin(track: np.record, state: State, time: float, mobile: int, use: int) -> None:
    """A track without a report."""
    track.use, track.mobile, track.last, track.now = use, mobile, time, time
    track.refused_from, track.resets = math.inf, 0.0
    track.number, track.hits, track.since, track.hull, track.known, track.underway = -1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    state.run[0].started = 0


@called_kernel
def vacant(vessel: np.record, tracks: np.ndarray) -> int:
    """A slot for a tentative track: a free one, else that of the longest silent tentative one, else track."""
    best, rank, last = -1, 4, math.inf
    for s in range(len(tracks)):
        use = int(tracks[s].use)
        if s != int(vessel.current) and (use < rank or (use == rank and tracks[s].last < last)):
            best, rank, last = s, use, tracks[s].last
    return best


@called_kernel
def conclude_report(vessel: np.record, tracks: np.ndarray, s: int) -> tuple[int, bool]:
    """After slot s has taken a report: what that tells, and whether the track is tentative still."""
    track, current = tracks[s], tracks[int(vessel.current)]
    if track.use == TRACKED:
        vessel.taken += 1.0
        vessel.current = s
        return NOTHING, False
    if track.hits == 0.0:
        track.since = vessel.taken
    track.hits += 1.0
    if track.hits < _CONFIRMING:
        return JUMP, True
    other = track.hull > 0.0 and current.hull > 0.0 and track.hull != current.hull
    says = ANOTHER
    if other or vessel.taken - track.since >= _AMONG:
        track.number = vessel.next
        vessel.next += 1.0
    else:
        says = MOVED
        track.number = current.number
        current.use, current.hits = LEFT, 0.0
    track.use = TRACKED
    vessel.taken += 1.0
    vessel.current = s
    return says, False
