"""Errors of many runs as one number with an interval: a run is one draw, the rows within it are not."""

import math
from typing import NamedTuple

import numpy as np

from steerway.core import wrap_array

_RESAMPLES = 2000


class BootstrapInterval(NamedTuple):
    """A number and its 95 % interval over the runs."""

    value: float
    low: float
    high: float


def over_runs(over, under=None, root=True) -> BootstrapInterval:
    """√(Σ over / Σ under), or without the root, and its interval by resampling the runs (bootstrap, percentiles).

    Args:
        over: (runs,) sum of squares of each run.
        under: (runs,) what to divide by: rows, or the sum of another square; None for ones.
    """
    over = np.asarray(over, float)
    under = np.ones(len(over)) if under is None else np.asarray(under, float)
    chosen = np.random.default_rng(0).integers(0, len(over), (_RESAMPLES, len(over)))
    with np.errstate(invalid="ignore", divide="ignore"):
        value = over.sum() / under.sum()
        again = over[chosen].sum(axis=1) / under[chosen].sum(axis=1)
    if root:
        value, again = math.sqrt(value), np.sqrt(again)
    low, high = np.nanpercentile(again, [2.5, 97.5]) if np.isfinite(again).any() else (math.nan, math.nan)
    return BootstrapInterval(float(value), float(low), float(high))


def errors(sog, cog, course_rate, voyage) -> np.ndarray:
    """(3, n) errors of SOG, COG and course rate (n,)."""
    return np.stack([sog - voyage.sog, wrap_array(cog - voyage.cog), course_rate - voyage.course_rate])


def error_squares(motion, voyage) -> np.ndarray:
    """(3, n) squares of the errors of an estimate; NaN where there is no course."""
    squares = np.square(errors(motion.sog, motion.cog, motion.course_rate, voyage))
    squares[:, ~np.isfinite(squares[1])] = np.nan
    return squares
