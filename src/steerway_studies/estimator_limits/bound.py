"""Truth for the limits of course estimation: a vessel that alternates straight legs and turns.

The mode is a Markov jump process in continuous time; speed and course rate follow P0 (13) and (15)
with the noise densities and the decay of the mode. Both are sampled exactly as the filter's model has them,
so that a filter with the parameters below errs by nothing but what it cannot know.

The bound is what no estimator can do better than, the Riccati recursion at the true trajectory with the mode of motion
known: the Cramér–Rao bound of P. Tichavský, C. H. Muravchik and A. Nehorai, IEEE Trans. Signal Processing 46(5), 1998,
for a vessel whose states are those of P0 (11)–(15).
"""

import math
from dataclasses import dataclass

import numpy as np

from steerway.core import Fixes, fill_lower, kernel
from steerway.estimation import Profile
from steerway.estimation.course import (
    LEAVING,
    POSITION_VARIANCE,
    Q_LL,
    Q_LU,
    Q_UU,
    Q_WW,
    Q_XW,
    Q_XX,
    Q_YW,
    Q_YX,
    Q_YY,
    RATE_LEFT,
    SPEED_LEFT,
    START_RATE_VARIANCE,
    START_SPEED_VARIANCE,
    TURN,
    chord,
    correct,
    set_step,
    smoothing_step,
    transition,
)
from steerway.estimation.course import predict_five_state as predict
from steerway.sensors import Gnss


@dataclass(frozen=True)
class LimitsScenario:
    """A vessel, the duration of a run, and how long after a turn rows do not yet count as straight."""

    profile: Profile  # the true motion model; the receiver is added by `known`
    speed: float
    duration: float
    runs: int
    recovery: float
    settling: float  # s at the beginning that count for nothing
    rate: float = 5.0  # fixes a second

    def known(self, position_std: float) -> Profile:
        """The true parameters with those of a receiver of white noise (m), as given to a filter."""
        return self.profile.model_copy(update={"position_std": position_std})


SLOW = LimitsScenario(
    profile=Profile(
        name="O",
        position_std=0.5,
        speed_noise=1e-4,
        course_rate_noise=1e-5,
        course_rate_decay=1.0,
        straight_time=40.0,
        turn_time=10.0,
        turn_speed_noise=1e-4,
        turn_course_rate_noise=7.8e-3,
        turn_course_rate_decay=0.2,
    ),
    speed=1.3,
    duration=300.0,
    runs=60,
    recovery=10.0,
    settling=30.0,
)
"""Scenario O: a small craft at 1.3 m/s with frequent turns."""

FAST = LimitsScenario(
    profile=Profile(
        name="M",
        position_std=0.5,
        speed_noise=1e-5,
        course_rate_noise=1e-8,
        course_rate_decay=0.05,
        straight_time=400.0,
        turn_time=100.0,
        turn_speed_noise=5e-3,
        turn_course_rate_noise=4.4e-6,
        turn_course_rate_decay=0.02,
    ),
    speed=7.7,
    duration=2500.0,
    runs=30,
    recovery=50.0,
    settling=100.0,
)
"""Scenario M: a ship at 7.7 m/s with long legs and slow turns."""


@dataclass(frozen=True)
class TrueMotion:
    """What truly happened: arrays (n,) at the times of the fixes, SI and radians in a tangent plane."""

    time: np.ndarray
    north: np.ndarray
    east: np.ndarray
    sog: np.ndarray
    cog: np.ndarray
    course_rate: np.ndarray
    turning: np.ndarray  # bool: the mode from this row to the next

    @property
    def states(self) -> np.ndarray:
        """(n, 5) [x^n y^n U χ ω_χ]."""
        return np.column_stack([self.north, self.east, self.sog, self.cog, self.course_rate])

    def fixes(self, gnss: Gnss, seed) -> Fixes:
        """Fixes of a receiver; the plane touches the equator, where north and east become degrees without error."""
        return gnss.fixes(self.time, self.north, self.east, seed)


def sail(scenario: LimitsScenario, seed: int) -> TrueMotion:
    """One voyage."""
    chance = np.random.default_rng([seed, 0])
    n = round(scenario.duration * scenario.rate) + 1
    models = scenario.profile.modes()
    steps = np.zeros((2, 3, 5))
    spreads = np.zeros((2, 5, 5))
    for k, model in enumerate(models):
        _fill_step(steps[k], 1.0 / scenario.rate, model)
        spreads[k] = _spread(steps[k])
    # In continuous time: within one step a mode may be left and entered again.
    leaving = models[:, LEAVING]
    turned = (1.0 - math.exp(-leaving.sum() / scenario.rate)) / leaving.sum()
    states, turning = np.empty((n, 5)), np.empty(n, np.bool_)
    states[0] = 0.0, 0.0, scenario.speed, chance.uniform(-math.pi, math.pi), 0.0
    _sail(chance.standard_normal((n, 5)), chance.random(n), steps, spreads, leaving * turned, states, turning)
    return TrueMotion(np.arange(n) / scenario.rate, *states.T.copy(), turning)


@kernel
def _fill_step(step, dt, model):
    set_step(step, dt, model)


def _spread(step) -> np.ndarray:
    """Factor of what one step adds to (way, speed) and (way across for each m/s, course, course rate)."""
    along = np.array([[step[Q_LL], step[Q_LU]], [step[Q_LU], step[Q_UU]]])
    across = np.array(
        [
            [step[Q_YY], step[Q_YX], step[Q_YW]],
            [step[Q_YX], step[Q_XX], step[Q_XW]],
            [step[Q_YW], step[Q_XW], step[Q_WW]],
        ]
    )
    spread = np.zeros((5, 5))
    spread[:2, :2], spread[2:, 2:] = np.linalg.cholesky(along), np.linalg.cholesky(across)
    return spread


@kernel
def _sail(normals, uniforms, steps, spreads, changes, states, turning):
    mode = 0
    turning[0] = False
    for k in range(1, len(states)):
        step, noise = steps[mode], spreads[mode] @ normals[k]
        north, east, u, course, rate = states[k - 1]
        c, s, north_way, east_way, _, _, _, _ = chord(u, course, rate, step)
        states[k, 0] = north + north_way + c * noise[0] - s * u * noise[2]
        states[k, 1] = east + east_way + s * noise[0] + c * u * noise[2]
        states[k, 2] = u * step[SPEED_LEFT] + noise[1]
        states[k, 3] = course + step[TURN] * rate + noise[3]
        states[k, 4] = rate * step[RATE_LEFT] + noise[4]
        if uniforms[k] < changes[mode]:
            mode = 1 - mode
        turning[k] = mode == 1


def straight_and_turning(scenario: LimitsScenario, voyage: TrueMotion) -> tuple[np.ndarray, np.ndarray]:
    """(n,) bool each: rows on straight legs, and in turns."""
    since_turn = np.full(len(voyage.time), np.inf)
    rows = np.flatnonzero(voyage.turning)
    if len(rows):
        last = np.searchsorted(rows, np.arange(len(voyage.time)), side="right") - 1
        since_turn = np.where(last >= 0, voyage.time - voyage.time[rows[last]], np.inf)
    settled = voyage.time >= scenario.settling
    return settled & (since_turn > scenario.recovery), settled & voyage.turning


def filtering_bound(voyage, profile) -> np.ndarray:
    """(n, 5, 5) covariance of [x^n y^n U χ ω_χ] after each fix that no causal estimator betters on this voyage."""
    covariance = np.empty((len(voyage.time), 5, 5))
    _riccati(voyage.time, voyage.states, voyage.turning, profile.modes(), covariance)
    return covariance


def smoothing_bound(voyage, profile) -> np.ndarray:
    """(n, 5, 5) covariance that no estimator betters that knows the whole record."""
    covariance = filtering_bound(voyage, profile)
    _smooth(voyage.time, voyage.states, voyage.turning, profile.modes(), covariance)
    return covariance


@kernel
def _riccati(time, states, turning, models, covariance):
    n = states.shape[1]
    p, work, steps = np.zeros((n, n)), np.zeros((4, n)), np.zeros((2, 3, n))
    variance = models[0, POSITION_VARIANCE]
    p[0, 0] = p[1, 1] = variance
    p[2, 2], p[4, 4] = models[0, START_SPEED_VARIANCE], models[1, START_RATE_VARIANCE]
    p[3, 3] = 1.0
    covariance[0] = p
    for k in range(1, len(time)):
        mode = int(turning[k - 1])
        set_step(steps[mode], time[k] - time[k - 1], models[mode])
        predict(states[k - 1].copy(), p, steps[mode], models[mode])
        correct(states[k].copy(), p, work, 0.0, 0.0, p[0, 0] + variance, p[0, 1], p[1, 1] + variance, 0)
        fill_lower(p)
        covariance[k] = p


@kernel
def _smooth(time, states, turning, models, covariance):
    n = states.shape[1]
    f, gain, lower, product = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    scale, still, steps = np.empty(n), np.zeros(n), np.zeros((2, 3, n))
    p_later = covariance[-1].copy()
    for k in range(len(time) - 2, -1, -1):
        mode = int(turning[k])
        p_next = covariance[k].copy()
        set_step(steps[mode], time[k + 1] - time[k], models[mode])
        transition(states[k], True, steps[mode], models[mode], f)
        predict(states[k].copy(), p_next, steps[mode], models[mode])
        smoothing_step(states[k].copy(), covariance[k], f, p_next, still, p_later, gain, lower, product, scale)
        fill_lower(covariance[k])
        p_later[:] = covariance[k]
