"""Compass readings of any number, rate and order, sorted into the ticks at which the compass model runs.

The model of P4 (5)–(8) is discrete, with a pole on the negative axis: between its ticks of 1/40 s it is not defined. A
reading therefore belongs to the tick nearest to its time, and a tick may have no, one or several readings. Several
count as their mean, with the variance of one reading over their number, as if a Kalman filter took them one by one.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats, Ints
from steerway.core.checks import array_of, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.estimation.heading.models import TICK

LARGEST_READING = 1e6
"""Largest reading, rad, including the turns that it counts. At 10 °/s a boat reaches it in two months."""
LARGEST_DIFFERENCE = 1e3
"""Largest propeller difference, rad/s, 10,000 revolutions a minute: no propeller turns faster."""
LONGEST_STEP = 3600.0
"""Longest step, s: the heading of an hour ago does not predict that of now."""
_LONGEST_PART = 1.0
"""Longest time (s) for which the heading is held while the compass runs, as in P4."""


class Ticks:
    """The ticks of one compass, and the readings that wait for the next tick."""

    def __init__(self) -> None:
        self._since_tick = 0.0  # s from the last tick to now
        self._waiting = np.empty(0)

    def parts(
        self, dt: float, readings: ArrayLike | None, times: ArrayLike | None = None
    ) -> Iterator[tuple[float, Floats]]:
        """Split a step of dt s into parts of 1 s at most: (length in s, table) of each.

        Args:
            dt: s, above 0.
            readings: (n,) rad, in any order; NaN and None for none.
            times: (n,) s from the beginning of the step, 0 to dt; None for evenly spread, the last at its end.

        A table is (2, ticks): mean reading (deg, NaN where there is none) and number of readings.

        Raises InputError, before anything has changed, for a dt that is not positive or longer than an hour, arrays of
        other shapes, readings beyond 1e6 rad and times outside the step.
        """
        if positive("heading.dt", dt) > LONGEST_STEP:
            raise InputError(f"heading.dt is {dt:g} s, expected at most {LONGEST_STEP:g}")
        degrees, times = _checked(dt, readings, times)
        table = self._table(dt, degrees, times)
        parts = math.ceil(dt / _LONGEST_PART)
        edges = [round(table.shape[1] * part / parts) for part in range(parts + 1)]
        return ((dt / parts, table[:, edges[i] : edges[i + 1]]) for i in range(parts))

    def _table(self, dt: float, degrees: Floats, times: Floats) -> Floats:
        count = round((self._since_tick + dt) / TICK)
        ticks = np.rint((self._since_tick + times) / TICK)
        self._since_tick += dt - count * TICK
        if len(self._waiting):
            degrees = np.concatenate([self._waiting, degrees])
            ticks = np.concatenate([np.zeros(len(self._waiting)), ticks])
        self._waiting = degrees[:0] if count else degrees
        table = np.zeros((2, count))
        table[0] = math.nan
        if count:
            _gather(np.minimum(np.maximum(ticks - 1.0, 0.0), count - 1.0).astype(np.int64), degrees, table)
        return table


@kernel
def _gather(columns: Ints, degrees: Floats, table: Floats) -> None:
    """Means and numbers of the readings of each tick; readings a turn apart are one direction."""
    for k in range(len(degrees)):
        cell = table[:, columns[k]]
        if cell[1] == 0.0:
            cell[0] = degrees[k]
        else:
            apart = degrees[k] - cell[0]
            cell[0] += (apart - 360.0 * round(apart / 360.0)) / (cell[1] + 1.0)
        cell[1] += 1.0


def _checked(dt: float, readings: ArrayLike | None, times: ArrayLike | None) -> tuple[Floats, Floats]:
    """Known readings in degrees and their times."""
    values = array_of("heading.readings", [] if readings is None else readings, (None,))
    known = np.isfinite(values)
    if times is None:
        stamps = dt / max(len(values), 1) * np.arange(1.0, len(values) + 1.0)
    else:
        stamps = array_of("heading.times", times, (None,))
        if len(stamps) != len(values):
            raise InputError(f"heading.times has {len(stamps)} values, expected {len(values)} as readings has")
        known &= ~np.isnan(stamps)
        outside = known & ((stamps < 0.0) | (stamps > dt * (1.0 + 1e-9)))
        if outside.any():
            raise InputError(
                f"heading.times has {stamps[outside][0]:g} s, expected 0 to {dt:g}, the length of the step"
            )
    values, stamps = values[known], stamps[known]
    largest = np.abs(values).max(initial=0.0)
    if largest > LARGEST_READING:
        raise InputError(f"heading.readings has {largest:g} rad, expected at most {LARGEST_READING:g}")
    return np.degrees(values), stamps


def checked_difference(value: float) -> float:
    """A propeller difference (rad/s) as a float; raises InputError unless it is a number within ± 1000."""
    if not abs(value) <= LARGEST_DIFFERENCE:  # NaN included
        raise InputError(f"heading.difference is {value:g} rad/s, expected a number within ± {LARGEST_DIFFERENCE:g}")
    return float(value)
