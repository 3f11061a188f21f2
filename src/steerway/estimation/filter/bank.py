"""Interacting multiple models: one Gaussian a mode, mixed before every step.

H. A. P. Blom and Y. Bar-Shalom, IEEE Trans. Automatic Control 33(8), 1988. Modes change in continuous time, so that the
same tuning holds at any rate of fixes and across gaps. Archives of AIS reports are filtered with one mode, over
intervals of seconds to minutes, in as few steps as the motion allows (`parts_of`). Compared with steps of 1 s, 99.99 %
of these estimates differ by less than 0.01 σ.
"""

import math

from steerway.core.arrays import Floats, Records
from steerway.core.compiled import called_kernel, inlined_kernel, lean_kernel
from steerway.core.shaping import shaped
from steerway.estimation.filter.discrete import set_steps
from steerway.estimation.filter.model import COURSE, EAST, NORTH, ON_FIX, RATE, SPEED, Bank, Mode, Model
from steerway.estimation.filter.motion import predict
from steerway.estimation.filter.relative import from_likeliest, shifted

LONGEST_STEP = 3.0
"""Longest single step, s: about the duration of a yaw manoeuvre (prior median 2 s). Intervals up to 12 s are predicted
in equal steps of at most this length. In longer intervals, the steps double from both ends towards the middle, where
the probabilities of the modes are nearly steady. Short steps just before a fix let a manoeuvre begin shortly before
it."""
_LOST = 2.0
"""Variance of the course, rad², above which the course is lost. A uniformly distributed course has π²/3."""
SAME_STEP = 1e-4
"""Relative difference up to which two steps count as equal: far below the error of the time of a fix."""
START_SPEED_STD = 10.0
"""1σ of the velocity along either axis after the first fix, m/s. Two σ are 39 kn."""

LEAST_SHARE = 1e-3
"""Share of a mode, in the mixture from which another starts a step, that is halved; smaller shares are reduced more.
Otherwise an improbable mode of large covariance (an emergency) would widen all others at every step: the likelihood
would be lower, and errors of SOG 2 % larger on steady courses. With 0.01, manoeuvres are followed late."""


@called_kernel
def start(bank: Bank, model: Model, north: float, east: float) -> None:
    """Start at the first fix: at its position, with an unknown velocity."""
    run = bank.run[0]
    for k in range(len(bank.x)):
        start_mode(bank.x[k], bank.p[k], model, model.modes[k], north, east)
        bank.probability[k] = model.modes[k].start
    run.since = run.apart = run.outliers = run.lasted = run.outlier_north = run.outlier_east = run.was_outlier = 0.0
    run.step_north = run.step_east = run.was_poor = run.learnt = run.level = 0.0
    run.started = 1


@called_kernel
def start_mode(x: Floats, p: Floats, model: Model, mode: Mode, north: float, east: float) -> None:
    """State (n,) and covariance of one mode after the first fix."""
    n, processes = len(x), model.processes
    for i in range(n):
        x[i] = 0.0
        for j in range(n):
            p[i, j] = 0.0
    x[NORTH], x[EAST] = north, east
    receiver = model.receiver[0]
    p[0, 0] = receiver.fix_variance + receiver.quantum_north**2 / 12.0
    p[1, 1] = receiver.fix_variance + receiver.quantum_east**2 / 12.0
    p[2, 2] = p[3, 3] = START_SPEED_STD**2
    p[4, 4] = mode.start_rate
    for f in range(len(processes)):
        j, variance = processes[f].state, processes[f].variance
        p[j, j] = variance
        if processes[f].acts_on == ON_FIX or processes[f].frequency > 0.0:
            p[j + 1, j + 1] = variance
        if processes[f].acts_on == ON_FIX:
            for i in range(2):
                p[i, i] += variance
                p[i, j + i] = p[j + i, i] = -variance


@called_kernel
def mix(bank: Bank, modes: Records) -> None:
    """Replace every mode by the mixture of all modes from which it starts a step, see `set_shares`."""
    x, p, probability, moments = bank.x, bank.p, bank.probability, bank.moments
    predicted, shares, origin = bank.shares[0], bank.shares[1], bank.rows[0]
    m, n = x.shape
    mean = moments[m]
    reference, steady = from_likeliest(x, p, probability, moments)
    for a in range(n):
        origin[a] = x[reference, a]
    for k in range(m):
        add_second_moments(moments[k], p[k])
    total = 0.0
    for j in range(m):
        predicted[j] = set_shares(shares, probability, bank.change, j, modes[j].least_share)
        total += predicted[j]
        average(shares, moments, mean)
        take_covariance(mean, p[j])
        shifted(origin, mean, steady, x[j], p[j])
    for j in range(m):
        probability[j] = predicted[j] / total


@lean_kernel
def add_second_moments(moments: Floats, p: Floats) -> None:
    """Write the second moments P + e eᵀ (n, n) after the mean error e (n,) in `moments`."""
    n = len(p)
    second = shaped(moments[n:], (n, n))
    for a in range(n):
        for b in range(n):
            second[a, b] = p[a, b] + moments[a] * moments[b]


@lean_kernel
def take_covariance(moments: Floats, p: Floats) -> None:
    """p ← the covariance (n, n) of moments as `add_second_moments` writes them."""
    n = len(p)
    second = shaped(moments[n:], (n, n))
    for a in range(n):
        for b in range(n):
            p[a, b] = second[a, b] - moments[a] * moments[b]


@lean_kernel
def set_shares(shares: Floats, probability: Floats, change: Floats, j: int, least: float) -> float:
    """Fill the shares (m,) of all modes in the mixture from which mode j starts. Returns the probability of mode j."""
    total = kept = 0.0
    for i in range(len(shares)):
        total += probability[i] * change[i, j]
    for i in range(len(shares)):
        share = probability[i] * change[i, j] / total
        shares[i] = share * share / (share + least)
        kept += shares[i]
    for i in range(len(shares)):
        shares[i] /= kept
    return total


@called_kernel
def average(shares: Floats, rows: Floats, out: Floats) -> None:
    """out ← mean (k,) of the first m rows (≥ m, k), weighted by shares (m,)."""
    m = len(shares)
    for a in range(len(out)):
        out[a] = shares[0] * rows[0, a]
    for i in range(1, m - 1, 2):  # two at a time read and write half as often
        for a in range(len(out)):
            out[a] += shares[i] * rows[i, a] + shares[i + 1] * rows[i + 1, a]
    if m % 2 == 0:
        for a in range(len(out)):
            out[a] += shares[m - 1] * rows[m - 1, a]


@called_kernel
def steps_in(dt: float) -> int:
    """Number of steps in which an interval of dt > 0 seconds is predicted, see LONGEST_STEP."""
    if dt <= 4.0 * LONGEST_STEP:
        return max(math.ceil(dt / LONGEST_STEP - 1e-3), 1)
    return 2 * round(math.log2(dt / LONGEST_STEP))


@called_kernel
def step_of(k: int, dt: float) -> float:
    """Length (s) of the k-th step in which an interval of dt > 0 seconds is predicted."""
    steps = steps_in(dt)
    if steps <= 4:
        return dt / steps
    return dt * 2.0 ** (max(min(k, steps - 1 - k) - 1, 0) - steps // 2)


@inlined_kernel
def advance(bank: Bank, model: Model, dt: float) -> None:
    """Predict by dt > 0 seconds."""
    bank.run[0].since += dt
    for j in range(steps_in(dt)):
        take_step(bank, model, step_of(j, dt))


@inlined_kernel
def take_step(bank: Bank, model: Model, step: float) -> None:
    """Mix and predict all modes over one step (s)."""
    if abs(step - bank.steps[0].dt) > SAME_STEP * step:
        set_steps(bank, model, step)
    if len(bank.x) > 1:
        mix(bank, model.modes)
    for k in range(len(bank.x)):
        predict(bank.x[k], bank.p[k], bank.steps[k], bank.responses[k], model.driving, bank.rows)
        if loses_course(bank.x[k], bank.p[k]):
            forget_direction(bank.x[k], bank.p[k])


@called_kernel
def loses_course(x: Floats, p: Floats) -> bool:
    """Whether a mode's variance of the velocity across the course exceeds _LOST times its mean square speed."""
    return p[COURSE, COURSE] > _LOST * (x[SPEED] ** 2 + p[SPEED, SPEED])


@called_kernel
def forget_direction(x: Floats, p: Floats) -> None:
    """Give a mode that has lost its course a velocity of equal variance in all directions.

    A covariance linear in the course would spread the velocity along a line across the course. A normal course of
    variance σ² leaves exp(−σ²/2) of the mean velocity. The position changes by its regression on the velocity.
    """
    speed, across = x[SPEED], p[COURSE, COURSE]
    power = speed * speed + p[SPEED, SPEED]
    mean = speed * math.exp(-0.5 * across / power)
    spread = min(0.5 * (power - mean * mean), START_SPEED_STD**2)
    place = 0.5 * (p[NORTH, NORTH] + p[EAST, EAST])
    c, s = math.cos(x[COURSE]), math.sin(x[COURSE])
    lead = (c * p[EAST, COURSE] - s * p[NORTH, COURSE]) / across
    x[NORTH] += c * lead * (mean - speed)
    x[EAST] += s * lead * (mean - speed)
    x[SPEED] = mean
    for i in range(4):
        for j in range(len(x)):
            p[i, j] = p[j, i] = 0.0
        p[i, i] = place if i < SPEED else spread
    with_speed = lead * spread
    p[NORTH, SPEED] = p[SPEED, NORTH] = c * with_speed
    p[EAST, SPEED] = p[SPEED, EAST] = s * with_speed
    p[NORTH, COURSE] = p[COURSE, NORTH] = -s * with_speed
    p[EAST, COURSE] = p[COURSE, EAST] = c * with_speed


SHORT = 1.0
"""Step, s, up to which no step is divided. The turn in such a step stays well below a radian."""
_LONGEST, _LARGEST_TURN, _LARGEST_CHANGE = 30.0, 0.03, 0.05
"""Longest step of a vessel under way, s; its largest turn, rad; and its largest relative change of speed.
`tests/test_estimate.py` compares the estimates with steps of 1 s on generated reports."""
_SLACK = 1e-3
"""Fraction of a step by which an interval may exceed a whole number of steps."""
_DRIFTS = 0.1
"""Speed, as a fraction of the drift speed, below which motion is linear: all noise acts in any direction."""


@called_kernel
def parts_of(x: Floats, p: Floats, mode: Mode, dt: float) -> int:
    """Number of equal steps for the prediction of a mode, x (n,) and p (n, n), over dt > 0 seconds.

    A step assumes a constant turn rate and, for noise across the course, a constant speed. If the course may be lost,
    steps of 1 s show when.
    """
    most = max(math.ceil(dt / SHORT - _SLACK), 1)
    if most == 1 or x[SPEED] < _DRIFTS * mode.drift_speed:
        return 1
    if may_lose_course(x, p, mode, dt):
        return most
    turn = abs(x[RATE]) * lasting(mode.rate_decay, dt)
    parts = max(dt / _LONGEST, turn / _LARGEST_TURN, mode.speed_decay * dt / _LARGEST_CHANGE)
    return min(max(math.ceil(parts - _SLACK), 1), most)


@lean_kernel
def may_lose_course(x: Floats, p: Floats, mode: Mode, dt: float) -> bool:
    """Whether an upper bound of the variance of the course after dt exceeds 1 rad²."""
    s, u = lasting(mode.rate_decay, dt), x[SPEED]
    wander = mode.rate_noise * dt * s * s
    known = p[COURSE, COURSE] + u * s * (2.0 * abs(p[COURSE, RATE]) + u * s * p[RATE, RATE])
    return known + u * u * wander > u * u


@lean_kernel
def lasting(rate: float, dt: float) -> float:
    """Upper bound (s) of the integral over dt of a unit that decays at `rate` (1/s)."""
    return min(dt, 1.0 / rate) if rate > 0.0 else dt
