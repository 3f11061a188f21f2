"""What a filter is told and what it remembers: two small arrays, so that a kernel call costs next to nothing.

`model` is a vector of parameters (the first indices below), followed by one triple (decay rate, noise density, initial
variance) for each state beyond the five. `memory` is an (n + 6, n) matrix: the covariance (upper triangle), the state,
the filter's bookkeeping (the last indices below) and four rows of workspace.
"""

import numpy as np

from steerway.compiled import kernel

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
    START_SPEED_VARIANCE,  # (m/s)²
    START_RATE_VARIANCE,  # (rad/s)²
    GATE,  # on the normalised innovation squared of a fix, χ² with 2 degrees of freedom
    PATIENCE,  # s of unbroken rejections after which the position is taken anew
    SOG_VARIANCE,
    VELOCITY_VARIANCE,  # across the course, of the receiver's own velocity: (this / U²) is the variance of COG
    HEADING_VARIANCE,
    WATER_SPEED_VARIANCE,
    YAW_RATE_VARIANCE,
    ERROR_STATE,  # index of the first of two receiver-error states (north, east), 0 if there is none
    CRAB_STATE,  # … of the crab angle
    GYRO_STATE,  # … of the gyro's bias
    STREAM_STATE,  # … of the water's own speed along the course
    EXTRAS,  # where the triples begin
) = range(20)

MODE, STRAY, RETRIES, LATITUDE, LONGITUDE = range(5)
"""Bookkeeping: one of the modes below; seconds since the first of unbroken rejections (−1: none); resets in a row; the
point around which the tangent plane lies."""

EMPTY, FIRST, STARTING, ADRIFT, UNDERWAY = range(5)
"""No fix yet; one fix; velocity being found; velocity without direction; course."""

LONGEST_STEP = 1.0
"""A longer interval is predicted in equal parts of at most this (s)."""
STEP_SLACK = 1e-3
"""Part of LONGEST_STEP by which clocks err: a fix 1.0000002 s after another is one step away."""
LONGEST_GAP = 1800.0
"""After so long (s) without a fix nothing of the motion is left: the filter starts anew."""
LOST_COURSE_VARIANCE = 1.0
"""rad²: beyond one radian a linearised course means nothing."""


@kernel
def empty_memory(model):
    """Memory of a filter that has seen nothing."""
    n = 5 + (len(model) - EXTRAS) // 3
    return np.zeros((n + 6, n))
