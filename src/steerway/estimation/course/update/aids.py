"""Aids as the kernels of the filter take them."""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.compiled import lean_kernel
from steerway.core.kalman import correct_scalar
from steerway.core.statistics import AID_GATE
from steerway.estimation.course.motion.layout import (
    EXTRAS,
    SPEED,
    STATES,
    VELOCITY_EAST,
    VELOCITY_NORTH,
    VELOCITY_VARIANCE,
)
from steerway.estimation.vessel.aids import IS_ANGLE, SIGN_OF, STATE_OF, TABLE

_ACROSS_COURSE = np.array([aid.across_course for aid in TABLE])
_LEAST_SPEED_SQUARED = 1e-4
"""(m/s)²: a centimetre a second, below which a velocity has no direction whatever its noise."""


def companion_states(profile, aids) -> tuple[dict[str, int], list[tuple[float, float]]]:
    """Of the aids in use: for each name the place of its companion state (from 0 on), and (std, time) of each."""
    keys = sorted((aid.companion, aid.name) for aid in TABLE if aid.companion and aid.name in aids)
    present = [(name, getattr(profile, std), getattr(profile, time)) for (std, time), name in keys]
    present = [each for each in present if each[1] > 0.0]
    return {name: k for k, (name, _, _) in enumerate(present)}, [(std, time) for _, std, time in present]


def packed(profile, states: dict[str, int]) -> list[float]:
    """The end of a row of parameters: of every aid its variance and the index of its companion state, 0 for none."""
    return [number for aid in TABLE for number in (getattr(profile, aid.noise) ** 2, states.get(aid.name, 0))]


@lean_kernel
def measured(which, value, x, parameters):
    """What an aid measures: (state, its companion or 0, the companion's sign, innovation, variance)."""
    at = EXTRAS + 3 * (int(parameters[STATES]) - 5) + 2 * which
    i, variance, companion = STATE_OF[which], parameters[at], int(parameters[at + 1])
    expected = x[i] + SIGN_OF[which] * x[companion] if companion else x[i]
    innovation = wrap(value - expected) if IS_ANGLE[which] else value - expected
    if _ACROSS_COURSE[which]:
        variance /= max(x[SPEED] ** 2, _LEAST_SPEED_SQUARED)
    return i, companion, SIGN_OF[which], innovation, variance


@lean_kernel
def aid_low_speed(x, p, work, sog, cog, parameters):
    """Without a course only the receiver's whole velocity is a measurement of the state."""
    if math.isfinite(sog) and math.isfinite(cog):
        variance = parameters[VELOCITY_VARIANCE]
        for i in range(VELOCITY_NORTH, VELOCITY_EAST + 1):
            velocity = sog * (math.cos(cog) if i == VELOCITY_NORTH else math.sin(cog))
            correct_scalar(x, p, work, i, 0, 0.0, velocity - x[i], variance, AID_GATE)


@lean_kernel
def any_known(aids):
    """Whether any of the aids is not NaN."""
    for value in aids:
        if math.isfinite(value):
            return True
    return False
