"""What a filter is told and what it remembers: two small arrays, so that a kernel call costs next to nothing.

`model` is a vector of parameters (the first indices below), followed by one triple (decay rate, noise density, initial
variance) for each state beyond the five. `memory` is an (n + 9, n) matrix: the covariance (upper triangle), the state,
the filter's bookkeeping, four rows of workspace, and the step last taken, which is most often the next one too.
"""

import numpy as np

from steerway.core.compiled import kernel, lean_kernel

NORTH, EAST, SPEED, COURSE, RATE = range(5)
VELOCITY_NORTH, VELOCITY_EAST = SPEED, COURSE
"""Adrift, where course is not defined, the third and fourth state are the velocity itself."""

(
    SPEED_NOISE,  # spectral density of w1 in (13), m²/s³
    RATE_NOISE,  # spectral density of w2 in (15), rad²/s³
    SPEED_DECAY,  # α1, 1/s
    RATE_DECAY,  # α2, 1/s
    POSITION_VARIANCE,  # of the white part of a fix, north and east, m²
    STEERAGEWAY,  # m/s
    TIME_VARIANCE,  # of the moment of a fix, s²
    START_SPEED_VARIANCE,  # (m/s)²
    START_RATE_VARIANCE,  # (rad/s)²
    GATE,  # on the normalised innovation squared of a fix, χ² with 2 degrees of freedom
    OUTLIER,  # −2 log of the density of an outlier, 1/m²: a fix that is likelier than one is taken whatever its NIS
    PATIENCE,  # s of unbroken rejections after which the position is taken anew
    SOG_VARIANCE,
    VELOCITY_VARIANCE,  # across the course, of the receiver's own velocity: (this / U²) is the variance of COG
    HEADING_VARIANCE,
    WATER_SPEED_VARIANCE,
    YAW_RATE_VARIANCE,
    ERROR_STATE,  # index of the first pair of receiver-error states (north, east), 0 if there is none
    ERROR_PAIRS,  # how many pairs there are, one behind the other
    CRAB_STATE,  # … of the crab angle
    GYRO_STATE,  # … of the gyro's bias
    STREAM_STATE,  # … of the water's own speed along the course
    ACCELERATION_STATE,  # … of the acceleration along the course
    YAWING_STATE,  # … of the course's deviation from the one held
    YAWING_STIFFNESS,  # κ, 1/s²: how hard it is steered back
    YAWING_DECAY,  # β, 1/s: how fast the course held follows it
    STARTS_IN,  # of a vessel of several modes: how likely this one is to begin with
    LEAVING,  # 1/s: how often she leaves it for the other manner of moving
    SWITCHES_TO,  # … and for which row of the models
    AGEING,  # 1/s: how often it ages
    AGES_TO,  # … into which row
    EXTRAS,  # where the triples begin
) = range(32)

MODE, STRAY, RETRIES, LATITUDE, LONGITUDE = range(5)
"""Bookkeeping: one of the modes below; seconds since the first of unbroken rejections (−1: none); resets in a row; the
point around which the tangent plane lies."""

(
    DT,  # s
    SPEED_LEFT,  # e^{−α1 dt}
    SPEED_INTEGRAL,  # way after a unit of speed
    RATE_LEFT,  # e^{−α2 dt}
    TURN,  # change of course after a unit of course rate
    LEAN,  # its mean over the step
    Q_UU,  # what S_U adds to the variance of speed,
    Q_LU,  # to the covariance of way along the course and speed,
    Q_LL,  # to the variance of way along the course
    Q_WW,  # what S_ω adds to the covariance of course rate and course,
    Q_XW,
    Q_XX,
    Q_YW,  # and, for each m/s of speed, of way across the course
    Q_YX,
    Q_YY,
) = ((row, column) for row in range(3) for column in range(5))
"""The step: what a prediction needs that depends on its length alone, in three rows."""
LEFT, ADDED = range(2)
"""Rows of it whose further columns say what is left of, and what noise adds to, each state beyond the five."""

EMPTY, FIRST, STARTING, ADRIFT, UNDERWAY = range(5)
"""No fix yet; one fix; velocity being found; velocity without direction; course."""

LONGEST_STEP, LONGEST_YAWING_STEP = 1.0, 0.5
"""A longer interval is predicted in equal parts of at most this (s), of a vessel that yaws of at most the second."""
STEP_SLACK = 1e-3
"""Part of the longest step by which clocks err: a fix 1.0000002 s after another is one step away."""
LONGEST_GAP = 1800.0
"""After so long (s) without a fix nothing of the motion is left: the filter starts anew."""
LOST_COURSE_VARIANCE = 1.0
"""rad²: beyond one radian a linearised course means nothing."""


def whole(memory):
    """The memory of what the vessel is said to do: of several modes that of their mean, else all there is."""
    return memory if memory.ndim == 2 else memory[0]


@lean_kernel
def longest_step(model):
    """The longest interval that is predicted at once, s."""
    return LONGEST_YAWING_STEP if model[YAWING_STATE] else LONGEST_STEP


@kernel
def empty_memory(model):
    """Memory of a filter that has seen nothing; for models of several modes that of `mixture`."""
    n = 5 + (model.shape[-1] - EXTRAS) // 3
    if model.ndim == 2:
        modes = len(model) - 1
        return np.zeros((1 + 2 * modes, n + 10 + modes, n))
    return np.zeros((n + 9, n))
