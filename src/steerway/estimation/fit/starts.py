"""Starting points of the search for a structure's numbers."""

import numpy as np

from steerway.estimation.filter.row import Rows
from steerway.estimation.fit.spectrum import periods_of
from steerway.estimation.log.record import usual_interval, white_std
from steerway.estimation.vessel.parts import PLAIN, Scales, Values
from steerway.estimation.vessel.structures import parameters_of

_RESOLVED = 2.0
"""Shortest period that fixes resolve, in usual intervals between them (the sampling theorem)."""
_HALVES = np.array(
    # Offsets of the plain structure's numbers, all but the first, from their prior medians, in half prior standard
    # deviations: of the fits to recorded logs and scenes the thirteen from which fits to the others climb farthest.
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
    # The same for manoeuvres that begin and end between two fixes: of the fits to simulated logs of pilot vessels,
    # ships and others, with fixes 20 s to 5 min apart, the three numbers with which the others are likeliest.
    [
        (0, 0, -3, 1, -3, 3, 3, -1, -1, 3, 5, 3, 7, 5, 1, 0, 0, 0, 0, 0),
        (0, 0, -2, -2, -2, -2, 4, 0, -1, 5, 3, 0, 7, 5, 2, 0, 3, 1, -1, -1),
        (0, 0, 0, -1, -4, 0, 1, -2, -3, 2, 1, 0, 4, 4, 2, 0, 1, 0, -1, 0),
    ]
)
_NOISES = np.array((1.1, 0.78, 1.1, 0.97, 0.38, 0.91, 0.59, 1.0, 1.1, 0.07, 1.6, 1.1, 0.92, 1.0, 1.0, 1.0))
"""The first number, the noise of a fix, of each start: as a ratio to the noise by third differences (`white_std`).
Motion makes this noise larger, and a receiver's filter makes it smaller."""


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
