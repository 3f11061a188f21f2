"""Preparation of a record for a fit: extrapolated fixes, a second receiver, white noise, and the rows to fit to."""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Bools, Floats, Ints
from steerway.estimation.filter.bank import LONGEST_STEP, steps_in
from steerway.estimation.filter.row import Rows
from steerway.estimation.log.copies import REST, REST_SPEED


def usual_interval(time: Floats) -> float:
    """Median (s) of the intervals between fixes at different times; 0 if all have one time."""
    intervals = np.diff(time)
    intervals = intervals[intervals > 0.0]
    return float(np.median(intervals)) if len(intervals) else 0.0


PERIODS, FEWEST_PERIODS = range(4, 11), 20
"""Periods (fixes) between a receiver's measurements that are tried, and least number of periods in a record. With
shorter periods every fix is a measurement or next to one."""
CORRECTED = 5.0
"""Least ratio of the deviation of measured fixes from even progress to that of extrapolated ones. In recorded logs it
is 14 and 18 for receivers that extrapolate, 1.0 to 3.0 for 28 others."""


def extrapolated(time: Floats, north: Floats, east: Floats) -> Bools:
    """(n,) bool: fixes that the receiver extrapolated; only every fourth to tenth fix is then a measurement.

    Extrapolated fixes carry no information beyond the fixes before them, and each measurement corrects them in one
    jump. Progress is therefore uneven at a fixed phase of the period.
    """
    usual = usual_interval(time)
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


class Measurements(NamedTuple):
    """Times of measurement of a receiver that extrapolates the fixes between: every `period` s, the last at `last`."""

    period: float
    last: float
    apart: float  # s between fixes

    def include(self, time: float) -> bool:
        """Whether a fix at this time (s) is a measurement."""
        since = time - self.last
        return abs(since - round(since / self.period) * self.period) < 0.5 * self.apart


def measurements(time: Floats, guessed: Bools) -> Measurements | None:
    """The times of measurement of a receiver whose fixes `guessed` (n, bool) are extrapolated; None if none is."""
    if not guessed.any():
        return None
    measured = time[~guessed]
    return Measurements(usual_interval(measured), float(measured[-1]), usual_interval(time))


def white_std(time: Floats, north: Floats, east: Floats) -> float:
    """Standard deviation (m) of the white part of a fix, by third differences of equally spaced fixes.

    The median of their lengths does not depend on turns, outliers or axes. The third difference of white noise has 20
    times its variance; the median of a chi-square with two degrees of freedom is 2 ln 2.
    """
    steps, usual = np.diff(time), usual_interval(time)
    even = np.abs(steps - usual) < 0.1 * usual
    even = even[2:] & even[1:-1] & even[:-2]
    if even.sum() < 20:
        return 0.3
    third = np.hypot(np.diff(north, 3)[even], np.diff(east, 3)[even])
    return max(float(np.median(third)) / math.sqrt(20.0 * 2.0 * math.log(2.0)), 1e-3)


_ANTENNAS, _SURE, _CHORD = 0.2, 6.0, 10
"""Least offset that shows two antennas, in m, and in standard errors; and number of intervals before and after a fix
over which its course is computed. Antennas nearer than 0.2 m, treated as one, change SOG by less than 0.02 m/s in a
turn of 10 °/s. The offset of a single receiver is up to 2.5 standard errors in scenes and 0.7 in 14 recorded logs; in a
table that repeats every fix it is 29, but only 7 mm. For two receivers 1.1 m apart it is 60."""
_OF_MEDIAN = 2.0
"""Standard error of the median of n departures, times √n over their σ: √(π/2) for a median, times √(8/3) because
successive departures, with alternating sign, share white noise."""


def of_other_receiver(time: Floats, north: Floats, east: Floats, digit: float = 0.0) -> Bools:
    """(n,) bool: fixes of the noisier of two receivers that alternate, if next to a fix of the other; else none.

    The midpoint of two antennas follows a different path in turns: its speed and course differ by the course rate times
    its offset. Departures of fixes from the line between their neighbours are the offset of one antenna from the other,
    forward and to starboard (real and imaginary part), with alternating sign. Rounding alone makes departures of up to
    the last digit (`digit`, m).
    """
    none, usual = np.zeros(len(time), bool), usual_interval(time)
    if usual <= 0.0:
        return none
    slot = np.round((time - time[0]) / usual).astype(np.int64)
    place = north + 1j * east
    at = np.arange(_CHORD, len(time) - _CHORD)
    chord = place[at + _CHORD] - place[at - _CHORD]
    beside = np.diff(slot) == 1
    even = beside[at - 1] & beside[at] & (chord != 0.0)
    at, chord = at[even], chord[even]
    if len(at) < _ENOUGH:
        return none
    odd = slot % 2 == 1
    share = (time[at] - time[at - 1]) / (time[at + 1] - time[at - 1])
    departure = place[at] - (1.0 - share) * place[at - 1] - share * place[at + 1]
    departure *= np.abs(chord) / chord
    departure[odd[at]] *= -1.0
    offset = np.median(departure.real) + 1j * np.median(departure.imag)
    deviation = np.median(np.abs(departure - offset)) / math.sqrt(_MEDIAN_OF_TWO)
    if abs(offset) < max(_ANTENNAS, digit, _SURE * _OF_MEDIAN * deviation / math.sqrt(len(at))):
        return none
    noisier = max(odd, ~odd, key=lambda rows: white_std(time[rows], north[rows], east[rows]))
    return noisier & (np.append(beside, False) | np.append(False, beside))


LONG, _LONG_FOR = 60.0, 5.0
"""A fit restarts after a gap of more than 60 s and 5 usual intervals: one fix after the gap determines no number."""
_PIECES, _BURSTS, _IN_BURSTS, _IN_PHASE = 8, 4, 0.25, 10
"""For a long record: number of pieces; number of bursts; share of the rows in bursts; rows between changes of phase."""


_HELD = 0.5
"""Ratio of the noise at rest to that under way below which the receiver holds or low-pass filters positions at rest.
Such fixes show nothing of the noise under way. Logs have 0 to 0.45 for such receivers, 0.6 to 1.2 for others."""


def telling(record: Rows) -> Ints:
    """Indices of the rows with fixes to fit to: without those at rest if the receiver holds positions there."""
    fixed = np.flatnonzero(np.isfinite(record.north))
    time, north, east = record.time[fixed], record.north[fixed], record.east[fixed]
    n = len(fixed)
    moves = np.zeros(n, bool)
    for other in (np.searchsorted(time, time - REST), np.searchsorted(time, time + REST)):
        other = other.clip(0, n - 1)
        moves |= np.hypot(north - north[other], east - east[other]) > REST_SPEED * np.abs(time - time[other])
    rest = ~moves
    if min(moves.sum(), rest.sum()) < _ENOUGH:
        return fixed
    at_rest, under_way = (white_std(time[rows], north[rows], east[rows]) for rows in (rest, moves))
    return fixed[moves] if at_rest < _HELD * under_way else fixed


_ENOUGH = 100
"""Least number of rows for an estimate of their noise: 1σ of `white_std` is 11 % with 100 fixes, 16 % with 50 and 7 %
with 200 (400 records of white noise)."""


def excerpt(record: Rows, most: int, apart: float) -> Rows:
    """About `most` rows: bursts of all fixes; and either means of fixes, fixes thinned to `apart` s, or pieces of the
    record.

    Means (of records without aids) and thinned fixes determine motion with longer time constants as well as all fixes
    do. If a receiver's random walk hides motion, fixes are thinned more. Bursts determine the rest. The phase of
    thinning changes now and then, so that not only one of two receivers is used.
    """
    fixed = telling(record)
    n = len(fixed)
    whole = restarting(rows_of(record, fixed, np.empty(0, np.int64)))
    if n <= most:
        return whole
    burst = int(_IN_BURSTS * most / _BURSTS)
    coarse = most - _BURSTS * burst
    begin = np.arange(n)
    if not np.isfinite(whole.aids).any():
        walk = walking(whole.time, whole.north, whole.east)
        apart = max(apart, walk)
        if not walk and not record.quantum[0]:  # a mean of rounded fixes lies in no cell
            begin = grouped(whole.time, whole.north, whole.east, coarse)
    groups, end = len(begin), np.append(begin[1:], n)
    interval = usual_interval(whole.time[begin])
    stride = max(1, min(math.ceil(groups / coarse), int(apart / interval + 0.01)))
    if groups == n and stride == 1:
        coarse = most
    if groups <= coarse * stride:
        rows, starts = np.arange(0, groups, stride), np.empty(0, np.int64)
    else:
        span = coarse // _PIECES
        starts = np.linspace(0, groups - span * stride, _PIECES).astype(int)
        rows = (starts[:, None] + np.arange(span) * stride).ravel()
    if stride > 1:
        phase = np.arange(len(rows)) // _IN_PHASE % stride
        phase[np.isin(rows, starts)] = 0
        rows = (rows + phase).clip(0, groups - 1)
    if stride == 1 and groups == n:
        return restarting(rows_of(record, fixed[rows], np.searchsorted(rows, starts[1:])))
    bursts = begin[rows[np.linspace(0, len(rows) - 1, _BURSTS + 2).astype(int)[1:-1]]]
    alone = np.zeros(n + 1, bool)
    alone[(bursts[:, None] + np.arange(burst)).clip(0, n - 1)] = True
    before = np.append(0, np.cumsum(alone))
    apart_of_bursts = rows[before[end[rows]] == before[begin[rows]]]
    singles = np.flatnonzero(alone)
    first = np.append(begin[apart_of_bursts], singles)
    order = np.argsort(first)
    first, last = first[order], np.append(end[apart_of_bursts], singles + 1)[order]
    return restarting(means(whole, first, last, np.searchsorted(first, begin[starts[1:]])))


_WHITE = 1.5
"""Largest ratio, either way, of the variance of means to that of means of white noise. In scenes the means of eight
pairs have a ratio of 1 to 1.2 with white noise, and of 1.7 and more where receivers filter."""
_STRAIGHT = 13.28
"""99 % quantile of a chi-square with four degrees of freedom: above it, four means do not lie in a line."""
_MEDIAN, _MEDIAN_OF_TWO = 3.357, 2.0 * math.log(2.0)
"""Medians of a chi-square with four and with two degrees of freedom."""


def grouped(time: Floats, north: Floats, east: Floats, most: int) -> Ints:
    """Index of the first fix of every group; a group has as many fixes (1, 2, 4 …) as its mean can represent.

    If four successive groups lie evenly on a line, within white noise, the first two and the last two are joined. This
    ends at `most` groups, or when the groups of the whole record scatter more or less than white noise.
    """
    n, length = len(time), 1
    begin = np.arange(n)
    noise, usual = white_std(time, north, east), usual_interval(time)
    while len(begin) > most:
        lengths = np.diff(begin, append=n)
        q = np.flatnonzero(np.append(begin, n)[4:] - begin[:-3] == 4 * length)
        q = q[begin[q] % (4 * length) == 0]
        moment, mean_north, mean_east = (np.add.reduceat(each, begin) / lengths for each in (time, north, east))
        q, second, third = departures(moment, mean_north, mean_east, q, length * usual)
        if len(q) < _ENOUGH / 4:
            break
        off = (second + third) * length / noise**2
        if not 1.0 / _WHITE < np.median(off) / _MEDIAN < _WHITE:
            break
        q = q[off < _STRAIGHT]
        begin = np.delete(begin, np.append(q + 1, q + 3))
        length *= 2
    return begin


def departures(time: Floats, north: Floats, east: Floats, first: Ints, interval: float) -> tuple[Ints, Floats, Floats]:
    """The rows of `first` that begin four evenly spaced positions, and their squared second and third differences.

    Both (m², north and east added) are scaled so that white noise has its own variance as expectation.
    """
    even = [np.abs(time[first + i + 1] - time[first + i] - interval) < 0.1 * interval for i in range(3)]
    first = first[np.all(even, axis=0)]
    second, third = np.zeros((2, len(first)))
    for each in (north, east):
        a, b, c, d = (each[first + i] for i in range(4))
        second += 0.25 * (a - b - c + d) ** 2
        third += 0.05 * (3.0 * (b - c) - a + d) ** 2
    return first, second, third


_WALKS = math.sqrt(5.0 / 3.0), math.sqrt(25.0 / 3.0)
"""Bounds of the ratio of second to third differences that shows a random walk. The ratio is 5/3 for a random walk, 1
for white noise, 5 for a random walk of the speed; the bounds are the geometric means between them."""
_OFF = 0.02
"""Largest share of groups of four fixes that do not lie in a line: 0.01 for a random walk, 0.05 and more in scenes and
recorded logs without one."""


def walking(time: Floats, north: Floats, east: Floats) -> float:
    """Interval (s) up to which a receiver's random walk hides departures of the track from a line; 0 without one.

    With white noise, more fixes determine more. With a random walk, fixes every few seconds determine slow motion as
    well as all fixes do, and over a longer piece they determine the receiver's slow error too.
    """
    usual = usual_interval(time)
    stride = 1
    while stride * usual < LONGEST_STEP:
        thinned = time[::stride], north[::stride], east[::stride]
        _, second, third = departures(*thinned, np.arange(max(len(thinned[0]) - 3, 0)), stride * usual)
        if len(second) < _ENOUGH:
            break
        levels = np.median(second), np.median(third)
        if not _WALKS[0] * levels[1] < levels[0] < _WALKS[1] * levels[1]:
            break
        off = _MEDIAN_OF_TWO * (second / levels[0] + third / levels[1]) > _STRAIGHT
        if off.mean() > _OFF:
            break
        stride *= 2
    return min(stride * usual, LONGEST_STEP) if stride > 2 else 0.0


def means(record: Rows, first: Ints, last: Ints, restarts: Ints) -> Rows:
    """Means of the groups of fixes from `first` to before `last`; aids are those of each group's first row."""
    lengths = last - first

    def mean(each: Floats) -> Floats:
        total = np.append(0.0, np.cumsum(each - each[0]))
        return each[0] + (total[last] - total[first]) / lengths

    excess = mean(record.excess) / lengths if len(record.excess) else 1.0 / lengths
    firsts = rows_of(record, first, restarts)
    return firsts._replace(time=mean(record.time), north=mean(record.north), east=mean(record.east), excess=excess)


def rows_of(record: Rows, rows: Ints | slice, restarts: Ints) -> Rows:
    """A copy of these rows of a record, which restarts at `restarts`."""
    columns = {name: getattr(record, name) for name in Rows._fields[:5]}
    taken = {name: each[rows].copy() if len(each) else each for name, each in columns.items()}
    return record._replace(**taken, restarts=restarts)


def part_of(record: Rows, begin: int, end: int) -> Rows:
    """A copy of the rows from `begin` to before `end`."""
    within = (record.restarts >= begin) & (record.restarts < end)
    return rows_of(record, slice(begin, end), record.restarts[within] - begin)


def restarting(record: Rows) -> Rows:
    """The record, which restarts after long gaps too."""
    gaps = np.flatnonzero(np.diff(record.time) > max(LONG, _LONG_FOR * usual_interval(record.time))) + 1
    return record._replace(restarts=np.union1d(record.restarts, gaps))


def predictions(record: Rows) -> Ints:
    """Number of predictions from each row to the next, (n - 1,)."""
    intervals = np.diff(record.time)
    intervals[record.restarts - 1] = 0.0
    different, places = np.unique(intervals, return_inverse=True)  # a receiver has few different intervals
    return np.array([steps_in(interval) for interval in different], np.int64)[places]
