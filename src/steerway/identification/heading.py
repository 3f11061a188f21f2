"""Identify the response of heading to steering from a manoeuvre: a pseudo-random binary sequence is best.

The model is that of P4 (2)–(4): two poles from the input to the heading. The input's bias and the first heading are
unknown too. Linear least squares at a few time constants give starting points. From these, the error of the whole run
is minimised (output error; Ljung, System Identification (1999), sections 4.2 and 7.3). With `integrating` one pole is
1: the heading of a boat that does not turn is constant.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from steerway.core.arrays import Floats
from steerway.core.checks import array_of
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.estimation.heading.models import HeadingModel

LEAST_SAMPLES = 50


@dataclass(frozen=True)
class IdentifiedHeading:
    """ψ(k) = y1 + y2 + ψ0, y_i(k+1) = p_i y_i(k) + g_i (u(k) + bias).

    poles, gains (rad per unit of input and sample, of each pole), bias in the input's unit, heading0 in rad, sample in
    s, residual_rms in rad, fit in % (100 is perfect, 0 is the mean heading).
    """

    poles: tuple[float, float]
    gains: tuple[float, float]
    bias: float
    heading0: float
    sample: float
    residual_rms: float
    fit: float

    @property
    def turn_rate(self) -> float:
        """Steady turn rate of one unit of input, rad/s; NaN when no pole is 1."""
        return self.gains[0] / self.sample if self.poles[0] == 1.0 else math.nan

    @property
    def time_constant(self) -> float:
        """Time constant of the second pole, s."""
        return -self.sample / math.log(self.poles[1])

    def run(self, inputs: ArrayLike) -> np.ndarray:
        """(n,) headings (rad) of the model for (n,) inputs, from the run's first heading."""
        inputs = array_of("inputs", inputs, (None,))
        return _run(np.array([*self.poles, *self.gains, self.bias, self.heading0]), inputs)

    def yaw(self) -> HeadingModel:
        """The model for the filters of `estimation.heading`, if the input is in rpm and samples are 1 s apart."""
        return HeadingModel(self.poles, self.gains, (1.0, 1.0))


def identify_heading(
    time: ArrayLike, steering: ArrayLike, heading: ArrayLike, integrating: bool = True
) -> IdentifiedHeading:
    """Identify the model that fits a manoeuvre best.

    Args:
        time: (n,) s, evenly spaced.
        steering: (n,) commanded or measured actuator (rpm, rudder angle, …), held from its row to the next.
        heading: (n,) rad, wrapped or not; NaN where unknown.
        integrating: keep the slow pole at 1; False: identify it too.

    Raises InputError for fewer than 50 rows, uneven times, unequal lengths or steering that never changes.
    """
    time = array_of("identify heading: time", time, (None,))
    steering = array_of("identify heading: steering", steering, time.shape)
    heading = array_of("identify heading: heading", heading, time.shape)
    sample = _checked(time, steering, heading)
    known = np.isfinite(heading)
    unwrapped = heading.copy()
    unwrapped[known] = np.unwrap(heading[known])
    unit = float(np.std(steering))
    inputs = steering / unit

    fits = []
    for time_constant in (2.0, 10.0, 50.0, 200.0):
        guess = _linear_start(inputs, unwrapped, known, math.exp(-sample / time_constant))
        fits.append(least_squares(_misfit, guess, args=(inputs, unwrapped, known, integrating), x_scale="jac"))
    best = min(fits, key=lambda fit: fit.cost)
    slow, fast = (1.0 if integrating else float(best.x[0])), _pole(best.x[1])
    rms = math.sqrt(2.0 * best.cost / known.sum())
    spread = float(np.std(unwrapped[known]))
    gains = (best.x[2] / unit, best.x[3] / unit)
    percent = 100.0 * (1.0 - rms / spread) if spread > 0.0 else math.nan
    return IdentifiedHeading((slow, fast), gains, best.x[4] * unit, best.x[5], sample, rms, percent)


def _checked(time: Floats, steering: Floats, heading: Floats) -> float:
    if np.isfinite(heading).sum() < LEAST_SAMPLES:
        raise InputError(
            f"identify heading: {np.isfinite(heading).sum()} known headings, expected at least {LEAST_SAMPLES}"
        )
    steps = np.diff(time)
    sample = float(np.median(steps))
    if not sample > 0.0 or np.abs(steps - sample).max() > 0.01 * sample:
        raise InputError(f"identify heading: time steps from {steps.min():g} to {steps.max():g} s, expected even ones")
    if not np.isfinite(steering).all() or np.ptp(steering) == 0.0:
        raise InputError("identify heading: steering has unknown values or never changes, expected a manoeuvre")
    return sample


def _pole(x: float) -> float:
    """Map a real number to a pole in (0, 1)."""
    return 1.0 / (1.0 + math.exp(-x))


def _linear_start(inputs: Floats, heading: Floats, known: NDArray[np.bool_], pole: float) -> Floats:
    """A starting point by linear least squares: for given poles (1 and `pole`) the model is linear in the rest."""
    u, n = inputs, len(inputs)
    columns = [
        _run(np.array([1.0, pole, *gains, 0.0, 0.0]), each) for gains in ((1, 0), (0, 1)) for each in (u, np.ones(n))
    ]
    system = np.stack([*columns, np.ones(n)], axis=1)
    slow, slow_bias, fast, _, first = np.linalg.lstsq(system[known], heading[known], rcond=None)[0]
    bias = slow_bias / slow if abs(slow) > 1e-12 else 0.0
    return np.array([1.0, math.log(pole / (1.0 - pole)), slow, fast, bias, first])


def _misfit(x: Floats, inputs: Floats, heading: Floats, known: NDArray[np.bool_], integrating: bool) -> Floats:
    slow = 1.0 if integrating else x[0]
    return (_run(np.array([slow, _pole(x[1]), *x[2:]]), inputs) - heading)[known]


@kernel
def _run(parameters: Floats, inputs: Floats) -> Floats:
    first = second = 0.0
    out = np.empty(len(inputs))
    for k in range(len(inputs)):
        out[k] = parameters[5] + first + second
        u = inputs[k] + parameters[4]
        first = parameters[0] * first + parameters[2] * u
        second = parameters[1] * second + parameters[3] * u
    return out
