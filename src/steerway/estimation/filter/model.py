"""The model of a vessel and its receiver, and the state of a filter, as arrays for the kernels.

Every mode has the state [x^n y^n U χ r …]: position, speed and course over ground, and the held course rate. Further
states are shaping filters (T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., §8.2 and
§10.2). Each is a real or complex first-order Gauss–Markov process z with ż = (−λ + iν) z + w. Its real part acts on a
quantity below. Waves act on the course: they swing a vessel about it. Acting on the rate, they would change the mean
course.

The covariance belongs to the error [δN δE δU δs δr …] with δs = U δχ: velocity along and across the course (m/s). It
stays regular at rest, where the course is undefined.

All numbers have eight bytes, so that a model and a bank fit into one row of float64 each (`packed`, `bank_in`). A row
is copied at once, and passing it to a kernel takes a tenth of the time of passing its arrays.
"""

from typing import NamedTuple, Protocol

import numpy as np

from steerway.core.arrays import Floats, Records
from steerway.core.compiled import jitable
from steerway.core.shaping import shaped

NORTH, EAST, SPEED, COURSE, RATE = range(5)
"""The states that every model has."""
ON_SPEED, ON_RATE, ON_COURSE, ON_ANTENNA, ON_FIX, ON_AID, ON_ACCELERATION = range(7)
"""Quantities that a process can act on; ON_ANTENNA: displacement of the antenna to starboard. A process on fixes has
two states, north and east; a complex one a real and an imaginary state."""
DRIVING = (ON_SPEED, ON_RATE, ON_COURSE, ON_ACCELERATION)
"""The quantities that drive the motion."""


class Mode(Protocol):
    """How a vessel moves in a mode."""

    speed_noise: float  # spectral density S_U, m²/s³
    rate_noise: float  # spectral density S_ω, rad²/s³
    speed_decay: float  # α1, 1/s
    rate_decay: float  # α2 of the held rate, 1/s
    sideways: float  # share of S_U that also acts across the course, at any speed
    start: float  # probability of the mode at the first fix
    start_rate: float  # variance of the course rate at the first fix, rad²/s²
    drift_speed: float  # m/s, below which motion is isotropic
    least_share: float  # see `bank.LEAST_SHARE`
    manoeuvres: int  # 1 for a manoeuvre, else 0


class Process(Protocol):
    """A shaping filter."""

    decay: float  # λ, 1/s
    frequency: float  # ν, rad/s; 0 for a real process
    variance: float  # stationary, in the unit of the state squared
    acts_on: int  # one of ON_SPEED to ON_ACCELERATION
    state: int  # number of its first state


class Receiver(Protocol):
    """Noise, outliers and steps of a receiver's fixes."""

    fix_variance: float  # white noise north or east, m²
    outlier_rate: float  # share of fixes that are outliers
    poor_rate: float  # share of fixes that are poor
    poor_noise: float  # ratio of the standard deviation of a poor fix to that of a good one
    poor_time: float  # s for which fixes stay poor; 0 if fixes are poor independently of one another
    time_variance: float  # variance of the time at which a fix was measured, s²
    late_variance: float  # further variance of this time for a poor fix, s²
    step_rate: float  # rate of steps of the error, 1/s
    step_variance: float  # variance of a step north or east, m²
    followed_after: float  # least time, s, for which outliers that agree are refused
    quantum_north: float  # last digit of a written fix, m; 0 where fixes are not rounded
    quantum_east: float


class Aid(Protocol):
    """An instrument of `vessel.aids.TABLE`."""

    variance: float  # of the noise; for COG of the velocity across the course, m²/s²; NaN for an aid that is not used
    companion: int  # state of its slow error, 0 for none


class Step(Protocol):
    """A prediction in one mode. Noise that acts across the course is given per m/s of speed."""

    dt: float  # length, s
    way: float  # distance that a unit of speed covers
    left: float  # share of a unit of speed that remains
    ll: float  # noise of the distance along the course (l) and of the speed (u)
    lu: float
    uu: float
    yy: float  # noise of the distance across the course (y) and of the course (x)
    yx: float
    xx: float
    held_ll: float  # noise of the held speed alone
    held_lu: float
    held_uu: float
    sideways: float  # see `Mode`
    drift_speed: float


class Response(Protocol):
    """A state in a prediction: the effect of one unit of it, what remains of it, and its noise."""

    way: float  # distance along the course
    gain: float  # change of speed
    turn: float  # change of course
    lean: float  # mean change of course over the step
    left: float  # real part of what remains
    spun: float  # imaginary part
    with_way: float  # covariance of its noise with the distance along the course, or for each m/s across it
    with_gain: float  # covariance of its noise with the speed, or with the course
    added: float  # variance of its noise


class Run(Protocol):
    """What a filter remembers of the receiver."""

    since: float  # s since the last fix
    apart: float  # s between the last two fixes
    outliers: float  # how many outliers in a row agree
    lasted: float  # s for which these outliers have agreed
    outlier_north: float  # mean innovation of these outliers, m
    outlier_east: float
    was_outlier: float  # probability that the last fix was an outlier
    step_north: float  # the step that was followed last, m
    step_east: float
    was_poor: float  # probability that the last fix was poor
    learnt: float  # degrees of freedom of `level` that stem from earlier fixes of the same obstruction
    level: float  # ratio of the variance of poor fixes to its usual value
    started: int  # 1 after the first fix


def _record(kind: type) -> np.dtype[np.void]:
    """Record type with the fields of a class. Fields are attributes in Python too, where kernels run uncompiled."""
    fields = [(name, np.int64 if each is int else np.float64) for name, each in kind.__annotations__.items()]
    return np.dtype((np.record, fields))


MODE, PROCESS, RECEIVER, AID = map(_record, (Mode, Process, Receiver, Aid))
STEP, RESPONSE, RUN = map(_record, (Step, Response, Run))
MODE_SIZE, PROCESS_SIZE, RECEIVER_SIZE, AID_SIZE = (each.itemsize // 8 for each in (MODE, PROCESS, RECEIVER, AID))
STEP_SIZE, RESPONSE_SIZE, RUN_SIZE = (each.itemsize // 8 for each in (STEP, RESPONSE, RUN))


class Model(NamedTuple):
    """Modes of motion, shaping filters, receiver and aids."""

    modes: Records  # (m,) MODE
    generator: Floats  # (m, m) rates (1/s) of change from the mode of the row to the mode of the column; rows sum to 0
    processes: Records  # (f,) PROCESS
    receiver: Records  # (1,) RECEIVER
    aids: Records  # (aids,) AID
    states: int  # n
    driving: int  # number of states, from the first on, that drive the motion

    @property
    def sizes(self) -> tuple[int, int, int, int, int]:
        """Numbers of modes, states, processes, aids and driving states: one kernel call steps models of equal sizes."""
        return len(self.modes), self.states, len(self.processes), len(self.aids), self.driving


def has_two_states(acts_on: int, frequency: float) -> bool:
    """Whether a shaping filter has two states."""
    return acts_on == ON_FIX or frequency > 0.0


class Bank(NamedTuple):
    """A filter: one Gaussian for every mode, its memory between steps, and workspace."""

    x: Floats  # (m, n)
    p: Floats  # (m, n, n), symmetric
    probability: Floats  # (m,)
    run: Records  # (1,) RUN
    steps: Records  # (m,) STEP
    responses: Records  # (m, n) RESPONSE
    change: Floats  # (m, m) probabilities of a change of mode in a step
    moments: Floats  # (m + 1, n + n²) this and what follows is workspace
    shares: Floats  # (2, m)
    rows: Floats  # (8, n)
    product: Floats  # (m, m)


@jitable
def moments_of(n: int) -> int:
    """Number of first and second moments of n states."""
    return n + n * n


@jitable
def bank_in(memory: Floats, m: int, n: int) -> Bank:
    """The Bank of m modes and n states whose arrays are views of a row of `bank_size` float64."""
    x, p = m * n, m * n * n
    a = x + p + m
    b = a + RUN_SIZE
    c = b + m * STEP_SIZE
    d = c + x * RESPONSE_SIZE
    e = d + m * m
    f = e + (m + 1) * moments_of(n)
    g = f + 2 * m
    h = g + 8 * n
    return Bank(
        shaped(memory[:x], (m, n)),
        shaped(memory[x : x + p], (m, n, n)),
        memory[x + p : a],
        memory[a:b].view(RUN),
        memory[b:c].view(STEP),
        shaped(memory[c:d].view(RESPONSE), (m, n)),
        shaped(memory[d:e], (m, m)),
        shaped(memory[e:f], (m + 1, moments_of(n))),
        shaped(memory[f:g], (2, m)),
        shaped(memory[g:h], (8, n)),
        shaped(memory[h : h + m * m], (m, m)),
    )


def bank_size(m: int, n: int) -> int:
    """Number of float64 in a bank of m modes and n states."""
    numbers = m * (n + n * n + n * RESPONSE_SIZE + STEP_SIZE + 2 * m + 3) + RUN_SIZE + 8 * n
    return numbers + (m + 1) * moments_of(n)


def empty_bank(model: Model) -> Bank:
    """The bank of a filter before the first fix."""
    m, n = len(model.modes), model.states
    return bank_in(np.zeros(bank_size(m, n)), m, n)


@jitable
def model_in(numbers: Floats) -> Model:
    """The Model whose arrays are views of a row made by `packed`."""
    sizes = numbers[:5].view(np.int64)
    m, states, processes, aids, driving = sizes[0], sizes[1], sizes[2], sizes[3], sizes[4]
    a = 5 + m * MODE_SIZE
    b = a + m * m
    c = b + processes * PROCESS_SIZE
    d = c + RECEIVER_SIZE
    return Model(
        numbers[5:a].view(MODE),
        shaped(numbers[a:b], (m, m)),
        numbers[b:c].view(PROCESS),
        numbers[c:d].view(RECEIVER),
        numbers[d : d + aids * AID_SIZE].view(AID),
        states,
        driving,
    )


def packed(model: Model) -> Floats:
    """A model in a row of float64: its sizes and its arrays."""
    sizes = np.array(model.sizes, np.int64).view(np.float64)
    return np.concatenate([sizes, *(part.view(np.float64).ravel() for part in model[:5])])


FUSED = 9
"""Number of columns of `fuse`: N, E, U, χ, ω, and the variances of U, χ, ω and of the position."""


class Kept(NamedTuple):
    """The modes after every row, for the smoother; without rows where nothing is to be smoothed."""

    x: Floats  # (rows, m, n)
    p: Floats  # (rows, m, n, n)
    probability: Floats  # (rows, m), NaN before the first fix


def room_to_keep(rows: int, model: Model) -> Kept:
    """Memory for the modes after each of this many rows."""
    m, n = len(model.modes), model.states
    return Kept(np.empty((rows, m, n)), np.empty((rows, m, n, n)), np.empty((rows, m)))
