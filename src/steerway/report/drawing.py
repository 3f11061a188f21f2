"""Shared by all charts: colours, thinning of tables, and the axis of a course over time."""

from typing import TypeVar

import numpy as np

from steerway.core.records import Record

OURS, THEIRS, BAD, QUIET = "#0072b2", "#d55e00", "#a4262c", "#9aa5b1"
"""Colours of estimate, receiver, rejected or missed, undefined. The first two suit the colour-blind (Okabe and Ito)."""
R = TypeVar("R", bound=Record)


def thinned(table: R, most: int) -> R:
    """Every k-th row of a table, so that at most `most` are left."""
    return table.rows(slice(None, None, max(1, -(-len(table) // most))))


def course_cut(*courses: np.ndarray) -> float:
    """The least frequent course (degrees). An axis that is cut there breaks the line least often."""
    values = np.concatenate([np.degrees(each[np.isfinite(each)]) for each in courses])
    counts, edges = np.histogram(np.mod(values, 360.0), 36, (0.0, 360.0))
    around = np.sum([np.roll(counts, shift) for shift in range(-2, 3)], axis=0)
    fewest = np.flatnonzero(around == around.min())
    runs = np.split(fewest, np.flatnonzero(np.diff(fewest) > 1) + 1)
    widest = max(runs, key=len)
    return float(edges[widest[len(widest) // 2]])


def on_axis(course: np.ndarray, cut: float) -> np.ndarray:
    """Courses (rad, (n,)) in degrees from `cut` to `cut` + 360."""
    return cut + np.mod(np.degrees(course) - cut, 360.0)


def broken(degrees: np.ndarray) -> np.ndarray:
    """The values with NaN at each jump over the cut, so that no line crosses the whole chart."""
    jump = np.abs(np.diff(degrees, prepend=degrees[:1])) > 180.0
    return np.where(jump, np.nan, degrees)
