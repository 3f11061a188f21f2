"""IntervalFilter: bounds that hold the estimate of every Kalman filter whose compass lies in a box.

They bound estimates, not the heading: the true heading lies where the filter with the true compass errs little.
"""

import math

import numpy as np

from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.estimation.heading.composite import A1, A2, SHIFT, START_VARIANCE, B, K
from steerway.estimation.heading.interval import sharpened
from steerway.estimation.heading.interval.arithmetic import outward_radians, sound
from steerway.sensors.tcm2 import STATE_VARIANCE, TICKS

WIDEST = 1e6
"""Degrees: bounds further apart say nothing and count as diverged."""


def box_of(model: np.ndarray, tolerance: float, shift_too: bool = False) -> np.ndarray:
    """(14, 2) box of a `composite_model` whose compass coefficients are known to ± tolerance; the rest is exact."""
    if not 0.0 <= tolerance < 1.0:
        raise InputError(f"box.tolerance is {tolerance}, expected 0 to 1")
    box = np.stack([model, model], axis=1)
    for i in (A1, A2, B, K, *((SHIFT,) if shift_too else ())):
        box[i] = model[i] * (1.0 - tolerance), model[i] * (1.0 + tolerance)
        box[i] = np.nextafter(box[i], (-math.inf, math.inf)) if tolerance else model[i]
    return box


def sub_boxes(box: np.ndarray, parts: int) -> np.ndarray:
    """(parts², 14, 2): the box cut along a1 and a2, which the bounds depend on most; together they are the box."""
    cuts = [np.linspace(*box[i], parts + 1) for i in (A1, A2)]
    boxes = np.repeat(box[None], parts * parts, axis=0)
    for n in range(parts * parts):
        for i, cut, part in zip((A1, A2), cuts, divmod(n, parts), strict=True):
            boxes[n, i] = cut[part : part + 2]
    return boxes


class IntervalFilter:
    """Bounds of the heading (rad) over a box of compasses, second by second.

    Args:
        box: (14, 2) from `box_of`.
        parts: cut a1 and a2 into so many parts each; the bounds are the hull over all sub-boxes.
        vehicle_variance: of each vehicle state at first.

    `low`, `high` bound the heading for the second that begins. `diverged` tells that bounds are lost: they are NaN from
    then on, never clipped.
    """

    def __init__(self, box: np.ndarray, *, parts: int = 1, vehicle_variance: float = START_VARIANCE):
        self._boxes = sub_boxes(box, parts) if parts > 1 else box[None].copy()
        n = len(self._boxes)
        self._states = np.zeros((n, 4, 2))
        self._covariances = np.empty((n, 4, 4, 2))
        self._frames = np.array([sharpened.coordinates(each) for each in self._boxes])
        start(self._covariances, self._boxes, self._frames, vehicle_variance, STATE_VARIANCE)
        self.low = self.high = 0.0
        self.diverged = False

    @property
    def width(self) -> float:
        """rad; NaN once diverged."""
        return self.high - self.low

    def second(self, difference: float, readings) -> tuple[float, float]:
        """Take (40,) readings (rad) and go one second on with n_d (rad/s); returns (low, high), rad."""
        if not self.diverged:
            degrees = np.degrees(readings)
            low, high = second(
                self._states,
                self._covariances,
                self._boxes,
                self._frames,
                difference,
                degrees,
            )
            self.diverged = not (high - low <= WIDEST)
            self.low, self.high = (math.nan, math.nan) if self.diverged else outward_radians(low, high)
        return self.low, self.high


@kernel
def start(covariances, boxes, frames, vehicle_variance, compass_variance):
    for n in range(len(boxes)):
        sharpened.start(covariances[n], boxes[n], frames[n], vehicle_variance, compass_variance)


@kernel
def second(states, covariances, boxes, frames, difference, readings_deg):
    """A second of every sub-box; (low, high) of the heading in degrees, NaN once one of them has lost its bounds."""
    low, high = math.inf, -math.inf
    for n in range(len(boxes)):
        x, p, box = states[n], covariances[n], boxes[n]
        for k in range(TICKS):
            sharpened.tick(x, p, box, frames[n], readings_deg[k])
            if not holds(x, p):
                return math.nan, math.nan
        sharpened.predict_vehicle(x, p, box, frames[n], difference)
        own = sharpened.heading(x)
        low, high = min(low, own[0]), max(high, own[1])
    return low, high


@kernel
def holds(x, p):
    """Whether every bound is a number: quotients by intervals that hold 0 are not."""
    for i in range(4):
        if not sound((x[i, 0], x[i, 1])) or not sound((p[i, i, 0], p[i, i, 1])):
            return False
    return True
