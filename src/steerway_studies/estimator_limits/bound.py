"""Truth for the limits of course estimation: a vessel that alternates straight legs and turns.

The mode is a Markov jump process in continuous time; speed and course rate follow P0 (13) and (15)
with the noise densities and the decay of the mode. Both are sampled exactly from the filter's model, so that a filter
with the parameters below has no model error.

The bound is the Riccati recursion at the true trajectory with known modes: the Cramér–Rao bound of P. Tichavský,
C. H. Muravchik and A. Nehorai, IEEE Trans. Signal Processing 46(5), 1998, for a vessel with the states of P0 (11)–(15).
No unbiased estimator is more accurate.
"""

import math
from dataclasses import dataclass

import numpy as np

from steerway.core import Fixes, kernel
from steerway.estimation import Profile
from steerway.sensors import Gnss

_START_SPEED_STD, _LARGEST_START_RATE_STD = 20.0, math.radians(20.0)
"""1σ of speed (m/s) and largest 1σ of course rate (rad/s) after a single fix, as in the filter."""


@dataclass(frozen=True)
class LimitsScenario:
    """A vessel and its runs. Rows count as straight from `recovery` s after a turn on."""

    profile: Profile  # the true motion model; the receiver is added by `known`
    speed: float
    duration: float
    runs: int
    recovery: float
    settling: float  # s at the beginning that are not judged
    rate: float = 5.0  # fixes a second

    def known(self, position_std: float) -> Profile:
        """The true parameters of vessel and receiver (white noise of `position_std` m), for a filter."""
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
    """The true motion: arrays (n,) at the times of the fixes, SI and radians in a tangent plane."""

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
    n, dt = round(scenario.duration * scenario.rate) + 1, 1.0 / scenario.rate
    models, leaving = _modes(scenario.profile)
    spreads = np.stack([_spread(model, dt) for model in models])
    # In continuous time: within one step a mode may be left and entered again.
    turned = (1.0 - math.exp(-leaving.sum() * dt)) / leaving.sum()
    states, turning = np.empty((n, 5)), np.empty(n, np.bool_)
    states[0] = 0.0, 0.0, scenario.speed, chance.uniform(-math.pi, math.pi), 0.0
    _sail(chance.standard_normal((n, 5)), chance.random(n), dt, models, spreads, leaving * turned, states, turning)
    return TrueMotion(np.arange(n) * dt, *states.T.copy(), turning)


def _modes(profile) -> tuple[np.ndarray, np.ndarray]:
    """(2, 4) S_U, α1, S_ω and α2 of a held course and of a turn, and (2,) rates (1/s) at which the modes end."""
    held = profile.speed_noise, profile.speed_decay, profile.course_rate_noise, profile.course_rate_decay
    turn = profile.turn_speed_noise, held[1], profile.turn_course_rate_noise, profile.turn_course_rate_decay
    return np.array([held, turn]), np.array([1.0 / profile.straight_time, 1.0 / profile.turn_time])


@kernel
def _responses(rate, t):
    """Values at t of a state that decays from 1 at `rate`, of its integral, and of its double integral."""
    a = rate * t
    if a < 0.02:
        area = 0.5 - a * (1.0 / 6.0 - a * (1.0 / 24.0 - a * (1.0 / 120.0 - a / 720.0)))
        return 1.0 - a * (1.0 - a * area), t * (1.0 - a * area), t * t * area
    once = -math.expm1(-a) / rate
    return math.exp(-a), once, (t - once) / rate


@kernel
def _gathered(rate, t):
    """(3, 3) covariance of the `_responses` after t of unit white noise, by Gauss and Legendre's rule of 3 nodes."""
    found = np.zeros((3, 3))
    for k in range(-1, 2):
        at = _responses(rate, t * (0.5 + k * math.sqrt(0.15)))
        for i in range(3):
            for j in range(3):
                found[i, j] += t * (4.0 / 9.0 if k == 0 else 5.0 / 18.0) * at[i] * at[j]
    return found


def _spread(model, dt) -> np.ndarray:
    """Factor of the noise that a step adds to (distance, speed) and (cross distance per m/s, course, course rate)."""
    along, across = model[0] * _gathered(model[1], dt)[1::-1, 1::-1], model[2] * _gathered(model[3], dt)[::-1, ::-1]
    spread = np.zeros((5, 5))
    spread[:2, :2], spread[2:, 2:] = np.linalg.cholesky(along), np.linalg.cholesky(across)
    return spread


@kernel
def _moved(x, dt, model, f):
    """The state after a step of (11)–(15) along its arc; fills f (5, 5) with the Jacobian."""
    u, w = x[2], x[4]
    left, way, _ = _responses(model[1], dt)
    rate_left, turn, area = _responses(model[3], dt)
    half = 0.5 * turn * w
    ratio, slope = 1.0 - half**2 / 6.0, -half / 3.0
    if abs(half) > 1e-3:
        ratio = math.sin(half) / half
        slope = (math.cos(half) - ratio) / half
    c, s = math.cos(x[3] + area / dt * w), math.sin(x[3] + area / dt * w)
    length, along = u * way * ratio, 0.5 * turn * slope * u * way
    across = area / dt * length
    f[:] = np.eye(5)
    f[0, 2], f[0, 3], f[0, 4] = way * ratio * c, -length * s, along * c - across * s
    f[1, 2], f[1, 3], f[1, 4] = way * ratio * s, length * c, along * s + across * c
    f[2, 2], f[3, 4], f[4, 4] = left, turn, rate_left
    return np.array([x[0] + length * c, x[1] + length * s, u * left, x[3] + turn * w, w * rate_left])


@kernel
def _noise(x, dt, model):
    """(5, 5) covariance of the noise that a step from state x adds."""
    mean = x[3] + x[4] * _responses(model[3], dt)[2] / dt
    c, s = math.cos(mean), math.sin(mean)
    by_speed, by_rate = np.zeros((5, 3)), np.zeros((5, 3))
    by_speed[0, 1], by_speed[1, 1], by_speed[2, 0] = c, s, 1.0
    by_rate[0, 2], by_rate[1, 2], by_rate[3, 1], by_rate[4, 0] = -x[2] * s, x[2] * c, 1.0, 1.0
    along = model[0] * by_speed @ _gathered(model[1], dt) @ by_speed.T.copy()
    return along + model[2] * by_rate @ _gathered(model[3], dt) @ by_rate.T.copy()


@kernel
def _sail(normals, uniforms, dt, models, spreads, changes, states, turning):
    mode, f = 0, np.empty((5, 5))
    turning[0] = False
    for k in range(1, len(states)):
        u, course, rate = states[k - 1, 2], states[k - 1, 3], states[k - 1, 4]
        states[k], noise = _moved(states[k - 1], dt, models[mode], f), spreads[mode] @ normals[k]
        mean = course + rate * _responses(models[mode, 3], dt)[2] / dt
        c, s = math.cos(mean), math.sin(mean)
        states[k, 0] += c * noise[0] - s * u * noise[2]
        states[k, 1] += s * noise[0] + c * u * noise[2]
        states[k, 2] += noise[1]
        states[k, 3] += noise[3]
        states[k, 4] += noise[4]
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
    """(n, 5, 5) least covariance of [x^n y^n U χ ω_χ] of any causal estimator after each fix of this run."""
    covariance = np.empty((len(voyage.time), 5, 5))
    models, _ = _modes(profile)
    stationary = math.sqrt(0.5 * models[1, 2] / models[1, 3]) if models[1, 3] > 0.0 else math.inf
    rate_std = min(stationary, _LARGEST_START_RATE_STD)
    covariance[0] = np.diag([profile.position_std**2] * 2 + [_START_SPEED_STD**2, 1.0, rate_std**2])
    _riccati(voyage.time, voyage.states, voyage.turning, models, profile.position_std**2, covariance)
    return covariance


def smoothing_bound(voyage, profile) -> np.ndarray:
    """(n, 5, 5) least covariance of any estimator that uses the whole record."""
    covariance = filtering_bound(voyage, profile)
    _smooth(voyage.time, voyage.states, voyage.turning, _modes(profile)[0], covariance)
    return covariance


@kernel
def _riccati(time, states, turning, models, variance, covariance):
    f, noise = np.empty((5, 5)), variance * np.eye(2)
    for k in range(1, len(time)):
        dt, model = time[k] - time[k - 1], models[int(turning[k - 1])]
        _moved(states[k - 1], dt, model, f)
        p = f @ covariance[k - 1] @ f.T.copy() + _noise(states[k - 1], dt, model)
        gain = np.linalg.solve(p[:2, :2].copy() + noise, p[:2].copy())
        p -= gain.T.copy() @ p[:2].copy()
        covariance[k] = 0.5 * (p + p.T)


@kernel
def _smooth(time, states, turning, models, covariance):
    f = np.empty((5, 5))
    for k in range(len(time) - 2, -1, -1):
        dt, model = time[k + 1] - time[k], models[int(turning[k])]
        _moved(states[k], dt, model, f)
        moved = f @ covariance[k]
        p_next = moved @ f.T.copy() + _noise(states[k], dt, model)
        gain = np.linalg.solve(p_next, moved)
        p = covariance[k] + gain.T.copy() @ (covariance[k + 1] - p_next) @ gain
        covariance[k] = 0.5 * (p + p.T)
