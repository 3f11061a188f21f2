"""Speed along the hull from an accelerometer, aided by whatever measures speed: over ground, through the water, or
computed from shaft speed.

State [u b g c k]: speed over ground along the hull, the accelerometer's bias, the component of gravity along a hull
that is not level, the speed of the current along the hull, and the log's scale error. u̇ = a − b − g; g is first-order
Gauss–Markov; b, c and k are random walks. P3 (22)–(30) treats the accelerometer as a speed sensor; here it is the
input. The receiver measures u, the propeller u − c, and the log (1 + k) u or (1 + k) (u − c): over the ground,
comparison with the receiver's speed determines its scale. Every reading must pass `AID_GATE`.
"""

import math
from dataclasses import dataclass, fields

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.earth import STANDARD_GRAVITY
from steerway.core.errors import InputError
from steerway.core.kalman import correct_scalar, take_scalar
from steerway.core.linear_algebra import symmetric
from steerway.core.statistics import AID_GATE, DIFFUSE_SPEED_STD
from steerway.estimation.filter.discrete import decaying

SPEED, BIAS, LEAK, CURRENT, SCALE = range(5)
STATES = 5
_STATE = STATES
"""Row of the state below the covariance."""


@dataclass(frozen=True)
class SurgeTuning:
    """1σ of everything, in m/s and m/s²; times in s.

    Accelerometer: `acceleration_walk` its noise density in m/s²/√Hz, `bias_std` at switching on, `bias_wander` of a
    Gauss–Markov bias over `bias_time` (modelled as a random walk with the same growth at first), `leak_std` of gravity
    over `leak_time`; `unmeasured` the density in m/s²/√Hz of accelerations while none is measured. `current_std` at the
    start, `current_walk` m/s/√s after; `scale_std` of the log's scale error and `scale_walk` 1/√s after, 0 for a log
    without one. Aids, one reading each: `sog_std`, `bottom_std`, `water_std`, `propeller_std`. Defaults: P3 Table III's
    instruments, with the scale error that data sheets of Doppler logs state.
    """

    acceleration_walk: float = 60e-6 * STANDARD_GRAVITY
    bias_std: float = 5e-3 * STANDARD_GRAVITY
    bias_wander: float = 5e-6 * STANDARD_GRAVITY
    bias_time: float = 300.0
    leak_std: float = 0.0034
    leak_time: float = 5.0
    unmeasured: float = 0.3
    current_std: float = 0.5
    current_walk: float = 0.003
    scale_std: float = 0.003
    scale_walk: float = 1e-6
    sog_std: float = 0.03
    bottom_std: float = 0.002
    water_std: float = 0.002
    propeller_std: float = 0.03

    def __post_init__(self) -> None:
        for each in fields(self):
            check = positive if each.name.endswith(("_std", "_time")) and each.name != "scale_std" else not_negative
            check(f"surge.{each.name}", getattr(self, each.name))

    def packed(self) -> Floats:
        """The numbers as the kernels read them."""
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
                self.scale_walk**2 if self.scale_std > 0.0 else 0.0,
            ]
        )


class SurgeFilter:
    """The filter alone: `predict` by the accelerometer, `aid_by` the other instruments.

    `SurgeFusion` adds fault detection.
    """

    def __init__(self, tuning: SurgeTuning | None = None) -> None:
        self.tuning = tuning or SurgeTuning()
        self._model = self.tuning.packed()
        self.reset()

    def reset(self) -> None:
        """Start again from nothing."""
        t = self.tuning
        self._filter_state = np.zeros((STATES + 3, STATES))  # covariance (upper triangle), state, two rows of workspace
        variances = (DIFFUSE_SPEED_STD**2, t.bias_std**2, t.leak_std**2, t.current_std**2, t.scale_std**2)
        self._filter_state[range(STATES), range(STATES)] = variances

    def predict(self, acceleration: float, dt: float) -> None:
        """Advance by dt s of one acceleration along the hull (m/s², NaN for unknown). Raises InputError for dt < 0."""
        _predict(self._filter_state, acceleration, not_negative("dt", dt), self._model)

    def aid_by(
        self,
        sog: float = math.nan,
        bottom_speed: float = math.nan,
        water_speed: float = math.nan,
        propeller_speed: float = math.nan,
    ) -> tuple[float, float, float, float]:
        """Take present speeds (m/s, along the hull, NaN for none). Returns their NIS; those above 10.8 are rejected."""
        return _aid(self._filter_state, sog, bottom_speed, water_speed, propeller_speed, self._model)

    def open(self, state: int, variance: float) -> None:
        """Set the variance of `state` (0 to 4) and its correlations to 0. Raises InputError for another index."""
        if state not in range(STATES):
            raise InputError(f"surge.state is {state}, expected 0 to {STATES - 1}")
        covariance = self._filter_state[:STATES]
        covariance[state] = covariance[:, state] = 0.0
        covariance[state, state] = variance

    @property
    def speed(self) -> float:
        """Speed over ground along the hull, m/s."""
        return float(self._filter_state[_STATE, SPEED])

    @property
    def speed_std(self) -> float:
        return math.sqrt(self._filter_state[SPEED, SPEED])

    @property
    def current(self) -> float:
        """Speed of the current along the hull, m/s; a log's speed through water or the propeller shows it."""
        return float(self._filter_state[_STATE, CURRENT])

    @property
    def current_std(self) -> float:
        return math.sqrt(self._filter_state[CURRENT, CURRENT])

    @property
    def acceleration_error(self) -> float:
        """Error of the accelerometer's reading: bias and gravity, m/s²."""
        return float(self._filter_state[_STATE, BIAS] + self._filter_state[_STATE, LEAK])

    @property
    def log_scale(self) -> float:
        """Factor of the log's reading on the speed."""
        return 1.0 + float(self._filter_state[_STATE, SCALE])

    @property
    def log_scale_std(self) -> float:
        return math.sqrt(self._filter_state[SCALE, SCALE])

    @property
    def state(self) -> Floats:
        """(5,) copy of [u b g c k]."""
        return self._filter_state[_STATE].copy()

    @property
    def covariance(self) -> Floats:
        """(5, 5) covariance of `state`."""
        return symmetric(self._filter_state[:STATES])


@kernel
def _predict(filter_state: Floats, acceleration: float, dt: float, model: Floats) -> None:
    """x ← F x + [a dt 0 0 0], P ← F P Fᵀ + Q, in place and exact: the rate of calls does not matter."""
    p, x = filter_state[:STATES], filter_state[_STATE]
    leak_left, leak_area, _ = decaying(model[3], dt)
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
    for j in range(CURRENT, STATES):
        p[0, j] -= bias_area * p[1, j] + leak_area * p[2, j]
    p[0, 0] = uu - bias_area * ub - leak_area * ug + noise * dt + bias_noise * bias_area**3 / 3.0
    p[0, 1] = ub - 0.5 * bias_noise * bias_area**2
    p[0, 2] = leak_left * ug - leak_variance * model[3] * leak_area**2
    if leak_area > 0.0:
        p[0, 0] += 2.0 * leak_variance / model[3] * max(dt - 0.5 * leak_area * (3.0 - leak_left), 0.0)
    p[1, 1] += bias_noise * dt
    p[1, 2] *= leak_left
    p[2, 2] = leak_left**2 * p[2, 2] + (1.0 - leak_left**2) * leak_variance
    for j in range(CURRENT, STATES):
        p[2, j] *= leak_left
    p[3, 3] += model[5] * dt
    p[4, 4] += model[10] * dt


@kernel
def _take_log(x: Floats, p: Floats, work: Floats, reading: float, through_water: bool, variance: float) -> float:
    """Take a log's reading (1 + k)(u − c); c = 0 over the ground. Returns its NIS.

    Through the water scale and current can hardly be distinguished: the scale's uncertainty counts, but the scale is
    not corrected (Schmidt's consider filter).
    """
    scale, speed = 1.0 + x[SCALE], x[SPEED] - (x[CURRENT] if through_water else 0.0)
    pc, s = work[0], variance
    for j in range(STATES):
        pc[j] = scale * p[min(SPEED, j), max(SPEED, j)] + speed * p[min(SCALE, j), max(SCALE, j)]
        if through_water:
            pc[j] -= scale * p[min(CURRENT, j), max(CURRENT, j)]
    s += scale * pc[SPEED] + speed * pc[SCALE]
    if through_water:
        s -= scale * pc[CURRENT]
    # The product of two errors is left out of the slopes; it is part of the variance.
    s += p[SPEED, SPEED] * p[SCALE, SCALE]
    innovation = reading - scale * speed
    if not through_water:
        return float(take_scalar(x, p, pc, work[1], s, innovation))
    nis = innovation * innovation / s
    if nis <= AID_GATE:
        for i in range(SCALE):
            x[i] += pc[i] / s * innovation
        for i in range(SCALE):
            for j in range(i, STATES):
                p[i, j] -= pc[i] * pc[j] / s
    return nis


@kernel
def _aid(
    filter_state: Floats, sog: float, bottom_speed: float, water_speed: float, propeller_speed: float, model: Floats
) -> tuple[float, float, float, float]:
    """(NIS of sog, of bottom_speed, of water_speed, of propeller_speed)."""
    p, x, work = filter_state[:STATES], filter_state[_STATE], filter_state[_STATE + 1 :]
    first = second = third = fourth = math.nan
    if math.isfinite(sog):
        first = correct_scalar(x, p, work, SPEED, 0, 0.0, sog - x[SPEED], model[6])
    if math.isfinite(bottom_speed):
        second = _take_log(x, p, work, bottom_speed, False, model[7])
    if math.isfinite(water_speed):
        third = _take_log(x, p, work, water_speed, True, model[8])
    if math.isfinite(propeller_speed):
        innovation = propeller_speed - (x[SPEED] - x[CURRENT])
        fourth = correct_scalar(x, p, work, SPEED, CURRENT, -1.0, innovation, model[9])
    return first, second, third, fourth
