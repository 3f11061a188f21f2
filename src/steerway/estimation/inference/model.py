"""The model of a vessel and her receiver as the kernels read it, and the states of a structure.

Every mode has the state [x^n y^n U χ r …]: position, speed and course over ground, and the course rate that is held.
Beyond the five come shaping filters (T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed.,
§8.2 and §10.2), each a real or complex first-order Gauss–Markov process z with ż = (−λ + iν) z + w, of which the
real part acts: on the speed, on the course rate, on the course (waves swing a vessel about the course she holds; were
it the rate, they would let it wander), athwart on the antenna, on the moment of a fix, or as the receiver's error north
and east.

The covariance belongs to the error [δN δE δU δs δr …] with δs = U δχ: velocity along and across the course. It stays
regular at rest, where course means nothing.
"""

from typing import NamedTuple

import numpy as np

NORTH, EAST, SPEED, COURSE, RATE = range(5)
ON_SPEED, ON_RATE, ON_COURSE, ON_ANTENNA, ON_FIX, ON_AID, ON_TIME = range(7)
"""What a shaping filter acts on. One on fixes has two states, north and east; a complex one two, real and imaginary."""

AID_VARIANCE, COMPANION = range(2)
"""Columns of `aids`, whose rows are those of `course.update.aids.TABLE`: variance (of COG: of the velocity across,
m²/s²); state of the companion (error of the receiver's velocity, crab angle, the water's own speed along the course,
the gyro's bias), 0 for none."""

ACTS_ON, STATE, DECAY, FREQUENCY, VARIANCE = range(5)
"""Columns of `filters`: what it acts on, its first state, λ (1/s), ν (rad/s; 0: real), stationary variance."""

SPEED_NOISE, RATE_NOISE, RATE_DECAY, SIDEWAYS = range(4)
"""Columns of `modes`: densities S_U (m²/s³) and S_ω (rad²/s³), decay of the held rate (1/s), and which share of S_U
acts across the course too, at any speed."""

CALM, TURN, YAW, SURGE, EMERGENCY = range(5)
"""Modes: course held; steady turn; yaw manoeuvre; speed manoeuvre; whatever the vessel is capable of."""
MODES = 5

(
    FIX_VARIANCE,
    OUTLIER_RATE,
    DRIFT_SPEED,
    POOR_RATE,
    TIME_VARIANCE,
    LATE_VARIANCE,
    STEP_RATE,
    STEP_VARIANCE,
    SLIP_VARIANCE,
    POOR_NOISE,
    POOR_TIME,
) = range(11)
"""`receiver`: variance of a fix (white, m²), share of outliers, the speed (m/s) below which motion is isotropic, share
of poor fixes, variance of the moment of a fix and that of a poor one besides (s²), steps of its error a second, the
variance of a step in any direction (m²) and, besides, along the way made good (s²), how many times the usual noise a
poor fix has, and how long (s) fixes stay poor; 0 where each is so by itself."""


class Model(NamedTuple):
    """The numbers that a filter works with. Arrays of float64."""

    modes: np.ndarray  # (MODES, 4)
    generator: np.ndarray  # (MODES, MODES) rates of change between modes, 1/s; rows sum to 0
    filters: np.ndarray  # (f, 5)
    receiver: np.ndarray  # (11,)
    aids: np.ndarray  # (aids, 2)


def has_two_states(row) -> bool:
    """Whether a shaping filter (a row of `filters`) has two states."""
    return row[ACTS_ON] == ON_FIX or row[FREQUENCY] > 0.0


def states_of(filters) -> int:
    """Number of states that these shaping filters need."""
    return 5 + sum(2 if has_two_states(row) else 1 for row in filters)


class Bank(NamedTuple):
    """State and work space of a filter: one Gaussian a mode."""

    x: np.ndarray  # (MODES, n)
    p: np.ndarray  # (MODES, n, n), symmetric
    probability: np.ndarray  # (MODES,)
    mixed_x: np.ndarray  # (MODES, n) workspace
    mixed_p: np.ndarray  # (MODES, n, n) workspace: of what is mixed
    run: np.ndarray  # (12,) of outliers in a row and of the time, see RUN
    steps: np.ndarray  # (MODES, STEP_ROWS, n) see `discrete`
    change: np.ndarray  # (MODES, MODES) probabilities of change in a step
    work: np.ndarray  # (12, max(n, 8))

    @property
    def states(self):
        return self.x.shape[1]


FUSED = 10
"""Columns of `fuse`: N, E, U, χ, ω, variances of U, χ, ω, of position, and 1 where the course is defined."""
STEP_ROWS = 9


def empty_bank(states: int) -> Bank:
    """Memory of a filter that has seen nothing."""
    m, n = MODES, states
    return Bank(
        np.zeros((m, n)),
        np.zeros((m, n, n)),
        np.zeros(m),
        np.zeros((m, n)),
        np.zeros((m, n, n)),
        np.zeros(12),
        np.zeros((m, STEP_ROWS, n)),
        np.zeros((m, m)),
        np.zeros((12, max(n, 8))),
    )


RUN, RUN_N, RUN_E, WAS_OUTLIER, STARTED, STEP_N, STEP_E, SINCE, APART, WAS_POOR, LEARNT, LEVEL = range(12)
"""`run` of a bank: how many outliers in a row agree, and their offset; the probability that the last fix was one; 1
once begun; the step of the receiver last followed; s since the last fix, and from that before it to it; the probability
that the last fix was poor; degrees of freedom of what the fixes of an obstruction tell of its noise, and how many times
the usual variance of poor fixes that is."""


class Kept(NamedTuple):
    """What a filter keeps of every row for the smoother; of no rows where nothing is to be smoothed."""

    x: np.ndarray  # (rows, MODES, n)
    p: np.ndarray  # (rows, MODES, n, n)
    probability: np.ndarray  # (rows, MODES), NaN before the first fix


def room_to_keep(rows: int, states: int) -> Kept:
    """Where a filter keeps so many rows."""
    shape = (rows, MODES, states)
    return Kept(np.empty(shape), np.empty((*shape, states)), np.empty(shape[:2]))
