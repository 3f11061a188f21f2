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

import numpy as np

from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.core.earth import displacement
from steerway.core.records import REJECTED
from steerway.estimation.course.motion.layout import EMPTY, LATITUDE, LONGITUDE, PHASE, UNDER_WAY
from steerway.estimation.course.output import copy_block, status_of, write_output
from steerway.estimation.course.tracking import advance, recentre, settle, take_aids, take_position, weigh_fix
from steerway.estimation.course.update.aids import any_known
from steerway.estimation.course.update.outliers import fix_is_accepted
from steerway.estimation.log.rows import LONGEST_GAP

SLOTS = 4
"""Tracks under one MMSI at a time."""
(
    USE,  # one of the uses below
    NUMBER,  # of the track, from 0 on
    LAST,  # time and place of the last report that the filter took
    NOW,  # time to which the filter is predicted
    HITS,  # reports taken since it is tentative
    SINCE,  # how many reports the other tracks had taken when it became so
    HULL,  # 0: none reported
    PROFILE,  # index of the parameters
    LAST_LATITUDE,
    LAST_LONGITUDE,
) = range(10)
FIELDS = 10
FREE, TENTATIVE, LEFT, TRACK = range(4)
"""Uses of a slot. LEFT: where a ship was before it moved, tentative too."""
CURRENT, NEXT, TAKEN = range(3)
"""Columns of a vessel's state: slot of the last report, number of the next track, reports taken by tracks."""
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


@kernel
def associate(bounds, record, parameters, vessels, slots, banks, terms, estimate, found, kept):
    """Run over the reports of vessels that stand behind one another, vessel v in rows bounds[v] to bounds[v + 1].

    Args:
        record: (time, latitude, longitude, aids, hull, profile, asked), (n,) each and aids (n or 0, aids); rad, NaN
            latitude for a row that is none but asks for output, of track `asked` or CURRENT_TRACK, of the last report.
        parameters: (profiles, LEVELS, 1, k). vessels: (v, 3), slots: (v, SLOTS, FIELDS), banks: (v, SLOTS, 1, rows,
            states): the state before, zero at first, and after. terms: (profiles, LEVELS, any, STEP_ROWS, states),
            zero.
        estimate, found: filled; (n, OUTPUTS), and (nis, status, track, event, row) of (n,) each, the last one in the
            first two axes of the parameters, that by which it was predicted.
        kept: (n or 0, states + 2, states) receives the filter after every row that a track took.
    """
    time, latitude, longitude, aids, hull, _, _ = record
    nis, status, track, event, row_of = found
    before, ahead = np.empty(banks.shape[3:]), np.empty(banks.shape[2:])
    for v in range(len(bounds) - 1):
        vessel, slot, bank = vessels[v], slots[v], banks[v]
        ahead_of, ahead_time, since = -1, 0.0, 0.0
        for k in range(bounds[v], bounds[v + 1]):
            event[k], nis[k], level = NOTHING, math.nan, COMPETING
            fixed = math.isfinite(latitude[k])
            chosen, accepted, alone = track_of(vessel, slot, bank, record, k, parameters, terms)
            p, tentative = int(slot[chosen, PROFILE]), False
            row = parameters[p, COMPETING]
            if fixed:
                ahead_of = -1
                if alone:
                    copy_block(bank[chosen][0], before)
                    since = slot[chosen, NOW]
                    level = steady_level(bank[chosen], time[k] - since)
                noise = parameters[p, level]
                while True:
                    if alone:
                        predict_to(slot[chosen], bank[chosen], time[k], parameters[p, level], terms[p, level])
                    took, nis[k], _ = take_position(bank[chosen], latitude[k], longitude[k], True, 1.0, noise)
                    if took or not alone or level == MANOEUVRING:
                        break
                    copy_block(before, bank[chosen][0])
                    slot[chosen, NOW], level, noise = since, MANOEUVRING, row
                accepted = accepted and took
                if len(aids) > 0 and any_known(aids[k]):
                    take_aids(bank[chosen], aids[k], row)
                settle(bank[chosen], row)
                recentre(bank[chosen])
                if took:
                    slot[chosen, LAST_LATITUDE], slot[chosen, LAST_LONGITUDE] = latitude[k], longitude[k]
                    slot[chosen, LAST] = time[k]
                if hull[k]:
                    slot[chosen, HULL] = hull[k]
                event[k], tentative = conclude_report(vessel, slot, chosen)
            if tentative:
                chosen, accepted = int(vessel[CURRENT]), False
            if tentative or not fixed:  # shown is where the track is now; the track itself goes on from its last report
                p = int(slot[chosen, PROFILE])
                if ahead_of != chosen:
                    copy_block(bank[chosen][0], ahead[0])
                    ahead_of, ahead_time = chosen, slot[chosen, NOW]
                level = steady_level(ahead, time[k] - slot[chosen, NOW])
                advance(ahead, time[k] - ahead_time, parameters[p, level], terms[p, level])
                ahead_time = time[k]
                shown = ahead
            else:
                shown = bank[chosen]
            track[k], row_of[k] = slot[chosen, NUMBER], p * LEVELS + level
            status[k] = REJECTED if tentative else status_of(shown, fixed, accepted)
            write_output(shown[0], True, estimate[k])
            if len(kept):
                copy_block(shown[0], kept[k])


@called_kernel
def track_of(vessel, slot, bank, record, k, parameters, terms):
    """(slot of the track that row k belongs to, whether it accepts the row, whether it is the only one).

    A vessel's first report begins a track; one out of the reach of all begins another, tentative.
    """
    time, latitude, longitude, _, hull, profile, asked = record
    cur = int(vessel[CURRENT])
    if slot[cur, USE] == FREE:
        begin(slot[cur], bank[cur], time[k], profile[k], TRACK)
        slot[cur, NUMBER], vessel[NEXT] = 0.0, 1.0
        return cur, True, True
    if not math.isfinite(latitude[k]):
        return slot_of(slot, asked[k], cur), False, False
    if is_alone(vessel, slot) and is_within_reach(slot[cur], time[k], latitude[k], longitude[k]):
        return cur, True, True
    chosen, accepted = choose(vessel, slot, bank, time[k], latitude[k], longitude[k], hull[k], parameters, terms)
    if chosen < 0:
        chosen = vacant(vessel, slot)
        begin(slot[chosen], bank[chosen], time[k], profile[k], TENTATIVE)
        slot[chosen, SINCE] = vessel[TAKEN]
    return chosen, accepted, False


@called_kernel
def slot_of(slot, number, otherwise):
    """The slot of a track."""
    for s in range(len(slot)):
        if slot[s, USE] == TRACK and slot[s, NUMBER] == number:
            return s
    return otherwise


@called_kernel
def choose(vessel, slot, bank, time, latitude, longitude, hull, parameters, terms):
    """The slot that a report belongs to and whether its gate accepts it; (−1, False) out of the reach of all."""
    best, least, within = -1, math.inf, False
    for s in range(len(slot)):
        if slot[s, USE] == FREE:
            continue
        if slot[s, USE] != TRACK and time - slot[s, LAST] > _TENTATIVE_TIME:
            slot[s, USE] = FREE
            continue
        p = int(slot[s, PROFILE])
        predict_to(slot[s], bank[s], time, parameters[p, COMPETING], terms[p, COMPETING])
        flags = bank[s][0, bank.shape[3] + 1]
        other = hull > 0 and slot[s, HULL] > 0 and hull != slot[s, HULL]
        if flags[PHASE] == EMPTY:
            accepted, cost = slot[s, USE] == TRACK, _UNDETERMINED
        else:
            north, east = displacement(latitude, longitude, flags[LATITUDE], flags[LONGITUDE])
            row = parameters[p, COMPETING]
            _, cost, gate = weigh_fix(bank[s], 0, 1, north, east, 1.0, row)
            accepted = fix_is_accepted(gate, cost, row[0])
        possible = accepted or slot[s, USE] == TRACK
        if not (possible and is_within_reach(slot[s], time, latitude, longitude)):
            continue
        if not accepted:
            cost = _REJECTED
        if other:
            cost += _OTHER_HULL
        if slot[s, USE] != TRACK:
            cost += _UNPROVEN
        if cost < least:
            best, least, within = s, cost, accepted
    return best, within


@lean_kernel
def is_alone(vessel, slot):
    """Whether the track of the last report is the only one, as nearly always."""
    for s in range(len(slot)):
        if slot[s, USE] != (TRACK if s == int(vessel[CURRENT]) else FREE):
            return False
    return True


@lean_kernel
def is_within_reach(slot, time, latitude, longitude):
    """Whether a ship may have come from the last report that the filter of its track took."""
    north, east = displacement(latitude, longitude, slot[LAST_LATITUDE], slot[LAST_LONGITUDE])
    return math.hypot(north, east) <= _REACH + _REACH_PER_SECOND * (time - slot[LAST])


@lean_kernel
def steady_level(bank, dt):
    """The level of a vessel that goes on as it does, dt seconds after its last report."""
    level = STEADY
    for edge in INTERVALS:
        if dt > edge:
            level += 2
    return level + 1 if bank[0, bank.shape[2] + 1, PHASE] == UNDER_WAY else level


@called_kernel
def predict_to(slot, bank, time, parameters, terms):
    """Predict a filter to a time; after a long gap it is empty."""
    if time - slot[LAST] > LONGEST_GAP:
        bank[0, bank.shape[2] + 1, PHASE] = EMPTY
        bank[0, bank.shape[2], 0] = bank[0, bank.shape[2], 1] = 0.0
    advance(bank, time - slot[NOW], parameters, terms)
    slot[NOW] = time


@called_kernel
def begin(slot, bank, time, profile, use):
    """A track without a report."""
    slot[:] = 0.0
    slot[USE], slot[PROFILE], slot[LAST], slot[NOW] = use, profile, time, time
    slot[NUMBER] = -1.0
    bank[:] = 0.0


@called_kernel
def vacant(vessel, slot):
    """A slot for a tentative track: a free one, else that of the longest silent tentative one, else track."""
    best, rank, last = -1, 4, math.inf
    for s in range(len(slot)):
        use = int(slot[s, USE])
        if s != int(vessel[CURRENT]) and (use < rank or (use == rank and slot[s, LAST] < last)):
            best, rank, last = s, use, slot[s, LAST]
    return best


@called_kernel
def conclude_report(vessel, slot, s):
    """After slot s has taken a report: what that tells, and whether the track is tentative still."""
    if slot[s, USE] == TRACK:
        vessel[TAKEN] += 1.0
        vessel[CURRENT] = s
        return NOTHING, False
    if slot[s, HITS] == 0.0:
        slot[s, SINCE] = vessel[TAKEN]
    slot[s, HITS] += 1.0
    cur = int(vessel[CURRENT])
    if slot[s, HITS] < _CONFIRMING:
        return JUMP, True
    other = slot[s, HULL] > 0.0 and slot[cur, HULL] > 0.0 and slot[s, HULL] != slot[cur, HULL]
    says = ANOTHER
    if other or vessel[TAKEN] - slot[s, SINCE] >= _AMONG:
        slot[s, NUMBER] = vessel[NEXT]
        vessel[NEXT] += 1.0
    else:
        says = MOVED
        slot[s, NUMBER] = slot[cur, NUMBER]
        slot[cur, USE], slot[cur, HITS] = LEFT, 0.0
    slot[s, USE] = TRACK
    vessel[TAKEN] += 1.0
    vessel[CURRENT] = s
    return says, False


def empty_vessels(count, banks_shape) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(vessels, slots, banks) before the first report; banks_shape: (1, rows, states) of `empty_bank`."""
    return np.zeros((count, 3)), np.zeros((count, SLOTS, FIELDS)), np.zeros((count, SLOTS, *banks_shape))
