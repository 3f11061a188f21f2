"""Speed along the hull from an accelerometer, aided by whatever measures speed: over ground, through the water, or made
from the shaft's turns.

State [u b g c]: speed over ground along the hull, the accelerometer's bias, the part of gravity that a hull not quite
level lets in, and the water's own speed along the hull. g is first-order Gauss–Markov, b and c are random walks:
u̇ = a − b − g. Where P3 (22)–(30) takes an accelerometer for a speed sensor, here it is the input. Each aid is u, or
u − c, through the same scalar update and gate as the aids of the five-state filter.
"""

import math
from dataclasses import dataclass, fields

import numpy as np

from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.estimation.course.motion.five_state import decay
from steerway.estimation.course.update.aids import correct_scalar

SPEED, BIAS, LEAK, CURRENT = range(4)

START_SPEED_VARIANCE = 400.0
"""(m/s)² of a speed about which nothing is known."""


@dataclass(frozen=True)
class SurgeTuning:
    """1σ of everything, in m/s and m/s²; times in s.

    Accelerometer: `acceleration_walk` its noise density in m/s²/√Hz, `bias_std` at switching on, `bias_wander` in the
    run over `bias_time` (a random walk that begins as such a process does), `leak_std` of gravity over `leak_time`;
    `unmeasured` the density in m/s²/√Hz of accelerations while there is none. `current_std` before anything is known,
    `current_walk` m/s/√s after. Aids, one reading each: `sog_std`, `bottom_std`, `water_std`, `propeller_std`. As
    given: P3 Table III's instruments.
    """

    acceleration_walk: float = 60e-6 * 9.80665
    bias_std: float = 5e-3 * 9.80665
    bias_wander: float = 5e-6 * 9.80665
    bias_time: float = 300.0
    leak_std: float = 0.0034
    leak_time: float = 5.0
    unmeasured: float = 0.3
    current_std: float = 0.5
    current_walk: float = 0.003
    sog_std: float = 0.03
    bottom_std: float = 0.002
    water_std: float = 0.002
    propeller_std: float = 0.03

    def __post_init__(self):
        for each in fields(self):
            check = positive if each.name.endswith(("_std", "_time")) else not_negative
            check(f"surge.{each.name}", getattr(self, each.name))

    def packed(self) -> np.ndarray:
        """What the kernels read."""
        aids = (self.sog_std, self.bottom_std, self.water_std, self.propeller_std)
        return np.array(
            [
                self.acceleration_walk**2,
                self.unmeasured**2,
                2.0 * self.bias_wander**2 / self.bias_time,
                1.0 / self.leak_time,
                self.leak_std**2,
                self.current_walk**2,
                *(std**2 for std in aids),
            ]
        )


class SurgeFilter:
    """The filter alone: `predict` by what the accelerometer feels, `aid_by` what others say. Two share nothing.

    `SurgeFusion` adds what to do when they contradict each other.
    """

    def __init__(self, tuning: SurgeTuning | None = None):
        self.tuning = tuning or SurgeTuning()
        self._model = self.tuning.packed()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        t = self.tuning
        self._memory = np.zeros((7, 4))  # covariance (upper triangle), state, two rows of workspace
        self._memory[range(4), range(4)] = (START_SPEED_VARIANCE, t.bias_std**2, t.leak_std**2, t.current_std**2)

    def predict(self, acceleration: float, dt: float) -> None:
        """Advance by dt s of one acceleration along the hull (m/s², NaN for unknown)."""
        _predict(self._memory, acceleration, dt, self._model)

    def aid_by(self, sog=math.nan, bottom_speed=math.nan, water_speed=math.nan, propeller_speed=math.nan):
        """Take what others say now (m/s, along the hull). Returns their NIS: NaN for silence, above 10.8 refused."""
        return _aid(self._memory, sog, bottom_speed, water_speed, propeller_speed, self._model)

    def open(self, state: int, variance: float) -> None:
        """Let `state` be known no better than `variance`, and not through the others."""
        _open(self._memory, state, variance)

    @property
    def speed(self) -> float:
        """Speed over ground along the hull, m/s."""
        return float(self._memory[4, SPEED])

    @property
    def speed_std(self) -> float:
        return math.sqrt(self._memory[SPEED, SPEED])

    @property
    def current(self) -> float:
        """The water's speed along the hull, m/s."""
        return float(self._memory[4, CURRENT])

    @property
    def current_std(self) -> float:
        return math.sqrt(self._memory[CURRENT, CURRENT])

    @property
    def state(self) -> np.ndarray:
        """(4,) copy of [u b g c]."""
        return self._memory[4].copy()

    @property
    def covariance(self) -> np.ndarray:
        """(4, 4) covariance of `state`."""
        upper = np.triu(self._memory[:4])
        return upper + np.triu(upper, 1).T


@kernel
def _predict(memory, acceleration, dt, model):
    """x ← F x + [a dt 0 0 0], P ← F P Fᵀ + Q, in place and exact, so that the rate changes nothing."""
    p, x = memory[:4], memory[4]
    leak_left, leak_area = decay(model[3], dt)
    noise, bias_noise, leak_variance = model[0], model[2], model[4]
    if math.isfinite(acceleration):
        x[SPEED] += dt * (acceleration - x[BIAS]) - leak_area * x[LEAK]
        bias_area = dt
    else:
        noise = model[1]
        bias_area = leak_area = 0.0
    x[LEAK] *= leak_left
    uu = p[0, 0] - bias_area * p[0, 1] - leak_area * p[0, 2]
    ub = p[0, 1] - bias_area * p[1, 1] - leak_area * p[1, 2]
    ug = p[0, 2] - bias_area * p[1, 2] - leak_area * p[2, 2]
    p[0, 3] -= bias_area * p[1, 3] + leak_area * p[2, 3]
    p[0, 0] = uu - bias_area * ub - leak_area * ug + noise * dt + bias_noise * bias_area**3 / 3.0
    p[0, 1] = ub - 0.5 * bias_noise * bias_area**2
    p[0, 2] = leak_left * ug - leak_variance * model[3] * leak_area**2
    if leak_area > 0.0:
        p[0, 0] += 2.0 * leak_variance / model[3] * max(dt - 0.5 * leak_area * (3.0 - leak_left), 0.0)
    p[1, 1] += bias_noise * dt
    p[1, 2] *= leak_left
    p[2, 2] = leak_left**2 * p[2, 2] + (1.0 - leak_left**2) * leak_variance
    p[2, 3] *= leak_left
    p[3, 3] += model[5] * dt


@kernel
def _aid(memory, sog, bottom_speed, water_speed, propeller_speed, model):
    """(NIS of sog, of bottom_speed, of water_speed, of propeller_speed)."""
    p, x, work = memory[:4], memory[4], memory[5:]
    first = second = third = fourth = math.nan
    if math.isfinite(sog):
        first = correct_scalar(x, p, work, SPEED, 0, 0.0, sog - x[SPEED], model[6])
    if math.isfinite(bottom_speed):
        second = correct_scalar(x, p, work, SPEED, 0, 0.0, bottom_speed - x[SPEED], model[7])
    if math.isfinite(water_speed):
        innovation = water_speed - (x[SPEED] - x[CURRENT])
        third = correct_scalar(x, p, work, SPEED, CURRENT, -1.0, innovation, model[8])
    if math.isfinite(propeller_speed):
        innovation = propeller_speed - (x[SPEED] - x[CURRENT])
        fourth = correct_scalar(x, p, work, SPEED, CURRENT, -1.0, innovation, model[9])
    return first, second, third, fourth


@kernel
def _open(memory, state, variance):
    for i in range(4):
        memory[min(i, state), max(i, state)] = 0.0
    memory[state, state] = variance
