"""The linear plant of predictive and LQG heading control, its limits and its observer.

A plant is discrete, x(k+1) = A x + B (u + d), y = C x, with y the heading (rad) and d an unknown bias of the input.
`HeadingResponse` describes an identified heading, or Nomoto's K and T; `parts_for` builds plant and observer from it.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.checks import positive, positive_or_unlimited
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.linear_algebra import multiply, multiply_transposed


@dataclass(frozen=True)
class LinearPlant:
    """x(k+1) = A x(k) + B (u(k) + d(k)), y = C x: A (n, n), B (n,), C (n,); y an angle in rad if `circular`."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    circular: bool = True

    def __post_init__(self) -> None:
        a, b, c = (np.array(each, dtype=np.float64) for each in (self.a, self.b, self.c))
        n = len(b)
        if a.shape != (n, n) or b.shape != (n,) or c.shape != (n,):
            raise InputError(f"plant has A {a.shape}, B {b.shape}, C {c.shape}, expected (n, n), (n,) and (n,)")
        for name, value in zip("abc", (a, b, c), strict=True):
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class InputLimits:
    """|u| ≤ size, |Δu| ≤ change; infinity for no limit."""

    size: float = math.inf
    change: float = math.inf

    def __post_init__(self) -> None:
        for name in ("size", "change"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"limits.{name} is {getattr(self, name)}, expected more than 0")


class BiasObserver:
    """Kalman filter on [x, d], the plant states and the input bias, for MPC and LQG.

    state_noise (n,) and bias_noise: process noise variances per step; reading_variance: variance of one measured
    output; bias_start: initial variance of `bias`. Units are the plant's.
    """

    def __init__(
        self,
        plant: LinearPlant,
        state_noise: ArrayLike,
        bias_noise: float,
        reading_variance: float,
        bias_start: float,
        bias: float = 0.0,
    ):
        n = len(plant.b)
        self._transition = np.eye(n + 1)
        self._transition[:n, :n] = plant.a
        self._transition[:n, n] = plant.b
        self._input = np.append(plant.b, 0.0)
        self._output = np.append(plant.c, 0.0)
        self._noise = np.append(np.broadcast_to(np.asarray(state_noise, dtype=np.float64), n), bias_noise)
        self._variance = float(reading_variance)
        self._start = np.append(np.broadcast_to(np.asarray(state_noise, dtype=np.float64), n), bias_start)
        self._turn = math.tau if plant.circular else math.inf
        # The slowest mode of the plant, scaled to an output of 1: for a heading, the integrator.
        poles, modes = np.linalg.eig(plant.a)
        slowest = np.real(modes[:, int(np.argmax(np.abs(poles)))])
        self._at_rest = slowest / (plant.c @ slowest)
        self._first_bias = bias
        self.reset()

    def reset(self, states: ArrayLike = 0.0) -> None:
        """Restart from `states` (n,) with the initial bias."""
        self.state = np.zeros(len(self._input))
        self.state[:-1], self.state[-1] = states, self._first_bias
        self._covariance = np.diag(self._start)
        self._work = np.empty((3, len(self.state), len(self.state)))

    def begin(self, output: float) -> None:
        """Move the states to rest at this output, and add the variance of one reading to their covariance."""
        self.state[:-1] += self._at_rest * (output - self.output)
        self._covariance[:-1, :-1] += self._variance * np.outer(self._at_rest, self._at_rest)

    @property
    def bias(self) -> float:
        """Estimated bias of the input."""
        return float(self.state[-1])

    @property
    def output(self) -> float:
        """Output c x of the estimated states."""
        return float(self._output @ self.state)

    def correct(self, output: float) -> None:
        """Update with a measured output; NaN is ignored."""
        _correct(self.state, self._covariance, self._output, output, self._variance, self._turn)

    def predict(self, applied: float) -> None:
        """Predict one step with the applied input."""
        _predict(self.state, self._covariance, self._transition, self._input, applied, self._noise, self._work)


class Identified(Protocol):
    """The interface of `identification.IdentifiedHeading` and `HeadingResponse`."""

    @property
    def poles(self) -> tuple[float, float]: ...
    @property
    def gains(self) -> tuple[float, float]: ...
    @property
    def sample(self) -> float: ...
    @property
    def bias(self) -> float: ...
    @property
    def residual_rms(self) -> float: ...


@dataclass(frozen=True)
class HeadingResponse:
    """ψ = y1 + y2, y_i(k+1) = p_i y_i(k) + g_i (u(k) + bias): gains in rad per unit of input and sample, sample in s.

    residual_rms: RMS difference of heading and model, rad.
    """

    poles: tuple[float, float]
    gains: tuple[float, float]
    sample: float
    bias: float = 0.0
    residual_rms: float = 0.0

    @classmethod
    def of_nomoto(cls, gain: float, time: float, sample: float | None = None) -> "HeadingResponse":
        """The response T ω̇ + ω = K u, discretised exactly; the default sample is T/10, at most 2 s."""
        positive("nomoto.time_constant", time)
        h = min(0.1 * time, 2.0) if sample is None else positive("heading.sample", sample)
        kept = math.exp(-h / time)
        return cls((1.0, kept), (gain * h, -gain * time * (1.0 - kept)), h)


WALK = 0.1
"""1σ of the random walk of the input bias in one (second) time constant of the response, as a fraction of the input
limit. It is large enough to follow the model error during a turn."""
SURE_DEG = 0.2
"""Lower limit of the noise of a heading estimate in the observer, °·√s. At 1 Hz it is twice the last digit of HDT."""


def parts_for(
    identified: Identified, limit: float, rate: float = math.inf, angle_std: float = 0.0
) -> tuple[LinearPlant, InputLimits, BiasObserver]:
    """Plant, limits and observer for an identified heading response.

    `limit`: largest |u|; `rate`: largest change of u per second, in the input's unit; `angle_std`: 1σ of an estimated
    heading, rad. The initial σ of the input bias is 7 % of the limit, as in P4. Raises InputError for unusable numbers.
    """
    positive("heading.limit", limit)
    positive_or_unlimited("heading.rate", rate)
    h = positive("heading.sample", identified.sample)
    plant = LinearPlant(np.diag(identified.poles), np.array(identified.gains), np.ones(2))
    fast = identified.poles[1]
    time = -h / math.log(fast) if 0.0 < fast < 1.0 else h
    reading = max(math.radians(SURE_DEG) ** 2 / h, identified.residual_rms**2, angle_std**2)
    observer = BiasObserver(
        plant, 1e-9 * h, (WALK * limit) ** 2 * h / time, reading, (0.07 * limit) ** 2, identified.bias
    )
    return plant, InputLimits(limit, rate * h), observer


@kernel
def _correct(x: Floats, p: Floats, output: Floats, reading: float, variance: float, turn: float) -> None:
    if not math.isfinite(reading):
        return
    n = len(x)
    pc = np.empty(n)
    s, innovation = variance, reading
    for i in range(n):
        pc[i] = 0.0
        for j in range(n):
            pc[i] += p[i, j] * output[j]
        innovation -= output[i] * x[i]
    for i in range(n):
        s += output[i] * pc[i]
    if turn < math.inf:
        innovation -= turn * round(innovation / turn)
    for i in range(n):
        x[i] += pc[i] / s * innovation
        for j in range(n):
            p[i, j] -= pc[i] * pc[j] / s


@kernel
def _predict(
    x: Floats, p: Floats, transition: Floats, inputs: Floats, applied: float, noise: Floats, work: Floats
) -> None:
    n = len(x)
    multiply(transition, p, work[0])
    multiply_transposed(work[0], transition, p)
    for i in range(n):
        work[1, 0, i] = inputs[i] * applied
        for j in range(n):
            work[1, 0, i] += transition[i, j] * x[j]
        p[i, i] += noise[i]
    x[:] = work[1, 0]


class SampledHeading(ABC):
    """Base of predictive and LQG control: one step per sample, from the observer's states to the input.

    `input` is the last commanded input. A subclass defines `change`, the Δu at the observer's states.
    """

    def __init__(self, plant: LinearPlant, limits: InputLimits, observer: BiasObserver) -> None:
        if len(observer.state) != len(plant.b) + 1:
            raise InputError(
                f"observer has {len(observer.state)} states, expected the {len(plant.b)} of the plant and the bias"
            )
        self._plant, self._limits, self.observer = plant, limits, observer
        self.reset()

    def reset(self, states: ArrayLike | None = None, applied: float = 0.0) -> None:
        """Restart from `states` (n,), or at rest on the first known heading, with `applied` as the last input. Raises
        InputError for an input that is not finite."""
        if not math.isfinite(applied):
            raise InputError(f"applied is {applied:g}, expected a finite number")
        self.observer.reset(0.0 if states is None else states)
        self.input = applied
        self._is_begun = states is not None

    def step(self, wanted: float, estimated: float) -> float:
        """The input for the next step; headings in rad. An unknown (NaN) estimate is replaced by the prediction. Before
        the first known estimate, the input is held."""
        if not self._is_begun:
            if not math.isfinite(estimated):
                return self.input
            self.observer.begin(estimated)
            self._is_begun = True
        else:
            self.observer.correct(estimated)
        self.input = self._within(self.change(wanted))
        self.observer.predict(self.input)
        return self.input

    @abstractmethod
    def change(self, wanted: float) -> float:
        """The Δu for a wanted heading (rad); it may exceed the limits."""

    def _within(self, change: float) -> float:
        """The input after a change, within the limits."""
        size, most = self._limits.size, self._limits.change
        return min(max(self.input + min(max(change, -most), most), -size), size)
