"""Step responses of a boat to orders: settling time and overshoot of course and speed."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap, wrap_array
from steerway.core.checks import array_of
from steerway.guidance.ordered import Order
from steerway.simulation.loop import Run

COURSE_BAND = 0.05
"""Settling band, as a fraction of the step of the course."""
SPEED_BAND = 0.02
"""Settling band, as a fraction of the ordered speed; P3."""


def settling(time: ArrayLike, error: ArrayLike, band: float) -> float:
    """Time (s) from the first row to the last exit from ±`band`; infinite if the error is outside at the end.

    time and error: (n,). Raises InputError for other shapes.
    """
    time = array_of("time", time, (None,))
    error = array_of("error", error, (len(time),))
    outside = np.flatnonzero(~(np.abs(error) <= band))
    if len(outside) == 0:
        return 0.0
    last = outside[-1]
    return math.inf if last == len(time) - 1 else float(time[last + 1] - time[0])


def responses(run: Run, orders: Sequence[Order]) -> dict[str, float]:
    """`settling_s` and `overshoot_pct`, the worst of all steps, and the settling time at each ordered speed.

    The course (or heading, if the boat steers by heading) settles to 5 % of its step, and the overshoot is in percent
    of the step. The speed settles to 2 % of the ordered speed.
    """
    numbers: dict[str, float] = {}
    settled, overshoots = [], []
    for rows, before, order in _steps(run, orders):
        time = run.time[rows]
        step = wrap(order.course - before.course)
        if step != 0.0:
            by_course = run["by_course"][rows] > 0.0
            error = wrap_array(np.where(by_course, run.true_cog[rows], run["true_heading"][rows]) - order.course)
            settled.append(settling(time, error, COURSE_BAND * abs(step)))
            overshoots.append(float(np.nanmax(error / step)))
        if math.isfinite(order.speed) and order.speed not in (0.0, before.speed):
            error = run.true_sog[rows] / order.speed - 1.0
            key = f"settling_s_{order.speed:g}"
            settled.append(settling(time, error, SPEED_BAND))
            numbers[key] = max(settled[-1], numbers.get(key, 0.0))
            overshoots.append(float(error.max() if order.speed > run.true_sog[rows][0] else -error.min()))
    if settled:
        numbers["settling_s"] = max(settled)
        numbers["overshoot_pct"] = 100.0 * max(0.0, *overshoots)
    return numbers


def _steps(run: Run, orders: Sequence[Order]) -> Iterator[tuple[slice, Order, Order]]:
    """(rows, order before, order) of every order whose time was reached."""
    whole = [Order(0.0, float(run["true_heading"][0])), *orders, Order(math.inf)]
    ends = np.searchsorted(run.time, [each.time - 1e-9 for each in whole])
    for k, (before, order) in enumerate(pairwise(whole[:-1]), 1):
        if ends[k] < len(run):
            yield slice(ends[k], ends[k + 1]), before, order
