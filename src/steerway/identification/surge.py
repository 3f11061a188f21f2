"""The surge model u̇ = −d u − b u|u| + g K_t(J) n|n|, P3 (13), from a log of speed and shaft speed.

Output error: the model is simulated with the log's shaft speeds from an unknown first speed. d, b, g and the first
speed minimise the squared error. The propeller's diameter and curve give the fall of thrust with the advance ratio J =
u/(n D). If they are unknown, K_t falls linearly from 1 at rest to 0 at u = p n, and the pitch p is identified too. Then
n may be a command in any unit, if thrust is quadratic in it. A lag of the shaft behind the logged values is identified
if the log determines it.

Parameters that the log does not determine are reported as such. A log at one speed gives only the ratio of drag to
thrust, and a log without quick changes does not separate drag from the fall of thrust with speed.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from steerway.control.speed_guess import follow
from steerway.core.arrays import Floats
from steerway.core.checks import array_of, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.statistics import rms
from steerway.vessels.propeller import Propeller, thrust_coefficient
from steerway.vessels.surge import surge_rate, surge_step
from steerway.vessels.vessel import Actuator

LONGEST_STEP = 0.1
"""Longest step of integration, s."""
LARGEST_SHARES = 0.1, 0.05
"""Largest 2σ: of an identified drag term, as a share of the drag at the middle speed; of the thrust, relative."""
LEAST_SPREAD = 0.3
"""Least range of speeds in a log, as a share of the highest speed."""
_LEAST_ROWS = 50
_SURE = 3.0
"""A lag is accepted if it is larger than this many of its standard deviations."""
_FIRST_LAG = 0.2
"""First guess of the lag, s."""
_NO_SLIP = 1e9
"""Pitch, m, that stands for a thrust independent of speed."""
_ASSUMED = (
    "Without the propeller's diameter, thrust is assumed to fall linearly with speed. The drag terms contain any "
    "difference from this, and are valid only for the speeds in this log."
)


@dataclass(frozen=True)
class SurgeModel:
    """The surge model, all forces divided by the mass: d in 1/s, b in 1/m, g in m/rev² at K_t = 1.

    The propeller gives the curve K_t(J); by default it is P3's.
    """

    linear_drag: float
    quadratic_drag: float
    thrust: float
    propeller: Propeller = field(default_factory=Propeller)

    def curve(self) -> np.ndarray:
        """The propeller's curve with this thrust, as an argument of `vessels.surge.surge_rate`."""
        return self.propeller.curve(self.thrust)

    def start(self, speed: float = 0.0) -> "PropellerLog":
        """The model as an instrument: speed through the water from shaft speed, beginning at `speed`."""
        return PropellerLog(self, speed)

    def time_to(self, speed: float, shaft: Actuator, longest: float = 600.0) -> float:
        """s from rest at full throttle to 98 % of `speed` (m/s); inf if that takes more than `longest` s."""
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
    """Speed through the water, predicted by a `SurgeModel` from shaft speeds (rev/s) given to `step`."""

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
    """Result of an identification.

    `std` (3,): 1σ of d, b and g; `residual` RMS in m/s; `verdict` a sentence. `pitch`: p in m per revolution (or unit
    of command) with `pitch_std`, inf if thrust does not fall with speed; None if the propeller was given. `lag`: of the
    shaft behind the logged values, s, with `lag_std`; 0 if none is found.
    """

    model: SurgeModel
    std: np.ndarray
    residual: float
    identified: bool
    verdict: str
    pitch: float | None = None
    pitch_std: float | None = None
    lag: float = 0.0
    lag_std: float = 0.0

    @property
    def thrust_at_rest(self) -> float:
        """Thrust over mass at rest for one revolution per second (or one unit of command), m/rev²."""
        return self.model.thrust * thrust_coefficient(0.0, self.model.curve())

    def guess(self, high: float, low: float = 0.0) -> dict[str, float]:
        """Arguments for a speed controller, `AdaptiveSpeedGains(**found.guess(high))`, for a shaft (or command) from
        `low` to `high`: drag, the thrust that balances it at half of `high`, and the shaft's lag. Raises InputError for
        a `high` that is not above 0."""
        model = self.model
        half = 0.5 * positive("surge.high", high)
        speed = _steady(half, model.linear_drag, model.quadratic_drag, model.curve())
        thrust = (model.linear_drag + model.quadratic_drag * speed) * speed / half**2
        return {
            "linear_drag": model.linear_drag,
            "quadratic_drag": model.quadratic_drag,
            "thrust": thrust,
            "low": low,
            "high": high,
            "shaft_lag": self.lag,
        }


def identify_surge(
    time: ArrayLike, speed: ArrayLike, shaft: ArrayLike, propeller: Propeller | None = None
) -> SurgeIdentification:
    """Identify drag and thrust of a boat.

    Args:
        time: (n,) s, rising.
        speed: (n,) m/s through the water, or over ground if there is no current.
        shaft: (n,) measured rev/s, or a command in which thrust is quadratic (PWM from neutral, per cent).
        propeller: one with known diameter and curve; its thrust need not be known. None: the fall of thrust with speed
            is identified too.

    Rows with NaN are left out. Raises InputError for unequal lengths, time that does not rise, fewer than 50 rows and a
    shaft that never turns.
    """
    time, speed, shaft = _checked(time, speed, shaft)
    found, slow = (_fit(time, speed, shaft, propeller, lagged) for lagged in (False, True))
    if slow.lag > _SURE * slow.lag_std and slow.residual < found.residual:
        found = slow
    if propeller is not None:
        return found
    # Parameters that the log does not separate may still be determined in combination.
    more = _ASSUMED if found.identified else _known_together(found, speed, shaft)
    return replace(found, verdict=f"{found.verdict} {more}".strip())


def _fit(time: Floats, speed: Floats, shaft: Floats, propeller: Propeller | None, lagged: bool) -> SurgeIdentification:
    """Fit by least squares. Commands are divided by their largest, so that g is an acceleration."""
    from scipy.optimize import least_squares

    unit = float(np.abs(shaft).max())
    turns = shaft / unit
    fastest = max(float(np.abs(speed).max()), 1e-3)
    shortest = time - time[0]

    def curve_of(parameters: Floats) -> Floats:
        if propeller is None:
            return np.array([parameters[2], parameters[4], 0.0, 1.0, 1.0, 0.0])
        # Keep the advance ratios although the shaft is scaled.
        curve = propeller.curve(parameters[2])
        curve[1] /= unit
        return curve

    def simulated(parameters: Floats) -> Floats:
        turning = following(shortest, turns, parameters[-1]) if lagged else turns
        return _sail(shortest, turning, parameters[3], parameters[0], parameters[1], curve_of(parameters))

    scale = [0.05, 0.05 / fastest, 0.1 * fastest, fastest]
    if propeller is None:
        scale.append(0.5 / fastest)
    low = [0.0, 0.0, 1e-9, -np.inf, 0.0][: len(scale)]
    if lagged:
        scale.append(_FIRST_LAG)
        low.append(1e-4)
    guess = np.array([*scale[:3], speed[0], *scale[4:]])
    # Two starts, because drag and the fall of thrust can substitute for each other.
    fits = []
    for factor in (1.0, 10.0):
        start = guess * np.array((factor, 1.0, factor, 1.0, 1.0, 1.0))[: len(guess)]
        fits.append(least_squares(lambda p: simulated(p) - speed, start, bounds=(low, np.inf), x_scale=scale))
    fit = min(fits, key=lambda each: each.cost)
    spread = _deviations(fit.jac, fit.fun)
    own = np.array([1.0, 1.0, 1.0 / unit**2])
    linear_drag, quadratic_drag, thrust = (own * fit.x[:3]).tolist()
    std = own * spread[:3]
    pitch = pitch_std = None
    if propeller is None:
        slip = float(fit.x[4])
        pitch = math.inf if slip * fastest < 1e-3 else 1.0 / (slip * unit)
        pitch_std = math.inf if math.isinf(pitch) else float(spread[4]) / slip * pitch
        propeller = Propeller(diameter=min(pitch, _NO_SLIP), advance=(0.0, 1.0), coefficient=(1.0, 0.0))
    model = SurgeModel(linear_drag, quadratic_drag, thrust, propeller)
    identified, verdict = _verdict(model, std, speed)
    lag, lag_std = (float(fit.x[-1]), float(spread[-1])) if lagged else (0.0, 0.0)
    return SurgeIdentification(model, std, rms(fit.fun), identified, verdict, pitch, pitch_std, lag, lag_std)


def _known_together(found: SurgeIdentification, speed: Floats, shaft: Floats) -> str:
    """The combined result, if the log does not separate drag from the fall of thrust with speed; "" at one speed."""
    model, full = found.model, float(np.abs(shaft).max())
    steady = _steady(full, model.linear_drag, model.quadratic_drag, model.curve())
    if float(np.percentile(speed, 98.0) - np.percentile(speed, 2.0)) < LEAST_SPREAD * float(np.percentile(speed, 98.0)):
        return ""
    return (
        "Give the propeller's diameter to separate drag from the loss of thrust with speed. Both together give "
        f"{steady:.2f} m/s at the highest command of {full:g}, with a thrust at rest of "
        f"{found.thrust_at_rest * full**2:.2g} m/s²."
    )


def _checked(time: ArrayLike, speed: ArrayLike, shaft: ArrayLike) -> tuple[Floats, Floats, Floats]:
    columns = [array_of("time", time, (None,))]
    columns += [array_of(name, each, columns[0].shape) for name, each in (("speed", speed), ("shaft", shaft))]
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
    """1σ of every parameter, enlarged if the residuals are correlated."""
    n = len(residual)
    spectrum = np.abs(np.fft.rfft(residual, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[: n // 4]
    correlation = correlation / max(correlation[0], 1e-300)
    faded = np.flatnonzero(correlation < 0.05)
    inflation = 1.0 + 2.0 * correlation[1 : faded[0] if len(faded) else None].sum()
    variance = residual @ residual / (n - jacobian.shape[1]) * max(inflation, 1.0)
    scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    # A direction that the log does not determine gets a very large σ; an inverse would fail.
    _, singular, rows = np.linalg.svd(jacobian / scale, full_matrices=False)
    weights = rows / np.maximum(singular, 1e-9)[:, None]
    return np.sqrt(variance * (weights**2).sum(axis=0)) / scale


def _verdict(model: SurgeModel, std: Floats, speed: Floats) -> tuple[bool, str]:
    low, high = np.percentile(speed, (2.0, 98.0))
    if high - low < LEAST_SPREAD * high:
        return False, (
            f"Not identified: the speed stays between {low:.2f} and {high:.2f} m/s, which determines only the ratio of "
            "drag to thrust; sail a staircase of three speeds or more, the highest at least 1.5 times the lowest."
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
def following(time: Floats, command: Floats, lag: float) -> Floats:
    """(n,) response of a shaft with a first-order lag (s) to a command that is linear from row to row."""
    out = np.empty(len(time))
    out[0] = command[0]
    for k in range(1, len(time)):
        dt = time[k] - time[k - 1]
        behind = lag * (command[k] - command[k - 1]) / dt
        out[k] = command[k] - behind + (out[k - 1] - command[k - 1] + behind) * math.exp(-dt / lag)
    return out


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


@kernel
def _steady(shaft: float, linear_drag: float, quadratic_drag: float, curve: Floats) -> float:
    """The steady speed (m/s) at a shaft speed, by bisection."""
    low, high = 0.0, 1.0
    while surge_rate(high, shaft, linear_drag, quadratic_drag, curve) > 0.0 and high < 1e3:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if surge_rate(middle, shaft, linear_drag, quadratic_drag, curve) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
