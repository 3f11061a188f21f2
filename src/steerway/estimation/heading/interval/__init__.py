"""Intervals: arithmetic that never loses the true value, and Kalman filters on it."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.estimation.heading.interval.arithmetic import (
        add,
        at,
        divide,
        entry,
        matrix_multiply,
        matrix_multiply_transposed,
        multiply,
        outward_radians,
        point,
        put,
        put_entry,
        scale,
        sound,
        subtract,
    )
    from steerway.estimation.heading.interval.filter import IntervalFilter, box_of, sub_boxes

__all__ = [
    "IntervalFilter",
    "add",
    "at",
    "box_of",
    "divide",
    "entry",
    "matrix_multiply",
    "matrix_multiply_transposed",
    "multiply",
    "outward_radians",
    "point",
    "put",
    "put_entry",
    "scale",
    "sound",
    "sub_boxes",
    "subtract",
]
__getattr__, __dir__ = on_demand(__name__)
