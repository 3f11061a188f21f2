"""Model predictive control of one output by one input, within limits of the input and of its change; P4 §5.

At every step: min Σ_{i=1..H_p} Q e(k+i)² + Σ_{i=0..H_c−1} R Δu(k+i)², (25) with the limits (26)–(27), over the changes
Δu; a small dense QP that DAQP solves. A Kalman filter on [plant states, input bias] supplies the states and makes it
offset-free: the bias is part of the prediction. (Adding the last output error to the prediction instead leaves the
states of a plant that is not stable to drift away.)
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.checks import positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.linear_algebra import multiply, multiply_transposed


@dataclass(frozen=True)
class LinearPlant:
    """x(k+1) = A x(k) + B (u(k) + d(k)), y = C x: A (n, n), B (n,), C (n,); y an angle if `circular`."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    circular: bool = True

    def __post_init__(self):
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

    def __post_init__(self):
        for name in ("size", "change"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"limits.{name} is {getattr(self, name)}, expected more than 0")


class BiasObserver:
    """A Kalman filter on [x, d], d the unknown part of the input: the states that an MPC or LQG starts from.

    state_noise (n,) and bias_noise are variances a step, reading_variance that of one output, bias_start the variance
    of the bias at first; units are the plant's own.
    """

    def __init__(
        self, plant: LinearPlant, state_noise: ArrayLike, bias_noise: float, reading_variance: float, bias_start: float
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
        self.reset()

    def reset(self, states: ArrayLike = 0.0) -> None:
        """Begin anew at `states` (n,) with no bias."""
        self.state = np.zeros(len(self._input))
        self.state[:-1] = states
        self._covariance = np.diag(self._start)
        self._work = np.empty((3, len(self.state), len(self.state)))

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


class HeadingMpc:
    """Steps from a wanted and an estimated heading to the input; any linear plant, any horizon.

    Args:
        plant: the model predicted with.
        limits: what the input may do.
        observer: supplies the states.
        horizon, control_horizon: H_p and H_c, steps.
        output_weight, change_weight: Q and R, per unit of the plant's output and input.

    `input` is what was last asked for. Raises InputError for horizons or weights that cannot be used, and
    RuntimeError when the solver fails.
    """

    def __init__(
        self,
        plant: LinearPlant,
        limits: InputLimits,
        observer: BiasObserver,
        horizon: int = 10,
        control_horizon: int = 2,
        output_weight: float = 1.0,
        change_weight: float = 0.1,
    ):
        if not 1 <= control_horizon <= horizon:
            raise InputError(f"mpc.control_horizon is {control_horizon}, expected 1 to the horizon of {horizon} steps")
        positive("mpc.output_weight", output_weight)
        positive("mpc.change_weight", change_weight)
        self._solve = _solver()
        self._plant, self._limits, self.observer = plant, limits, observer
        free, held, forced = prediction(plant, horizon, control_horizon)
        self.hessian = 2.0 * (output_weight * forced.T @ forced + change_weight * np.eye(control_horizon))
        # The gradient is linear in states and bias, the last input and the wanted output.
        outputs = np.column_stack([free, held, -np.ones(horizon)])
        self._slopes = 2.0 * output_weight * forced.T @ outputs
        self._sums = np.tril(np.ones((control_horizon, control_horizon)))
        self._sense = np.zeros(2 * control_horizon, dtype=np.int32)
        self._gradient = np.empty(control_horizon)
        self._upper, self._lower = np.empty((2, 2 * control_horizon))
        self.reset()

    def reset(self, states: ArrayLike = 0.0, applied: float = 0.0) -> None:
        """Forget everything; begin at `states` (n,) with an input already applied."""
        self.observer.reset(states)
        self.input = applied

    def step(self, wanted: float, estimated: float) -> float:
        """The input for the next step. Headings in the plant's unit; an unknown (NaN) estimate is predicted over."""
        self.observer.correct(estimated)
        self.input += self.change(wanted)
        self.observer.predict(self.input)
        return self.input

    def change(self, wanted: float) -> float:
        """The best Δu at the observer's states."""
        gradient, upper, lower = self.problem(wanted)
        best, _, verdict, _ = self._solve(
            self.hessian, gradient, self._sums, upper, lower, self._sense, primal_tol=1e-12, eps_prox=0.0
        )
        if verdict < 1:
            raise RuntimeError(f"DAQP gave up with code {verdict}")
        # The solver keeps a limit to its tolerance; here it is kept to rounding.
        size, change = self._limits.size, self._limits.change
        within = min(max(float(best[0]), -change), change)
        return min(max(self.input + within, -size), size) - self.input

    def problem(self, wanted: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(gradient, upper, lower) of the QP ½ Δᵀ H Δ + gᵀ Δ, lower ≤ [Δ; ΣΔ] ≤ upper; H is `hessian`."""
        _problem(
            self.observer.state,
            self.input,
            wanted,
            self._plant.c,
            math.tau if self._plant.circular else math.inf,
            self._limits.size,
            self._limits.change,
            self._slopes,
            self._gradient,
            self._upper,
            self._lower,
        )
        return self._gradient, self._upper, self._lower


def prediction(plant: LinearPlant, horizon: int, control_horizon: int):
    """Outputs ahead as free · [x; d] + held · u + forced · Δu: (H_p, n + 1), (H_p,), (H_p, H_c)."""
    n = len(plant.b)
    power, free, steps = np.eye(n), np.empty((horizon, n + 1)), np.empty(horizon)
    for i in range(horizon):
        steps[i] = plant.c @ power @ plant.b
        power = plant.a @ power
        free[i, :n] = plant.c @ power
    held = np.cumsum(steps)
    free[:, n] = held
    forced = np.zeros((horizon, control_horizon))
    for j in range(control_horizon):
        forced[j:, j] = held[: horizon - j]
    return free, held, forced


def _solver():
    try:
        from daqp import solve
    except ImportError:
        raise InputError("heading MPC needs the package daqp, expected `pip install steerway[mpc]`") from None
    return solve


@kernel
def _problem(state, last, wanted, output, turn, size, change, slopes, gradient, upper, lower):
    n, m = len(output), len(gradient)
    if turn < math.inf:
        now = 0.0
        for i in range(n):
            now += output[i] * state[i]
        wanted -= turn * round((wanted - now) / turn)
    for j in range(m):
        gradient[j] = slopes[j, n + 1] * last + slopes[j, n + 2] * wanted
        for i in range(n + 1):
            gradient[j] += slopes[j, i] * state[i]
        upper[j], lower[j] = change, -change
        upper[m + j], lower[m + j] = size - last, -size - last


@kernel
def _correct(x, p, output, reading, variance, turn):
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
def _predict(x, p, transition, inputs, applied, noise, work):
    n = len(x)
    multiply(transition, p, work[0])
    multiply_transposed(work[0], transition, p)
    for i in range(n):
        work[1, 0, i] = inputs[i] * applied
        for j in range(n):
            work[1, 0, i] += transition[i, j] * x[j]
        p[i, i] += noise[i]
    x[:] = work[1, 0]
