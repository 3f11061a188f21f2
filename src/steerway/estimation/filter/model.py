"""The numbers of a structure and the state of its filter, as the kernels read them.

Every mode has the state [x^n y^n U χ r …]: position, speed and course over ground, and the course rate that is held.
Beyond the five come shaping filters (T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed.,
§8.2 and §10.2), each a real or complex first-order Gauss–Markov process z with ż = (−λ + iν) z + w. Its real part acts
on the speed, on the acceleration along the course, on the course rate, on the course (waves swing a vessel about the
course it holds; were it the rate, they would let it wander), athwart on the antenna, or as the receiver's error north
and east.

The covariance belongs to the error [δN δE δU δs δr …] with δs = U δχ: velocity along and across the course. It stays
regular at rest, where course means nothing.

Everything is an array of float64 or of records of eight-byte fields. A model and a bank are therefore one row of
float64 each (`packed`, `bank_in`): a row is copied at once, and costs a call a tenth of what its arrays cost.
"""

from typing import NamedTuple

import numpy as np

from steerway.core.compiled import jitable
from steerway.core.shaping import shaped

NORTH, EAST, SPEED, COURSE, RATE = range(5)
"""The states that every structure has."""
ON_SPEED, ON_RATE, ON_COURSE, ON_ANTENNA, ON_FIX, ON_AID, ON_ACCELERATION = range(7)
"""Quantities that a process can act on. A process on fixes has two states, north and east; a complex one has a real
and an imaginary state."""
DRIVING = (ON_SPEED, ON_RATE, ON_COURSE, ON_ACCELERATION)
"""Those that drive the motion."""


def _record(numbers: str, integers: str = "") -> np.dtype:
    """Records with these fields."""
    fields = [(name, np.float64) for name in numbers.split()] + [(name, np.int64) for name in integers.split()]
    return np.dtype((np.record, fields))  # fields are attributes in Python too, where kernels run without compilation


MODE = _record(
    "speed_noise rate_noise speed_decay rate_decay sideways start start_rate drift_speed least_share", "manoeuvres"
)
"""How a vessel moves in a mode: densities S_U (m²/s³) and S_ω (rad²/s³), decay α1 of the speed and α2 of the held rate
(1/s), which share of S_U acts across the course too at any speed, of a vessel of which nothing is known the probability
of the mode and the variance of its course rate (rad²/s²), the speed (m/s) below which motion is isotropic, of a mode
from which it starts a step the share of which half counts (see `bank.LEAST_SHARE`), and whether it is a manoeuvre."""
PROCESS = _record("decay frequency variance", "acts_on state")
"""A shaping filter: λ (1/s), ν (rad/s; 0: real), stationary variance, what it acts on, its first state."""
RECEIVER = _record(
    "fix_variance outlier_rate poor_rate poor_noise poor_time time_variance late_variance"
    " step_rate step_variance followed_after quantum_north quantum_east"
)
"""Variance of a fix (white, m²); share of outliers; share of poor fixes, how many times the usual noise one has, and
how long (s) fixes stay poor, 0 where each is so by itself; variance of the moment of a fix and that of a poor one
besides (s²); steps of the error a second and the variance of one north or east (m²); how long (s) outliers that agree
are refused at least; last digit of a written fix north and east (m), 0 of one that is not rounded."""
AID = _record("variance", "companion")
"""Variance (of COG: of the velocity across, m²/s²) of an aid of `course.update.aids.TABLE`, NaN of one not used, and
the state of its companion (error of the receiver's velocity, crab angle, the water's own speed along the course, the
gyro's bias), 0 for none."""


class Model(NamedTuple):
    """The numbers that a filter works with."""

    modes: np.ndarray  # (m,) MODE
    generator: np.ndarray  # (m, m) rates of change between modes, 1/s; rows sum to 0
    processes: np.ndarray  # (f,) PROCESS
    receiver: np.ndarray  # (1,) RECEIVER
    aids: np.ndarray  # (aids,) AID
    states: int  # n
    driving: int  # of these from the first on, those that drive the motion

    @property
    def sizes(self) -> "Sizes":
        return Sizes(len(self.modes), self.states, len(self.processes), len(self.aids), self.driving)


class Sizes(NamedTuple):
    """What filters have in common that one call steps."""

    modes: int
    states: int
    processes: int
    aids: int
    driving: int


def has_two_states(process) -> bool:
    """Whether a process (PROCESS) has two states."""
    return bool(process["acts_on"] == ON_FIX or process["frequency"] > 0.0)


STEP = _record("dt way left ll lu uu yy yx xx held_ll held_lu held_uu sideways drift_speed")
"""A prediction in one mode: its length (s), the way of a unit of speed and what is left of one, what noise adds (l: way
along the course, u: speed, y: way across and x: course, each for every m/s; `held_`: to the held speed alone), and what
it takes from MODE."""
RESPONSE = _record("way gain turn lean left spun with_way with_gain added")
"""A state in a prediction. What a unit of it moves: way along, speed, course, mean course over the step. What is left
of it: real and imaginary part. Covariance of its new noise with the way along (or, for each m/s, across) the course and
with the speed (or the course); variance of the new noise."""
RUN = _record(
    "since apart outliers lasted outlier_north outlier_east was_outlier step_north step_east was_poor learnt level",
    "started",
)
"""What a filter remembers of the receiver. Seconds since the last fix, and from that before it to it; how many outliers
in a row agree, for how long (s), and their offset (m); probability that the last fix was one; the step of the
receiver last followed (m); probability that the last fix was poor; degrees of freedom of what the fixes of an
obstruction say of its noise, and how many times the usual variance of poor fixes that is; 1 once begun."""


class Bank(NamedTuple):
    """State of a filter, one Gaussian a mode, what it keeps from step to step, and its workspace."""

    x: np.ndarray  # (m, n)
    p: np.ndarray  # (m, n, n), symmetric
    probability: np.ndarray  # (m,)
    run: np.ndarray  # (1,) RUN
    steps: np.ndarray  # (m,) STEP
    responses: np.ndarray  # (m, n) RESPONSE
    change: np.ndarray  # (m, m) probabilities of change in a step
    moments: np.ndarray  # (m + 1, n + n²) workspace, as all that follows: modes as errors at another,
    shares: np.ndarray  # (2, m) numbers of modes,
    rows: np.ndarray  # (8, n) vectors,
    product: np.ndarray  # (m, m) of matrices


@jitable
def moments_of(n):
    """How many first and second moments n states have."""
    return n + n * n


@jitable
def bank_in(memory, m, n):
    """The Bank of m modes and n states in a row of `bank_size` float64, which it shares."""
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


def _in_numbers(record: np.dtype) -> int:
    return record.itemsize // np.dtype(np.float64).itemsize


MODE_SIZE, PROCESS_SIZE, RECEIVER_SIZE, AID_SIZE = map(_in_numbers, (MODE, PROCESS, RECEIVER, AID))
RUN_SIZE, STEP_SIZE, RESPONSE_SIZE = map(_in_numbers, (RUN, STEP, RESPONSE))


def bank_size(m: int, n: int) -> int:
    """How many float64 a bank of m modes and n states takes."""
    numbers = m * (n + n * n + n * RESPONSE_SIZE + STEP_SIZE + 2 * m + 3) + RUN_SIZE + 8 * n
    return numbers + (m + 1) * moments_of(n)


def empty_bank(model: Model) -> Bank:
    """Memory of a filter that has seen nothing."""
    m, n = len(model.modes), model.states
    return bank_in(np.zeros(bank_size(m, n)), m, n)


@jitable
def model_in(numbers):
    """The Model in a row of float64 of `packed`, which it shares."""
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


def packed(model: Model) -> np.ndarray:
    """A model in a row of float64: its sizes and its arrays."""
    sizes = np.array(model.sizes, np.int64).view(np.float64)
    return np.concatenate([sizes, *(part.view(np.float64).ravel() for part in model[:5])])


FUSED = 9
"""Columns of `fuse`: N, E, U, χ, ω, variances of U, χ, ω and of position."""


class Kept(NamedTuple):
    """What a filter keeps of every row for the smoother; of no rows where nothing is to be smoothed."""

    x: np.ndarray  # (rows, m, n)
    p: np.ndarray  # (rows, m, n, n)
    probability: np.ndarray  # (rows, m), NaN before the first fix


def room_to_keep(rows: int, model: Model) -> Kept:
    """Where a filter keeps so many rows."""
    m, n = len(model.modes), model.states
    return Kept(np.empty((rows, m, n)), np.empty((rows, m, n, n)), np.empty((rows, m)))
