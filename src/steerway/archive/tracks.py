"""Tracks under one MMSI: assign a report to a track, begin tentative tracks, and confirm them as ships or moves."""

import math
from typing import NamedTuple

import numpy as np

from steerway.archive.filters import Filters, State, predict, restart, state_at, weigh
from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import NO_COURSE, OK, PREDICTED, REJECTED, STARTING
from steerway.core.statistics import FIX_GATE
from steerway.estimation.log.course import COG, SOG, SOG_STD
from steerway.estimation.log.record import LONG
from steerway.estimation.log.run import UNKNOWN_SPEED


def record_of(names: str, **inner: np.dtype) -> np.dtype:
    """The dtype of records with float fields of these names, and with inner records."""
    return np.dtype((np.record, [*((name, np.float64) for name in names.split()), *inner.items()]))


class Reports(NamedTuple):
    """Rows of several vessels, one vessel after another, each in order of time; arrays (n,)."""

    time: np.ndarray  # s
    latitude: np.ndarray  # rad, NaN in a row without a report, which only requests output
    longitude: np.ndarray
    digit: np.ndarray  # rad, resolution of the written positions; 0: too fine to matter
    aids: np.ndarray  # (n or 0, aids)
    hull: np.ndarray  # code of the reported type and size, 0 if none was reported
    mobile: np.ndarray  # class of the vessel
    asked: np.ndarray  # track of a row that requests output; CURRENT_TRACK: the track of the last report


SLOTS = 4
"""Tracks under one MMSI at a time."""
FREE, TENTATIVE, LEFT, TRACKED = range(4)
"""Uses of a slot. LEFT: the place that a ship left when it moved; treated as tentative."""
TRACK = record_of(
    "use number last now hits since hull mobile known underway refused_from resets last_latitude last_longitude"
    " latitude longitude"
)
"""A slot. `use`: as above. `number` of the track, from 0. `last`: time of the last accepted report, with its position.
`now`: time to which the filter is predicted. `hits`: reports while tentative; `since`: number of reports that other
tracks had taken when its first report came. `hull`: 0 if none was reported. `mobile`: class of the vessel. `known`,
`underway`: 1 if the velocity is known, and if the vessel is under way. `refused_from`: time of the first of unbroken
rejections, else infinite; `resets`: 1 after these have moved the position. `latitude`, `longitude`: origin of the plane
(rad)."""
VESSEL = record_of("current next taken")
"""A vessel: slot of the last report, number of the next track, number of reports assigned to confirmed tracks."""
NOTHING, JUMP, MOVED, ANOTHER = range(4)
"""Events in a row. JUMP: report out of reach; MOVED: the ship continues at the new place; ANOTHER: a second ship."""

CURRENT_TRACK = -1

INTERVALS = (20.0, 100.0)
"""Limits of the classes of intervals between reports, s. Each class has its own steady noise levels."""
COMPETING, MANOEUVRING, STEADY = range(3)
LEVELS = STEADY + 2 * (len(INTERVALS) + 1)
"""Noise levels: COMPETING for several tracks under one MMSI; MANOEUVRING; and two levels of steady motion, at rest and
under way, for each class of intervals, the first of which is STEADY."""

_REACH, _REACH_PER_SECOND = 300.0, 25.0
"""Reach of a ship: a distance (m), plus a speed (m/s) times the time since its last accepted report."""
_NEAR = _REACH / 6.4e6
"""Sum of the differences in latitude and longitude, rad. Below it, points are less than `_REACH` apart at any latitude,
because no radius of curvature exceeds 6400 km."""
_CONFIRMING = 3
"""Number of reports that confirm a tentative track. Two are too few, because any two reports fit some velocity."""
_AMONG = 2
"""A newly confirmed track is another ship if other tracks took at least this number of reports in the meantime."""
_OTHER_HULL = 15.0
"""Added to the negative log-likelihood of a report whose hull size differs from the track's. Hulls are sent apart from
positions and can be mixed up, so a different hull does not exclude a track."""
_REJECTED = 22.0
"""Negative log-likelihood of a report within reach that a track's gate rejects, for example in a hard turn."""
_UNPROVEN = 10.0
"""Added to the negative log-likelihood of a report for a tentative track."""
_UNDETERMINED = 25.0
"""Negative log-likelihood of a report for a track whose filter has not started: uniform over a square of 300 km."""


@lean_kernel
def predict_to(filters: Filters, which: int, track: np.record, state: State, time: float) -> None:
    """Predict the filter of a track to a time; after a gap above LONGEST_GAP it restarts."""
    if time - track.last > LONGEST_GAP:
        restart(state)
    predict(filters, which, state, time - track.now)


@lean_kernel
def place_in_plane(track: np.record, state: State, latitude: float, longitude: float) -> tuple[float, float]:
    """North and east (m) of a position in a track's plane; before the filter starts, the origin is set to it."""
    if state.run[0].started == 0:
        track.latitude, track.longitude = latitude, longitude
    return between(track, latitude, longitude)


@lean_kernel
def between(track: np.record, latitude: float, longitude: float) -> tuple[float, float]:
    """North and east (m) of a position from the origin of a track's plane, with the radii at the latitude midway."""
    midway = 0.5 * (latitude + track.latitude)
    return displacement(midway + latitude - track.latitude, longitude, midway, track.longitude)


@called_kernel
def track_of(
    vessel: np.record, tracks: np.ndarray, states: State, reports: Reports, k: int, filters: Filters
) -> tuple[int, bool]:
    """(slot of the track that row k is assigned to, whether it is the vessel's only track).

    A vessel's first report begins a track; a report out of reach of all tracks begins a tentative one.
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
    """The slot of the track with this number, or `otherwise` if no slot has it."""
    for s in range(len(tracks)):
        if tracks[s].use == TRACKED and tracks[s].number == number:
            return s
    return otherwise


@called_kernel
def choose(tracks: np.ndarray, states: State, reports: Reports, k: int, filters: Filters) -> int:
    """The slot of the track with the highest likelihood of report k; −1 if the report is out of reach of all."""
    time, latitude, longitude, hull = reports.time[k], reports.latitude[k], reports.longitude[k], reports.hull[k]
    best, least = -1, math.inf
    for s in range(len(tracks)):
        track, state = tracks[s], state_at(states, s)
        if track.use == FREE:
            continue
        tracked = track.use == TRACKED
        if not tracked and time - track.last > LONGEST_GAP:
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
    """Whether the track of the last report is the vessel's only track, as it nearly always is."""
    for s in range(len(tracks)):
        if tracks[s].use != (TRACKED if s == int(vessel.current) else FREE):
            return False
    return True


@lean_kernel
def is_within_reach(track: np.record, time: float, latitude: float, longitude: float) -> bool:
    """Whether a ship can have reached a position since the last accepted report of the track."""
    if abs(latitude - track.last_latitude) + abs(longitude - track.last_longitude) < _NEAR:
        return True
    north, east = displacement(latitude, longitude, track.last_latitude, track.last_longitude)
    return math.hypot(north, east) <= _REACH + _REACH_PER_SECOND * (time - track.last)


@lean_kernel
def steady_level(track: np.record, time: float) -> int:
    """The noise level for steady motion, by the time since the last report and by whether the vessel is under way."""
    level = STEADY
    for edge in INTERVALS:
        if time - track.now > edge:
            level += 2
    return level + int(track.underway)


@called_kernel
def begin(track: np.record, state: State, time: float, mobile: int, use: int) -> None:
    """Initialise a track before its first report."""
    track.use, track.mobile, track.last, track.now = use, mobile, time, time
    track.refused_from, track.resets = math.inf, 0.0
    track.number, track.hits, track.since, track.hull, track.known, track.underway = -1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    restart(state)


@called_kernel
def vacant(vessel: np.record, tracks: np.ndarray) -> int:
    """A slot for a new tentative track: a free one, else the slot of the tentative track that is silent longest, else
    the slot of the confirmed track that is silent longest."""
    best, rank, last = -1, 4, math.inf
    for s in range(len(tracks)):
        use = int(tracks[s].use)
        if s != int(vessel.current) and (use < rank or (use == rank and tracks[s].last < last)):
            best, rank, last = s, use, tracks[s].last
    return best


@called_kernel
def conclude_report(vessel: np.record, tracks: np.ndarray, s: int) -> tuple[int, bool]:
    """(event, whether the track is still tentative) after a report was assigned to slot s."""
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
    event = ANOTHER
    if other or vessel.taken - track.since >= _AMONG:
        track.number = vessel.next
        vessel.next += 1.0
    else:
        event = MOVED
        track.number = current.number
        current.use, current.hits = LEFT, 0.0
    track.use = TRACKED
    vessel.taken += 1.0
    vessel.current = s
    return event, False


@lean_kernel
def note_velocity(track: np.record, estimate: Floats, accepted: bool, interval: float) -> None:
    """Set `known` and `underway` of a track from its estimate, `interval` seconds after the last accepted fix."""
    if accepted and interval > LONG:
        track.known = 0.0
    if estimate[SOG_STD] < UNKNOWN_SPEED:
        track.known = 1.0
    track.underway = 0.0 if math.isnan(estimate[COG]) else 1.0


@lean_kernel
def status_of(track: np.record, estimate: Floats, fixed: bool, accepted: bool) -> int:
    """Status code of a row (index of records.STATUSES). While starting, the velocity in `estimate` is set to NaN."""
    if track.known == 0.0:
        for i in range(SOG, len(estimate) - 1):
            estimate[i] = math.nan
        return STARTING
    if fixed and not accepted:
        return REJECTED
    if math.isnan(estimate[COG]):
        return NO_COURSE
    return OK if fixed else PREDICTED
