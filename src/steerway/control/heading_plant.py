"""The model that the heading's predictive and LQG controllers steer by, and the observer of its states.

A plant is linear and discrete, x(k+1) = A x + B (u + d), y = C x, with y the heading in rad and d the unknown part of
the input. `HeadingResponse` makes one of an identified heading, or of Nomoto's K and T, with limits and an observer.
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
    """|u| ≤ size, |Δu| ≤ change; infinity for none."""

    size: float = math.inf
    change: float = math.inf

    def __post_init__(self) -> None:
        for name in ("size", "change"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"limits.{name} is {getattr(self, name)}, expected more than 0")


class BiasObserver:
    """A Kalman filter on [x, d], d the unknown part of the input: the states that an MPC or LQG starts from.

    state_noise (n,) and bias_noise are variances a step, reading_variance that of one output, bias_start the variance
    of the `bias` at first; units are the plant's own.
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
        # The slowest mode of the plant, scaled to an output of 1: for a heading the one that integrates.
        poles, modes = np.linalg.eig(plant.a)
        slowest = np.real(modes[:, int(np.argmax(np.abs(poles)))])
        self._at_rest = slowest / (plant.c @ slowest)
        self._first_bias = bias
        self.reset()

    def reset(self, states: ArrayLike = 0.0) -> None:
        """Begin anew at `states` (n,) with the bias of the beginning."""
        self.state = np.zeros(len(self._input))
        self.state[:-1], self.state[-1] = states, self._first_bias
        self._covariance = np.diag(self._start)
        self._work = np.empty((3, len(self.state), len(self.state)))

    def begin(self, output: float) -> None:
        """Set the states to those of a plant at rest with this output, as uncertain as one reading."""
        self.state[:-1] += self._at_rest * (output - self.output)
        self._covariance[:-1, :-1] += self._variance * np.outer(self._at_rest, self._at_rest)

    @property
    def bias(self) -> float:
        """The unknown part of the input."""
        return float(self.state[-1])

    @property
    def output(self) -> float:
        """The output that belongs to the states, c x."""
        return float(self._output @ self.state)

    def correct(self, output: float) -> None:
        """Take one output; NaN for unknown."""
        _correct(self.state, self._covariance, self._output, output, self._variance, self._turn)

    def predict(self, applied: float) -> None:
        """Go one step on with the input that was applied."""
        _predict(self.state, self._covariance, self._transition, self._input, applied, self._noise, self._work)


class Identified(Protocol):
    """`identification.IdentifiedHeading`, `HeadingResponse`."""

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
    """ψ = y1 + y2, y_i(k+1) = p_i y_i(k) + g_i (u(k) + bias): gains in rad a unit of input and sample, sample in s.

    residual_rms: what the model leaves of a heading, rad.
    """

    poles: tuple[float, float]
    gains: tuple[float, float]
    sample: float
    bias: float = 0.0
    residual_rms: float = 0.0

    @classmethod
    def of_nomoto(cls, gain: float, time: float, sample: float | None = None) -> "HeadingResponse":
        """T ω̇ + ω = K u, sampled exactly; by default ten times in T, at least every 2 s."""
        positive("nomoto.time_constant", time)
        h = min(0.1 * time, 2.0) if sample is None else positive("heading.sample", sample)
        kept = math.exp(-h / time)
        return cls((1.0, kept), (gain * h, -gain * time * (1.0 - kept)), h)


WALK = 0.1
"""Part of the input's limit by which its bias may walk in the second time constant: large
enough to estimate the model error during a turn. Chosen."""
SURE_DEG = 0.2
"""Least noise of a heading estimate that the observer assumes, rad/√s. Chosen: twice the last digit of HDT."""


def parts_for(
    identified: Identified, limit: float, rate: float = math.inf, angle_std: float = 0.0
) -> tuple[LinearPlant, InputLimits, BiasObserver]:
    """Plant, limits and observer of an identified heading.

    `limit` of |u| and `rate` of its change a second, in the input's unit; `angle_std` of one estimated heading, rad.
    The input's bias is taken to be within 7 % of the limit at first, as P4's.
    Raises InputError for what cannot be used.
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
    """What predictive and LQG control have in common: a step a sample, from the observer's states to the input.

    `input` is what was last asked for. A controller adds `change`, the Δu at the observer's states.
    """

    def __init__(self, plant: LinearPlant, limits: InputLimits, observer: BiasObserver) -> None:
        if len(observer.state) != len(plant.b) + 1:
            raise InputError(
                f"observer has {len(observer.state)} states, expected the {len(plant.b)} of the plant and the bias"
            )
        self._plant, self._limits, self.observer = plant, limits, observer
        self.reset()

    def reset(self, states: ArrayLike | None = None, applied: float = 0.0) -> None:
        """Forget everything; begin at `states` (n,), or at rest on the first heading known, with an input already
        applied. Raises InputError for one that is not finite."""
        if not math.isfinite(applied):
            raise InputError(f"applied is {applied:g}, expected a finite number")
        self.observer.reset(0.0 if states is None else states)
        self.input = applied
        self._is_begun = states is not None

    def step(self, wanted: float, estimated: float) -> float:
        """The input for the next step. Headings in rad; an unknown (NaN) estimate is predicted over, before the
        first known one the input is held."""
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
