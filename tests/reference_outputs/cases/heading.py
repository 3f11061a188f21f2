"""Heading from propellers and a compass with dynamics (P4): filters and intervals."""

import math
from functools import cache

import numpy as np

from steerway.estimation.heading import (
    WEIGHTS,
    AidedHeadingFilter,
    LearnedHeading,
    outside,
)
from steerway.estimation.testing import PRODUCT
from steerway.sensors import TRUE_TCM2, DynamicCompass
from steerway.vessels import RPM, Springer, conditions
from steerway.vessels.testing import PHYSICAL_YAW
from tests.reference_outputs.tables import case, columns


@cache
def weave(plant="paper", compass=TRUE_TCM2, seconds=120, bias=0.0, card=(0.0,) * 5):
    """[(difference, readings (40,), velocity)] of a boat that weaves, second by second."""
    chance = np.random.default_rng(6)
    boat, stream = Springer(plant, bias=bias), DynamicCompass(compass, card).start(0.0, chance)
    state, around, rows = boat.start(), conditions((0.05, 0.15)), []
    for k in range(seconds):
        difference = 80.0 * RPM * math.sin(k / 15.0)
        motion = boat.motion(state, around)
        noise = 0.1 * chance.standard_normal(2)
        velocity = motion.north_velocity + noise[0], motion.east_velocity + noise[1]
        rows.append((difference, stream.second(boat.heading(state)), velocity))
        state = boat.step(state, (difference,), around, 1.0)
    return rows


def output(estimator, rows, read):
    """`read(estimator)` after every second."""
    found = []
    for difference, readings, _ in rows:
        estimator.step(difference, readings)
        found.append(read(estimator))
    return found


def aided(tuning, rows, yaw):
    estimator, found = AidedHeadingFilter(tuning, yaw=yaw), []
    for k, (difference, readings, velocity) in enumerate(rows):
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


@case("heading_aided")
def aided_product():
    card = tuple(np.radians([1.0, 3.0, -3.0, 1.0, 0.5]))
    return aided(PRODUCT, weave("physical", TRUE_TCM2, 120, 5.0 * RPM, card), PHYSICAL_YAW)


@case("heading_learned")
def learned():
    found = {}
    for name in WEIGHTS:
        rows = output(LearnedHeading(name), weave(), lambda each: (each.heading, each.low, each.high))
        found |= columns(f"{name}_heading {name}_low {name}_high", rows)
    return found
