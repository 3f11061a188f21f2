"""Layout of filter state and parameters: two small arrays, so that a kernel call costs next to nothing.

A filter is a bank of modes. `parameters` is (1, k) for one mode and (1 + m, k) for m interacting ones; row 0 is the
vessel at low speed and as a whole, and with one mode that mode too. A row holds the numbers below, one triple (decay
rate, noise density, initial variance) for each state beyond the five, and the aids (see `update.aids`).

`bank` is (1, r, n) for one mode and (1 + 2m, r, n) for m: the combined estimate, the modes, and a copy of them to mix
from; with one mode the combined estimate is that mode. Each (r, n) block holds the covariance (n rows, upper triangle),
the state, the flags, four rows of workspace, five of the step taken last, which is most often the next one too, and
one that begins with the nll of the last measurement under this mode. Of several modes, in block 0, that row holds their
probabilities and m rows of transition probabilities in a step follow.
"""

import numpy as np

from steerway.core.compiled import kernel, lean_kernel
from steerway.estimation.log.rows import LONGEST_GAP as LONGEST_GAP

NORTH, EAST, SPEED, COURSE, RATE = range(5)
VELOCITY_NORTH, VELOCITY_EAST = SPEED, COURSE
"""At low speed, where course is not defined, the third and fourth state are the velocity itself."""

(
    MOTION,  # motion model, an index of `motion.models`
    STATES,  # n
    LONGEST_STEP,  # s: an interval of at most this is one step, see `motion.models.parts_of` for longer ones
    SPEED_NOISE,  # spectral density of w1 in (13), m²/s³
    RATE_NOISE,  # spectral density of w2 in (15), rad²/s³
    SPEED_DECAY,  # α1, 1/s
    RATE_DECAY,  # α2, 1/s
    POSITION_VARIANCE,  # of the white part of a fix, north and east, m²
    STEERAGEWAY,  # m/s
    TIME_VARIANCE,  # of the time of a fix, s²
    START_SPEED_VARIANCE,  # (m/s)²
    START_RATE_VARIANCE,  # (rad/s)²
    VELOCITY_VARIANCE,  # of the receiver's own velocity along either axis, (m/s)²
    GATE,  # on the normalised innovation squared of a fix, χ² with 2 degrees of freedom
    OUTLIER_NLL,  # −log of the density of an outlier, 1/m²: a more probable fix is accepted whatever its NIS
    LONGEST_REJECTION,  # s of unbroken rejections after which the position is reset
    ERROR_STATE,  # index of the first pair of receiver-error states (north, east), 0 for none
    ERROR_PAIRS,  # how many pairs there are, one behind the other
    ACCELERATION_STATE,  # index of the acceleration along the course, 0 for none
    OSCILLATION_STATE,  # index of the deviation from the mean course, 0 for none
    OSCILLATION_STIFFNESS,  # κ, 1/s²
    OSCILLATION_DECAY,  # β, 1/s: how fast the mean course follows
    STARTS_IN,  # of several modes: probability of this one to begin with
    LEAVING,  # 1/s, rate of change to the other kind of mode
    SWITCHES_TO,  # … and to which row of the parameters
    AGEING,  # 1/s, rate of change to the next age of this kind
    AGES_TO,  # … and to which row
    MOTION_STATES,  # index of the first state beyond the five of the motion model; they are the last ones
    VELOCITY_CHANGE,  # (m/s)² along either axis by which velocity has changed at the beginning of a prediction
    EXTRAS,  # where the triples begin
) = range(30)

PHASE, REJECTED_FOR, RESETS, LATITUDE, LONGITUDE = range(5)
"""Flags: one of the phases below; s since the first of unbroken rejections (−1: none); resets of the position in a row;
the origin of the tangent plane."""
NLL = 0
"""Column of the negative log likelihood of the last measurement."""

EMPTY, FIRST, STARTING, LOW_SPEED, UNDER_WAY = range(5)
"""Phases: no fix; one fix; velocity being found; velocity without direction; course."""

(
    DT,  # s
    SPEED_LEFT,  # e^{−α1 dt}
    SPEED_INTEGRAL,  # distance after a unit of speed
    RATE_LEFT,  # e^{−α2 dt}
    TURN,  # change of course after a unit of course rate
    LEAN,  # its mean over the step
    Q_UU,  # what S_U adds to the variance of speed,
    Q_LU,  # to the covariance of distance along the course and speed,
    Q_LL,  # to the variance of distance along the course
    Q_WW,  # what S_ω adds to the covariance of course rate and course,
    Q_XW,
    Q_XX,
    Q_YW,  # and, for each m/s of speed, of distance across the course
    Q_YX,
    Q_YY,
) = ((row, column) for row in range(3) for column in range(5))
"""The step: what a prediction needs that depends on its length alone, in three rows."""
(
    PUSH_BEFORE,  # what a unit of acceleration adds to speed before the prediction without it,
    PUSH_AFTER,  # and after it for a unit then left
    Q_AA,  # what its noise adds to the covariance of acceleration, speed and distance along the course
    Q_UA,
    Q_UU_PUSH,
    Q_LA,
    Q_LU_PUSH,
    Q_LL_PUSH,
) = ((3 + k // 5, k % 5) for k in range(8))
"""… and in two more where acceleration persists."""
STEP_ROWS = 5
LEFT, ADDED = range(2)
"""Rows of it whose further columns say what is left of, and what noise adds to, each state beyond the five."""

STEP, NLLS, CHANGES = 6, 6 + STEP_ROWS, 7 + STEP_ROWS
"""Rows of a block, counted from the state: the step, the nll or probabilities, the transition probabilities."""

STEP_SLACK = 1e-3
"""Part of the longest step by which clocks err: a fix 1.0000002 s after another is one step away."""
LOST_COURSE_VARIANCE = 1.0
"""rad²: one radian, where the error of the linearised sine reaches its size."""


@kernel
def empty_bank(parameters):
    """State of a filter without a fix."""
    n, modes = int(parameters[0, STATES]), max(len(parameters) - 1, 1)
    blocks = 1 if len(parameters) == 1 else 1 + 2 * modes
    return np.zeros((blocks, n + CHANGES + modes, n))


@lean_kernel
def mode_count(bank):
    """How many modes a bank has."""
    return 1 if len(bank) == 1 else (len(bank) - 1) // 2


@lean_kernel
def first_mode(bank):
    """Block of the first mode: 0 where the combined estimate is the only one."""
    return 0 if len(bank) == 1 else 1
