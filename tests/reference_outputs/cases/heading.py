"""Heading from propellers and a compass with dynamics (P4): filters and intervals."""

import math

import numpy as np

from steerway.estimation.heading import WEIGHTS, AidedHeadingFilter, LearnedHeading, outside
from steerway.estimation.testing import PRODUCT
from steerway.vessels import RPM
from steerway.vessels.testing import PHYSICAL_YAW
from tests.reference_outputs.tables import case, columns
from tests.scenes import record

CURRENT = 0.05, 0.15


@case("heading_aided")
def aided():
    """A compass with a deviation card; no readings for ten seconds, no velocity in every seventh."""
    card = tuple(np.radians([1.0, 3.0, -3.0, 1.0, 0.5]))
    rows = record(120, plant="physical", current=CURRENT, seed=6, card=card, bias=5.0 * RPM)
    estimator, found = AidedHeadingFilter(PRODUCT, yaw=PHYSICAL_YAW), []
    for k, (difference, readings, _, velocity) in enumerate(zip(*rows, strict=True)):
        silent = 60 <= k < 70
        estimator.step(difference, None if silent else readings, (math.nan, math.nan) if k % 7 == 3 else velocity)
        found.append(
            (
                estimator.heading,
                estimator.heading_std,
                estimator.scale,
                estimator.scale_std,
                estimator.bias,
                *estimator.deviation,
                *estimator.current,
                outside(estimator, 0.01),
            )
        )
    names = "heading std scale scale_std bias sine cosine current_north current_east outside"
    return columns(names, found)


@case("heading_learned")
def learned():
    found = {}
    for name in WEIGHTS:
        estimator, rows = LearnedHeading(name), []
        for difference, readings, *_ in zip(*record(120, current=CURRENT, seed=6), strict=True):
            estimator.step(difference, readings)
            rows.append((estimator.heading, estimator.low, estimator.high))
        found |= columns(f"{name}_heading {name}_low {name}_high", rows)
    return found
