"""What a record is before it is fitted: copies of fixes, the white part of their noise, rows to fit to."""

import math

import numpy as np

from steerway.estimation.inference.fit import Rows


def without_copies(north, east):
    """North and east (n,) with copies of the fix before as unknown: receivers hold, loggers stutter.

    Positions that are written in coarse steps repeat themselves as well, of a vessel that hardly moves; such a repeat
    is followed by a step or two, a copy by all the way since.
    """
    north, east = np.array(north, dtype=np.float64), np.array(east, dtype=np.float64)
    known = np.flatnonzero(np.isfinite(north) & np.isfinite(east))
    if len(known) < 3:
        return north, east
    steps = np.abs(np.diff(np.column_stack([north[known], east[known]]), axis=0))
    same = (steps == 0.0).all(axis=1)
    if not same.any():
        return north, east
    resolution = [np.nanquantile(np.where(column > 0.0, column, np.nan), 0.05) for column in steps.T]
    coarse = np.maximum(np.nan_to_num(resolution), 1e-9)
    far = (steps > FEW_STEPS * coarse).any(axis=1)
    follows = np.flatnonzero(~same)  # the next move after each run of repeats
    after = np.searchsorted(follows, np.arange(len(same)))
    moved = np.append(far[follows], True)[after]
    copies = known[1:][same & moved]
    north[copies] = east[copies] = np.nan
    return north, east


FEW_STEPS = 2.5
"""Steps of the resolution that a vessel which hardly moves goes at once: one or two, and rounding."""


PERIODS, FEWEST_PERIODS = range(4, 11), 20
"""Fixes in a period of a receiver's measurements that is looked for, and periods that it is seen in. Chosen: of shorter
periods all fixes are measured or beside one that is."""
CORRECTED = 5.0
"""How many times as far a corrected fix departs from its neighbours as the others do. Chosen: in recorded logs it is 14
and 18 of a receiver that extrapolates, 1.0 to 3.0 of 28 others."""


def extrapolated(time, north, east):
    """(n,) bool: fixes that a receiver extrapolated between its measurements: every fourth to tenth fix is one.

    Such fixes say nothing of the motion that the ones before did not say, and each measurement corrects them at once.
    A receiver that does so departs from even progress always in the same phase of a period.
    """
    usual = np.median(np.diff(time)) if len(time) > 1 else 0.0
    if usual <= 0.0:
        return np.zeros(len(time), bool)
    slot = np.round((time - time[0]) / usual).astype(np.int64)
    moved = np.column_stack([np.diff(north), np.diff(east)])
    uneven = np.hypot(*(moved[1:-1] - 0.5 * (moved[:-2] + moved[2:])).T)
    even = slot[3:] - slot[:-3] == 3
    uneven, at = uneven[even], slot[2:-1][even]
    if not uneven.any():
        return np.zeros(len(time), bool)
    resolution = np.quantile(uneven[uneven > 0.0], 0.05)
    for period in PERIODS:
        phase = at % period
        if np.bincount(phase, minlength=period).min() < FEWEST_PERIODS:
            break
        by_phase = np.array([np.median(uneven[phase == each]) for each in range(period)])
        measured = int(np.argmax(by_phase))
        others = np.delete(by_phase, [(measured + beside) % period for beside in (-1, 0, 1)])
        if by_phase[measured] > CORRECTED * max(others.max(), resolution):
            return slot % period != measured
    return np.zeros(len(time), bool)


def white_std(time, north, east) -> float:
    """Standard deviation (m) of the white part of a fix, by third differences of equally spaced fixes.

    A median, which turns and outliers do not move; the third difference of white noise has a variance of 20.
    """
    steps = np.diff(time)
    usual = np.median(steps)
    even = np.abs(steps - usual) < 0.1 * usual
    even = even[2:] & even[1:-1] & even[:-2]
    if even.sum() < 20:
        return 0.3
    third = np.concatenate([np.diff(north, 3)[even], np.diff(east, 3)[even]])
    return max(1.4826 * float(np.median(np.abs(third))) / math.sqrt(20.0), 1e-3)


_LONG, _LONG_FOR = 60.0, 5.0
"""s and usual intervals; behind a longer gap a fit begins anew: one fix after it tells nothing of any one
number. Chosen."""
_PIECES, _BURSTS, _IN_BURSTS, _IN_PHASE = 8, 4, 0.25, 10
"""Pieces of a long record, bursts and the share of rows that are in them, rows between changes of phase.
Chosen."""


_REST, _REST_SPEED = 10.0, 0.3
"""s and m/s: a vessel that was so long before and will be so long after no farther off than this speed takes her is at
rest. Chosen: the speed is `course.STEERAGEWAY`."""
_HELD = 0.5
"""Ratio of the noise at rest to that under way below which a receiver holds or low-passes the positions of a vessel at
rest: such fixes tell nothing of those under way. In recorded logs it is 0 to 0.45 of receivers that do, 0.6 to 1.2 of
others."""


def telling(record: Rows):
    """Rows with fixes that a fit looks at: not those of a receiver that holds positions at rest."""
    fixed = np.flatnonzero(np.isfinite(record.north))
    time, north, east = record.time[fixed], record.north[fixed], record.east[fixed]
    n = len(fixed)
    moves = np.zeros(n, bool)
    for other in (np.searchsorted(time, time - _REST), np.searchsorted(time, time + _REST)):
        other = other.clip(0, n - 1)
        moves |= np.hypot(north - north[other], east - east[other]) > _REST_SPEED * np.abs(time - time[other])
    rest = ~moves
    if min(moves.sum(), rest.sum()) < _ENOUGH:
        return fixed
    at_rest, under_way = (white_std(time[rows], north[rows], east[rows]) for rows in (rest, moves))
    return fixed[moves] if at_rest < _HELD * under_way else fixed


_ENOUGH = 100
"""Rows from which their noise is known within a tenth: of white noise 100 fixes give it to 11 %, 50 to 16 % and 200 to
7 % (1σ of `white_std` in 400 records)."""


def excerpt(record: Rows, most, apart) -> Rows:
    """At most so many rows with fixes, up to `apart` seconds apart: thinned over the whole record or pieces of it.

    Thinned fixes determine motion as well as all do where its time constants are longer; bursts of all determine the
    rest. The phase of the thinned ones changes now and then, lest they be those of one of two receivers.
    """
    fixed = telling(record)
    n = len(fixed)
    if n <= most:
        return rows_of(record, fixed, np.empty(0, np.int64))
    burst = int(_IN_BURSTS * most / _BURSTS)
    coarse = most - _BURSTS * burst
    stride = max(1, min(math.ceil(n / coarse), int(apart / np.median(np.diff(record.time[fixed])) + 0.01)))
    if n <= coarse * stride:
        rows, restarts = np.arange(0, n, stride), np.empty(0, np.int64)
    else:
        span = coarse // _PIECES
        starts = np.linspace(0, n - span * stride, _PIECES).astype(int)
        rows = (starts[:, None] + np.arange(span) * stride).ravel()
        restarts = starts[1:]
    if stride > 1:
        phase = np.arange(len(rows)) // _IN_PHASE % stride
        phase[np.isin(rows, restarts)] = 0
        begins = rows[np.linspace(0, len(rows) - 1, _BURSTS + 2).astype(int)[1:-1]]
        bursts = (begins[:, None] + np.arange(burst)).clip(0, n - 1)
        rows = np.union1d((rows + phase).clip(0, n - 1), bursts)
    return rows_of(record, fixed[rows], np.searchsorted(rows, restarts))


def rows_of(record: Rows, rows, restarts) -> Rows:
    """Rows of a record, with restarts of its own and where a gap is long."""
    time = record.time[rows]
    intervals = np.diff(time)
    gaps = np.flatnonzero(intervals > max(_LONG, _LONG_FOR * np.median(intervals))) + 1
    excess = record.excess[rows] if len(record.excess) else record.excess
    aids = record.aids[rows] if len(record.aids) else record.aids
    return Rows(time, record.north[rows], record.east[rows], excess, aids, np.union1d(restarts, gaps))
