"""Starting points of the search for a structure's numbers, and the scales of a record that they depend on.

Periods of oscillations are found in the spectrum of the velocity along and across the track.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.estimation.filter.row import Rows
from steerway.estimation.log.course import STEERAGEWAY
from steerway.estimation.log.record import usual_interval, white_std
from steerway.estimation.vessel.parts import PLAIN, UNKNOWN_PERIODS, Scales, Values
from steerway.estimation.vessel.structures import parameters_of

_RESOLVED = 2.0
"""Shortest period that fixes resolve, in usual intervals between them (the sampling theorem)."""
_HALVES = np.array(
    # Offsets of the plain structure's numbers, all but the first, from their prior medians, in half prior standard
    # deviations: the thirteen fits to recorded logs and scenes from which fits to the others climb farthest.
    [
    (-1, 0, -1, 0, 1, 2, 0, 5, 0, -1, 0, 0, 2, -2, 1, 2, 2, 0, 1, -1),
    (3, -1, -1, 5, -2, 2, 1, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 0, 3, -5),
    (-1, 0, -2, -1, 0, -2, -1, -1, 0, 2, 0, 0, -1, -1, 2, -2, -2, 1, -2, 1),
    (0, -2, -1, 6, 1, 0, 0, 6, 0, -3, 0, 1, 2, -2, 0, 8, 0, 0, 4, -8),
    (-1, 2, -1, 0, 1, 2, 0, 5, 0, -1, -1, 0, 1, -3, 0, 4, 3, 0, 3, -3),
    (-1, 0, 0, 0, 2, 1, 0, 5, 0, -1, -3, 1, 0, -1, 1, 0, 2, 1, -1, 0),
    (5, -2, -1, 0, 1, 1, -1, 5, 0, 0, -2, 0, 0, -6, 0, 8, 0, 0, 3, -5),
    (3, -1, -1, 1, -2, 3, -1, 2, -4, 1, -1, 0, 0, 1, 0, 0, -2, 0, -2, -2),
    (5, -3, 2, 1, 2, 0, 2, 0, 0, 0, 0, -1, 4, -1, 0, 4, 0, -5, 3, -7),
    (-1, -1, -1, 4, 1, 0, -1, 5, 0, -2, -1, 0, 1, -5, 0, 4, 0, 0, 2, -3),
    (1, -1, 3, 4, -1, 2, -1, 0, 0, -1, -1, 0, 0, -5, -4, 4, 2, 3, 3, -3),
    (-1, 0, -1, -1, 1, 1, -1, -1, 0, -2, -2, 0, -1, 0, 0, -1, -2, 0, -1, -1),
    (0, 0, 0, -2, -4, 6, 1, -1, -2, -1, 0, -4, 0, 2, 3, 0, 2, 1, -1, -1),
    ]
)  # fmt: skip
_FAR_HALVES = np.array(
    # The same for manoeuvres that begin and end between two fixes: three fits to simulated logs of pilot vessels,
    # ships and others, with fixes 20 s to 5 min apart. Under these three, the other logs are likeliest.
    [
        (0, 0, -3, 1, -3, 3, 3, -1, -1, 3, 5, 3, 7, 5, 1, 0, 0, 0, 0, 0),
        (0, 0, -2, -2, -2, -2, 4, 0, -1, 5, 3, 0, 7, 5, 2, 0, 3, 1, -1, -1),
        (0, 0, 0, -1, -4, 0, 1, -2, -3, 2, 1, 0, 4, 4, 2, 0, 1, 0, -1, 0),
    ]
)
_NOISES = np.array((1.1, 0.78, 1.1, 0.97, 0.38, 0.91, 0.59, 1.0, 1.1, 0.07, 1.6, 1.1, 0.92, 1.0, 1.0, 1.0))
"""The first number, the noise of a fix, of each start: as a ratio to the noise by third differences (`white_std`).
Motion makes this noise larger, and a receiver's filter makes it smaller."""

_SPAN, _FEWEST = 100.0, 32
"""Length (s) of a segment, and its least number of fixes. 100 s resolve a period of 5 s to a quarter of a second."""
_SMOOTH = 4.0
"""Time, s, on either side over which velocity is averaged to define the track. Slower variation is treated as motion of
the vessel. The time is half the period of usual waves."""
_COMPLETE = 0.7
"""Least share of its fixes that a segment must have."""
_SHORTEST, _LONGEST = 1.4, 40.0
"""Range (s) of the periods: from the roll of small craft to the longest swell in following seas."""
_MOST, _BESIDE = 3, 6
"""Most periods in a direction; least number of frequencies on either side of a line; their median is its background."""


def scales_of(record: Rows) -> Scales:
    """The scales of a record with at least a few fixes."""
    fixed = np.isfinite(record.north)
    places = record.time[fixed], record.north[fixed], record.east[fixed]
    shortest = _RESOLVED * usual_interval(places[0])
    return Scales(white_std(*places), shortest, *periods_of(*places))


def vessels(noise: float, far: bool = False) -> list[Values]:
    """Starting points of the plain structure, for a receiver of this noise (m).

    far: include those for fixes far apart.
    """
    names, medians, deviations = parameters_of(PLAIN)
    halves = np.vstack((_HALVES, _FAR_HALVES)) if far else _HALVES
    others = np.exp(medians[1:] + 0.5 * deviations[1:] * halves)
    noises = noise * _NOISES[: len(halves)]
    return [dict(zip(names, each, strict=True)) for each in np.column_stack([noises, others]).tolist()]


class Periods(NamedTuple):
    """Periods (s) of the strongest lines along and across the track, the strongest first."""

    along: tuple[float, ...]
    across: tuple[float, ...]


def periods_of(time: Floats, north: Floats, east: Floats) -> Periods:
    """The periods that stand out. Spectra of segments that overlap by half are averaged (P. D. Welch, IEEE Trans. Audio
    and Electroacoustics 15(2), 1967), as logarithms, so that no segment outweighs the others.

    Args:
        time: (n,) s, ascends. north, east: (n,) m.
    """
    step = usual_interval(time)
    n = int(_SPAN / step)
    if n < _FEWEST:
        return Periods(UNKNOWN_PERIODS, UNKNOWN_PERIODS)
    width = int(_SMOOTH / step)
    window, mean = np.hanning(n)[:, None], np.ones(2 * width + 1) / (2 * width + 1)
    moment = np.linspace(-1.0, 1.0, n)
    total, segments, begin = np.zeros((n // 2 + 1, 2)), 0, time[0]
    while begin + n * step <= time[-1]:
        even = begin + step * np.arange(n + 1)
        first, last = np.searchsorted(time, even[[0, -1]])
        begin = max(even[n // 2], time[first])
        if last - first < _COMPLETE * n:
            continue
        fixes = slice(max(first - 1, 0), last + 1)
        place = np.interp(even, time[fixes], north[fixes]) + 1j * np.interp(even, time[fixes], east[fixes])
        velocity = np.diff(place) / step
        usual = np.convolve(np.pad(velocity, width, mode="edge"), mean, "valid")
        speed, course = np.abs(usual), np.unwrap(np.angle(usual))
        if np.median(speed) < STEERAGEWAY:  # at rest
            continue
        quick = (velocity - usual) * np.exp(-1j * course)
        both = np.column_stack((quick.real + speed, quick.imag + np.median(speed) * course))
        both -= np.vander(moment, 2) @ np.polyfit(moment, both, 1)  # without a steady acceleration and turn
        power = np.abs(np.fft.rfft(window * both, axis=0)) ** 2
        total += np.log(power + 1e-6 * power.max(axis=0) + 1e-12)
        segments += 1
    if not segments:
        return Periods(UNKNOWN_PERIODS, UNKNOWN_PERIODS)
    return Periods(*(_lines(each / segments, np.fft.rfftfreq(n, step)) for each in total.T))


def _lines(power: Floats, frequency: NDArray[np.floating]) -> tuple[float, ...]:
    """The periods (s) at which a log spectrum exceeds its background most."""
    low, high = np.searchsorted(frequency, [1.0 / _LONGEST, min(1.0 / _SHORTEST, frequency[-1])])
    low -= 1  # a peak is higher than both beside it
    beside = [max(_BESIDE, i // 2) for i in range(high)]
    around = [np.median(power[max(low, i - b) : min(high, i + b + 1)]) for i, b in enumerate(beside[low:], low)]
    excess = power[low:high] - around
    peak = 1 + np.flatnonzero((excess[1:-1] >= excess[:-2]) & (excess[1:-1] >= excess[2:]))
    peak = peak[np.argsort(-excess[peak])][:_MOST]
    return tuple((1.0 / frequency[low + peak]).tolist()) or UNKNOWN_PERIODS
