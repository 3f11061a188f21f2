"""The surge model u̇ = −d u − b u|u| + g K_t(J) n|n|, P3 (13), from a log of speed and shaft speed.

Output error: the model is simulated with the log's shaft speeds from an unknown first speed, and d, b, g and that speed
minimise the squared error. Parameters that the log does not determine are reported as such: a log at one speed gives
only the ratios of drag and thrust.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.checks import array_of, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.statistics import rms
from steerway.vessels.actuators import Actuator, follow
from steerway.vessels.propeller import Propeller
from steerway.vessels.surge import surge_step

LONGEST_STEP = 0.1
"""s of one step of integration."""
LARGEST_SHARES = 0.1, 0.05
"""Two standard deviations at most: of the drag terms, in parts of the drag in the middle of the speeds; of thrust."""
LEAST_SPREAD = 0.3
"""Part of the highest speed over which the speeds of a log must spread."""
_LEAST_ROWS = 50


@dataclass(frozen=True)
class SurgeModel:
    """All forces over the mass: d in 1/s, b in 1/m, g in m/rev² for a K_t of 1, whose curve the propeller gives.

    As given the propeller is P3's.
    """

    linear_drag: float
    quadratic_drag: float
    thrust: float
    propeller: Propeller = field(default_factory=Propeller)

    def curve(self) -> np.ndarray:
        """The propeller's curve with this thrust: what `vessels.surge.surge_rate` reads."""
        return self.propeller.curve(self.thrust)

    def start(self, speed: float = 0.0) -> "PropellerLog":
        """The model as an instrument: speed through the water from shaft speed, beginning at `speed`."""
        return PropellerLog(self, speed)

    def time_to(self, speed: float, shaft: Actuator, longest: float = 600.0) -> float:
        """s from rest at full throttle to 98 % of `speed` (m/s); inf where that takes more than `longest`."""
        machine = (shaft.low, shaft.high, shaft.rate, shaft.lag)
        return _time_to(0.98 * speed, longest, self.linear_drag, self.quadratic_drag, self.curve(), *machine)

    def feasible(self, speed: float, shaft: Actuator, within: float = 40.0) -> tuple[bool, str]:
        """Whether any controller can settle on `speed` (m/s) from rest `within` s with this shaft, and a sentence."""
        least = self.time_to(positive("speed", speed), shaft)
        if least < within:
            return True, f"{speed:g} m/s within {within:g} s is feasible: full throttle takes {least:.1f} s."
        took = f"takes {least:.1f} s" if math.isfinite(least) else "does not get there"
        return False, f"{speed:g} m/s within {within:g} s is infeasible: full throttle {took}."


class PropellerLog:
    """Speed through the water by dead reckoning of a `SurgeModel`. `step` takes the shaft speed (rev/s) now."""

    def __init__(self, model: SurgeModel, speed: float = 0.0) -> None:
        self.speed = speed
        self._model = (model.linear_drag, model.quadratic_drag, model.curve())
        self._shaft = math.nan

    def step(self, shaft: float, dt: float) -> float:
        before = shaft if math.isnan(self._shaft) else self._shaft
        self._shaft = shaft
        self.speed = surge_step(self.speed, before, shaft, 0.0, 0.0, *self._model, dt)
        return self.speed


@dataclass(frozen=True)
class SurgeIdentification:
    """Result of an identification. `std` (3,): 1σ of d, b and g; `residual` RMS in m/s; `verdict` a sentence."""

    model: SurgeModel
    std: np.ndarray
    residual: float
    identified: bool
    verdict: str


def identify_surge(
    time: ArrayLike, speed: ArrayLike, shaft: ArrayLike, propeller: Propeller | None = None
) -> SurgeIdentification:
    """Drag and thrust of a boat.

    Args:
        time: (n,) s, rising.
        speed: (n,) m/s through the water, or over ground where there is no current.
        shaft: (n,) rev/s as measured, not as commanded.
        propeller: whose curve is known; P3's if None. Its thrust need not be.

    Rows with an unknown number are left out. Raises InputError for unequal lengths, time that does not rise, fewer than
    50 rows and a shaft that never turns.
    """
    from scipy.optimize import least_squares

    time, speed, shaft = _checked(time, speed, shaft)
    propeller = propeller or Propeller()

    def simulated(parameters: Floats) -> Floats:
        curve = propeller.curve(parameters[2])
        return _sail(time - time[0], shaft, parameters[3], parameters[0], parameters[1], curve)

    guess = np.array([0.05, 0.01, 0.05, speed[0]])
    fit = least_squares(
        lambda parameters: simulated(parameters) - speed,
        guess,
        bounds=([0.0, 0.0, 1e-6, -np.inf], np.inf),
        x_scale=[0.05, 0.01, 0.05, 1.0],
    )
    linear_drag, quadratic_drag, thrust = fit.x[:3].tolist()
    model = SurgeModel(linear_drag, quadratic_drag, thrust, propeller)
    std = _deviations(fit.jac, fit.fun)
    identified, verdict = _verdict(model, std, speed)
    return SurgeIdentification(model, std, rms(fit.fun), identified, verdict)


def _checked(time: ArrayLike, speed: ArrayLike, shaft: ArrayLike) -> tuple[Floats, Floats, Floats]:
    names = ("time", "speed", "shaft")
    columns = [array_of(name, each, (None,)) for name, each in zip(names, (time, speed, shaft), strict=True)]
    if len({column.shape for column in columns}) != 1:
        shapes = ", ".join(str(column.shape) for column in columns)
        raise InputError(f"time, speed and shaft have the shapes {shapes}, expected one length")
    known = np.isfinite(columns).all(axis=0)
    time, speed, shaft = (column[known] for column in columns)
    if len(time) < _LEAST_ROWS:
        raise InputError(
            f"the log has {len(time)} rows with time, speed and shaft speed, expected {_LEAST_ROWS} or more"
        )
    if np.diff(time).min() <= 0.0:
        row = int(np.argmin(np.diff(time))) + 1
        raise InputError(f"time goes from {time[row - 1]:g} to {time[row]:g} s, expected rising seconds")
    if not shaft.any():
        raise InputError("the shaft never turns in this log, expected a speed staircase")
    return time, speed, shaft


def _deviations(jacobian: Floats, residual: Floats) -> Floats:
    """1σ of d, b, g; correlated residuals count for less than their number."""
    n = len(residual)
    spectrum = np.abs(np.fft.rfft(residual, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[: n // 4]
    correlation = correlation / max(correlation[0], 1e-300)
    faded = np.flatnonzero(correlation < 0.05)
    inflation = 1.0 + 2.0 * correlation[1 : faded[0] if len(faded) else None].sum()
    variance = residual @ residual / (n - jacobian.shape[1]) * max(inflation, 1.0)
    scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    # A direction that the log does not determine gets an enormous deviation in place of a failed inverse.
    _, singular, rows = np.linalg.svd(jacobian / scale, full_matrices=False)
    weights = rows / np.maximum(singular, 1e-9)[:, None]
    return np.sqrt(variance * (weights**2).sum(axis=0))[:3] / scale[:3]


def _verdict(model: SurgeModel, std: Floats, speed: Floats) -> tuple[bool, str]:
    low, high = np.percentile(speed, (2.0, 98.0))
    if high - low < LEAST_SPREAD * high:
        return False, (
            f"Not identified: the speed stays within {low:.2f} and {high:.2f} m/s, which shows the ratio of drag to "
            "thrust only; sail a staircase of three speeds or more, the highest at least half as fast again as the "
            "lowest."
        )
    middle = 0.5 * (low + high)
    drag = (model.linear_drag + model.quadratic_drag * middle) * middle
    shares = 2.0 * std * (middle / drag, middle**2 / drag, 1.0 / model.thrust)
    names = ("the linear drag", "the quadratic drag", "thrust")
    for share, name, most in zip(shares, names, (LARGEST_SHARES[0], LARGEST_SHARES[0], LARGEST_SHARES[1]), strict=True):
        if not share <= most:
            return False, (
                f"Not identified: {name} is uncertain by {100.0 * share:.0f} % (2σ, at {middle:.1f} m/s), expected "
                f"{100.0 * most:.0f} % or less; sail more steps, or longer ones."
            )
    return True, (
        f"Identified between {low:.1f} and {high:.1f} m/s: drag terms within {100.0 * max(shares[:2]):.1f} % of the "
        f"drag, thrust within {100.0 * shares[2]:.1f} % (2σ)."
    )


@kernel
def _sail(
    time: Floats, shaft: Floats, speed: float, linear_drag: float, quadratic_drag: float, curve: Floats
) -> Floats:
    """(n,) speeds of the model under the log's shaft speeds."""
    out = np.empty(len(time))
    out[0] = speed
    for k in range(1, len(time)):
        dt = time[k] - time[k - 1]
        parts = max(1, math.ceil(dt / LONGEST_STEP))
        slope = (shaft[k] - shaft[k - 1]) / parts
        for i in range(parts):
            before = shaft[k - 1] + i * slope
            speed = surge_step(speed, before, before + slope, 0.0, 0.0, linear_drag, quadratic_drag, curve, dt / parts)
        out[k] = speed
    return out


@kernel
def _time_to(
    wanted: float,
    longest: float,
    linear_drag: float,
    quadratic_drag: float,
    curve: Floats,
    low: float,
    high: float,
    rate: float,
    lag: float,
) -> float:
    speed, shaft, step = 0.0, 0.0, 0.05
    for k in range(int(longest / step)):
        if speed >= wanted:
            return k * step
        after = follow(shaft, high, low, high, rate, lag, step)
        speed = surge_step(speed, shaft, after, 0.0, 0.0, linear_drag, quadratic_drag, curve, step)
        shaft = after
    return math.inf
