"""Model predictive and LQG control of one output by one input, within limits of the input and of its change; P4 §5.

Each step solves min Σ_{i=1..H_p} Q e(k+i)² + Σ_{i=0..H_c−1} R Δu(k+i)², (25) with the limits (26)–(27), over the
changes Δu: a small dense QP, solved by DAQP. A Kalman filter on [plant states, input bias] supplies the states. The
prediction includes the bias, so that control is offset-free. (If the last output error were added to the prediction
instead, the states of a plant that is not stable would drift.) LQG, with which the paper compares, has the same plant,
observer and weights, but an infinite horizon; its input is clipped to the limits afterwards.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from steerway.control.heading_plant import (
    BiasObserver,
    Identified,
    InputLimits,
    LinearPlant,
    SampledHeading,
    parts_for,
)
from steerway.core.arrays import Floats
from steerway.core.checks import positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.extras import missing

FULL_CHANGE = 40.0
"""Cost of an input change at its limit over the cost of an error of 1°. From P4: R = 0.1 per rpm², limit 20 rpm."""
LONGEST_HORIZON = 100
"""Longest default horizon, steps: ten times P4's."""
_CHANGES = 15.0
"""Default ratio of the input limit to the limit of its change: P4's 300 rpm to 20 rpm."""


def default_weights(
    limits: InputLimits, output_weight: float | None, change_weight: float | None
) -> tuple[float, float]:
    """Q per rad² and R per squared unit of the input: the given weights, else P4's, scaled by the limits."""
    change = limits.change if limits.change < math.inf else limits.size / _CHANGES
    if output_weight is None:
        output_weight = math.degrees(1.0) ** 2
    if change_weight is None:
        if change == math.inf:
            raise InputError("mpc.change_weight is missing for an input without limits, expected a number above 0")
        change_weight = FULL_CHANGE / change**2
    return positive("mpc.output_weight", output_weight), positive("mpc.change_weight", change_weight)


_ROUNDING = 1e-12
"""Lower limit of a QP's smallest eigenvalue over its largest, 5000 rounding errors. Below it the QP may be concave."""
_TOLERANCE, _ROUNDED = 1e-12, 1e-9
"""Two tolerances of the limits. The first is in the input's unit. If the solver fails with it, the second applies, a
fraction of the unlimited change: rounding errors of this change grow with the condition number of the QP."""


class HeadingMpc(SampledHeading):
    """Predictive control from desired and estimated heading (rad) to the input, for any linear plant and horizon.

    Args:
        plant: the model of the prediction.
        limits: limits of the input and of its change.
        observer: supplies the states.
        horizon, control_horizon: H_p and H_c, steps.
        output_weight, change_weight: Q per rad² (or per squared output unit of a plant that is not circular) and R per
            squared unit of the input; by default 1 per degree² and 40 per squared limit of the change, P4's numbers.

    Raises InputError for unusable horizons or weights, and ArithmeticError if the solver fails, for states or a desired
    heading too large for floating point.
    """

    def __init__(
        self,
        plant: LinearPlant,
        limits: InputLimits,
        observer: BiasObserver,
        horizon: int = 10,
        control_horizon: int = 2,
        output_weight: float | None = None,
        change_weight: float | None = None,
    ):
        if not 1 <= control_horizon <= horizon:
            raise InputError(f"mpc.control_horizon is {control_horizon}, expected 1 to the horizon of {horizon} steps")
        output_weight, change_weight = default_weights(limits, output_weight, change_weight)
        self._solve = _solver()
        free, held, forced = prediction(plant, horizon, control_horizon)
        self.hessian = 2.0 * (output_weight * forced.T @ forced + change_weight * np.eye(control_horizon))
        curvature = np.linalg.eigvalsh(self.hessian) if np.isfinite(self.hessian).all() else np.array([math.nan])
        if not curvature[0] > _ROUNDING * curvature[-1]:
            weights = f"mpc.output_weight is {output_weight:g} and mpc.change_weight {change_weight:g}"
            raise InputError(f"{weights}, expected a ratio nearer to 1: rounding loses one of them")
        # The gradient is linear in [states; bias], the last input and the desired output.
        outputs = np.column_stack([free, held, -np.ones(horizon)])
        self._slopes = 2.0 * output_weight * forced.T @ outputs
        self._sums = np.tril(np.ones((control_horizon, control_horizon)))
        self._sense = np.zeros(2 * control_horizon, dtype=np.int32)
        self._gradient = np.empty(control_horizon)
        self._upper, self._lower = np.empty((2, 2 * control_horizon))
        super().__init__(plant, limits, observer)

    @classmethod
    def for_(
        cls,
        identified: Identified,
        limit: float,
        rate: float = math.inf,
        angle_std: float = 0.0,
        **design: float,
    ) -> "HeadingMpc":
        """A controller for an identified heading; its step is the sample of the identified response.

        `limit`: largest input; `rate`: its largest change per second, in its unit; `angle_std`: 1σ of an estimated
        heading, rad; `design`: horizons and weights. The default horizon is three times the second time constant,
        limited to 10 (P4's) to 100 steps; the default control horizon is 5. Raises InputError for numbers that cannot
        be used.
        """
        plant, limits, observer = parts_for(identified, limit, rate, angle_std)
        steps = 10
        if 0.0 < identified.poles[1] < 1.0:
            steps = min(max(steps, round(-3.0 / math.log(identified.poles[1]))), LONGEST_HORIZON)
        horizon = int(design.pop("horizon", steps))
        control_horizon = int(design.pop("control_horizon", min(5, horizon)))
        return cls(plant, limits, observer, horizon, control_horizon, **design)

    def change(self, wanted: float) -> float:
        """The optimal Δu at the observer's states, within the limits to the solver's tolerance."""
        gradient, upper, lower = self.problem(wanted)
        best, verdict = self._solved(gradient, upper, lower, _TOLERANCE)
        if verdict < 1:  # rounding of a large unlimited change exceeds the tolerance
            unlimited = np.abs(np.linalg.solve(self.hessian, gradient)).max()
            best, verdict = self._solved(gradient, upper, lower, _ROUNDED * unlimited)
        if verdict < 1:
            raise ArithmeticError(f"DAQP gave up with code {verdict}")
        return float(best[0])

    def _solved(self, gradient: Floats, upper: Floats, lower: Floats, tolerance: float) -> tuple[Floats, int]:
        """(changes Δu, exit code of DAQP)."""
        best, _, verdict, _ = self._solve(
            self.hessian, gradient, self._sums, upper, lower, self._sense, primal_tol=tolerance, eps_prox=0.0
        )
        return best, verdict

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


class HeadingLqg(SampledHeading):
    """LQG control, Δu = −L ([x; u] − [x; u]₀): the index 0 is rest on the desired heading with the bias compensated.

    Arguments as in HeadingMpc. The gain L minimises Σ Q e² + R Δu² over an infinite horizon.
    """

    def __init__(
        self,
        plant: LinearPlant,
        limits: InputLimits,
        observer: BiasObserver,
        output_weight: float | None = None,
        change_weight: float | None = None,
    ):
        from scipy.linalg import solve_discrete_are

        output_weight, change_weight = default_weights(limits, output_weight, change_weight)
        n = len(plant.b)
        a, b = np.eye(n + 1), np.append(plant.b, 1.0)[:, None]
        a[:n, :n], a[:n, n] = plant.a, plant.b
        c = np.append(plant.c, 0.0)[None]
        cost = solve_discrete_are(a, b, output_weight * c.T @ c, np.array([[change_weight]]))
        self.gain = (b.T @ cost @ a / (change_weight + b.T @ cost @ b))[0]
        at_rest = np.zeros((n + 1, n + 1))
        at_rest[:n, :n], at_rest[:n, n], at_rest[n, :n] = plant.a - np.eye(n), plant.b, plant.c
        self._rest = np.linalg.solve(at_rest, np.eye(n + 1)[n])
        super().__init__(plant, limits, observer)

    @classmethod
    def for_(
        cls,
        identified: Identified,
        limit: float,
        rate: float = math.inf,
        angle_std: float = 0.0,
        output_weight: float | None = None,
        change_weight: float | None = None,
    ) -> "HeadingLqg":
        """A controller for an identified heading; see `HeadingMpc.for_`."""
        return cls(*parts_for(identified, limit, rate, angle_std), output_weight, change_weight)

    def change(self, wanted: float) -> float:
        """See `SampledHeading`. The input at rest is the model's minus the estimated bias."""
        state = self.observer.state[:-1]
        if self._plant.circular:
            now = float(self._plant.c @ state)
            wanted = now + math.remainder(wanted - now, 2.0 * math.pi)
        away = np.append(state, self.input + self.observer.bias) - self._rest * wanted
        return -float(self.gain @ away)


def prediction(plant: LinearPlant, horizon: int, control_horizon: int) -> tuple[Floats, Floats, Floats]:
    """Predicted outputs as free · [x; d] + held · u + forced · Δu: (H_p, n + 1), (H_p,), (H_p, H_c)."""
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


def _solver() -> Callable[..., Any]:
    try:
        from daqp import solve
    except ImportError:
        raise missing("heading MPC", "daqp", "mpc") from None
    return solve


@kernel
def _problem(
    state: Floats,
    last: float,
    wanted: float,
    output: Floats,
    turn: float,
    size: float,
    change: float,
    slopes: Floats,
    gradient: Floats,
    upper: Floats,
    lower: Floats,
) -> None:
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
