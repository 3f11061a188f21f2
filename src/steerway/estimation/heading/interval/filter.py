"""IntervalFilter: bounds of the estimates of all Kalman filters whose compass lies in a box.

The true heading may lie outside the bounds by the error of the filter with the true compass.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.estimation.heading.composite import AT, PARAMETERS, START_VARIANCE, checked_model, stepped
from steerway.estimation.heading.interval import sharpened
from steerway.estimation.heading.interval.arithmetic import outward_radians, sound
from steerway.estimation.heading.models import STATE_VARIANCE
from steerway.estimation.heading.readings import Ticks, checked_difference

WIDEST = 1e6
"""Width of the bounds, deg, above which they have diverged: 2,800 turns."""


def box_of(model: ArrayLike, tolerance: float, shift_too: bool = False) -> Floats:
    """(14, 2) box of a `composite_model` whose compass coefficients are known to ± tolerance; the rest is exact."""
    model = checked_model(model)
    if not 0.0 <= tolerance < 1.0:
        raise InputError(f"box.tolerance is {tolerance}, expected 0 to 1")
    box = np.stack([model, model], axis=1)
    for i in (AT.a1, AT.a2, AT.b, AT.k, *((AT.shift,) if shift_too else ())):
        box[i] = model[i] * (1.0 - tolerance), model[i] * (1.0 + tolerance)
        box[i] = np.nextafter(box[i], (-math.inf, math.inf)) if tolerance else model[i]
    return box


def sub_boxes(box: Floats, parts: int) -> Floats:
    """(parts², 14, 2) sub-boxes: the box cut along a1 and a2, on which the bounds depend most."""
    cuts = [np.linspace(box[i, 0], box[i, 1], parts + 1) for i in (AT.a1, AT.a2)]
    boxes = np.repeat(box[None], parts * parts, axis=0)
    for n in range(parts * parts):
        for i, cut, part in zip((AT.a1, AT.a2), cuts, divmod(n, parts), strict=True):
            boxes[n, i] = cut[part : part + 2]
    return boxes


class IntervalFilter:
    """Bounds of the heading (rad) over a box of compasses, step by step.

    Args:
        box: (14, 2) from `box_of`.
        parts: number of parts into which each of a1 and a2 is cut; the bounds are the hull over all sub-boxes.
        vehicle_variance: of each vehicle state at the start.

    `low`, `high` bound the heading at the end of the last step. After `diverged` they are NaN, never clipped. Raises
    InputError for parts below 1 and a box of another shape, with a low above its high, or whose vehicle is not exact.
    """

    def __init__(self, box: ArrayLike, *, parts: int = 1, vehicle_variance: float = START_VARIANCE) -> None:
        if parts < 1:
            raise InputError(f"interval.parts is {parts}, expected 1 or more")
        box = _checked_box(box)
        self._boxes = sub_boxes(box, parts) if parts > 1 else box[None].copy()
        n = len(self._boxes)
        self._states = np.zeros((n, 4, 2))
        self._covariances = np.empty((n, 4, 4, 2))
        self._frames = np.array([sharpened.coordinates(each) for each in self._boxes])
        start(self._covariances, self._boxes, self._frames, vehicle_variance, STATE_VARIANCE)
        self.low = self.high = 0.0
        self.diverged = False
        self._ticks = Ticks()

    @property
    def width(self) -> float:
        """Distance of the bounds, rad; NaN once diverged."""
        return self.high - self.low

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> tuple[float, float]:
        """As `CompositeFilter.step`; returns (low, high), rad."""
        difference = checked_difference(difference)
        for part, table in self._ticks.parts(dt, readings, times):
            if not self.diverged:
                self._advance(difference, part, table)
        return self.low, self.high

    def _advance(self, difference: float, part: float, table: Floats) -> None:
        boxes = self._boxes if part == 1.0 else np.array([_stepped_box(box, part) for box in self._boxes])
        low, high = advance(self._states, self._covariances, boxes, self._frames, difference, table)
        self.diverged = not (high - low <= WIDEST)
        self.low, self.high = (math.nan, math.nan) if self.diverged else outward_radians(low, high)


def _checked_box(box: ArrayLike) -> Floats:
    array = np.array(box, dtype=np.float64)
    if array.shape != (PARAMETERS, 2):
        raise InputError(f"interval.box has shape {array.shape}, expected ({PARAMETERS}, 2) bounds, low and high")
    for i, (low, high) in enumerate(array):
        if not low <= high:  # NaN included
            raise InputError(f"interval.box[{i}] is {low:g} to {high:g}, expected numbers, low at most high")
    exact = array[AT.pole : AT.input + 2]
    if not (exact[:, 0] == exact[:, 1]).all():
        raise InputError("interval.box bounds the vehicle's poles and inputs, expected exact numbers, as box_of gives")
    return array


def _stepped_box(box: Floats, step: float) -> Floats:
    """`composite.stepped` for a box, whose vehicle is exact: the same numbers as in the filters of the box."""
    return np.stack([stepped(box[:, 0], step), stepped(box[:, 1], step)], axis=1)


@kernel
def start(covariances: Floats, boxes: Floats, frames: Floats, vehicle_variance: float, compass_variance: float) -> None:
    for n in range(len(boxes)):
        sharpened.start(covariances[n], boxes[n], frames[n], vehicle_variance, compass_variance)


@kernel
def advance(
    states: Floats, covariances: Floats, boxes: Floats, frames: Floats, difference: float, readings: Floats
) -> tuple[float, float]:
    """Step every sub-box by a table of readings (2, ticks). Returns (low, high) of the heading in degrees, NaN once a
    sub-box has lost its bounds."""
    low, high = math.inf, -math.inf
    for n in range(len(boxes)):
        x, p, box = states[n], covariances[n], boxes[n]
        for k in range(readings.shape[1]):
            sharpened.tick(x, p, box, frames[n], readings[0, k], readings[1, k])
            if not holds(x, p):
                return math.nan, math.nan
        sharpened.predict_vehicle(x, p, box, frames[n], difference)
        own = sharpened.heading(x)
        low, high = min(low, own[0]), max(high, own[1])
    return low, high


@kernel
def holds(x: Floats, p: Floats) -> bool:
    """Whether every bound is finite: quotients by intervals that contain 0 are not."""
    for i in range(4):
        if not sound((x[i, 0], x[i, 1])) or not sound((p[i, i, 0], p[i, i, 1])):
            return False
    return True
