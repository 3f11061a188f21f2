"""Nomoto's K, T and rudder bias from a zigzag or a turning circle, for the gains of an autopilot.

T ω̇ + ω = K (δ + b), P1 (26)–(27), P0 (51)–(52), by maximum likelihood on the innovations of a Kalman filter with the
rudder as input. Measurement and process noise are estimated separately: the intervals depend on both. For an angle (a
compass heading, or a course) the innovations are linear in K and K b; for positions alone, the five-state filter gives
the likelihood. The intervals are nominally 95 %; for noisy zigzags of four minutes their coverage is 90 to 92 %.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize

from steerway.control.course import AnglePIDGains, place_poles
from steerway.core.arrays import Floats
from steerway.core.checks import array_of
from steerway.core.earth import displacement
from steerway.core.errors import InputError
from steerway.core.records import REJECTED, Fixes, Motion
from steerway.estimation.filter.model import Bank, Model, empty_bank
from steerway.estimation.log_estimate import estimate
from steerway.estimation.vessel.flat import model_of_profile
from steerway.estimation.vessel.profile import Profile
from steerway.identification.interval import Interval, covariance
from steerway.identification.yaw_likelihood import angle_innovations, positions_cost

_FEWEST = 30
_LEAST_TURN = math.radians(3.0)
_START_TIMES = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
_START_RATIOS = (1e-6, 1e-3, 1.0)
_EXPECTED = np.log([1e-4, 1e-3, 0.3])
_EXPECTED_STD = np.array([4.0, 4.0, 2.0])
"""Prior σ of the logarithms of S_ω (rad²/s³), S_U (m²/s³) and a fix's σ (m); wide, so that data outweigh it."""
_BIG = 1e12


@dataclass(frozen=True)
class YawModel:
    """Nomoto's model with 95 % intervals; the unit of the rudder (rad or N·m) is that of the record."""

    gain: Interval  # K, rad/s per unit of rudder; positive if positive rudder turns to starboard
    time_constant: Interval  # T, s
    rudder_bias: Interval  # b: with the rudder at −b the vessel goes straight
    samples: int
    measured: str  # "angle" or "positions"

    def gains(self, bandwidth: float, damping: float = 1.0, limit: float = math.inf) -> AnglePIDGains:
        """The autopilot's gains by pole placement, P0 (57)–(59); see `control.course.place_poles`.

        Raises InputError as `place_poles` does, and if positive rudder turns to port.
        """
        if self.gain.value < 0.0:
            raise InputError(
                f"the rudder's gain is {self.gain.value:g}: positive rudder turns to port, expected the sign "
                "by which positive rudder turns to starboard"
            )
        return place_poles(self.gain.value, self.time_constant.value, bandwidth, damping, limit)


def identify_yaw(time: ArrayLike, rudder: ArrayLike, angle: ArrayLike) -> YawModel:
    """Identify K, T and b from a rudder and an angle.

    Args:
        time: (n,) s, rising.
        rudder: (n,) rudder angle (rad) or yaw moment (N·m); a row's value holds until the next row, as a command does.
        angle: (n,) heading or course, rad, wrapped or not; NaN where it was not measured.

    Raises InputError if lengths differ, time does not rise, or the manoeuvre is too small: fewer than 30 angles, a
    rudder that never moves, less than 3° of turning.
    """
    time, rudder, angle = _columns(time, rudder, angle=angle)
    angle = _unwrapped(angle)
    known = np.isfinite(angle)
    _check_manoeuvre(rudder, known, np.ptp(angle[known]) if known.any() else 0.0)
    scale = float(np.std(rudder))
    rudder = rudder / scale
    innovations = np.empty((len(time), 4))

    def run(point: Floats) -> Floats:
        angle_innovations(time, angle, rudder, math.exp(point[0]), math.exp(point[1]), innovations)
        return innovations[known][1:]

    def profiled(point: Floats) -> float:
        return _profiled(run(point))[0] if _sane(point) else _BIG

    starts = [np.log((t, ratio)) for t in _START_TIMES for ratio in _START_RATIOS]
    best = min(starts, key=profiled)
    best = minimize(profiled, best, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-6, "maxiter": 400}).x
    _, linear, variance = _profiled(run(best))

    def cost(point: Floats) -> float:
        """−log L of (log T, log ratio, log variance, K, c)."""
        nu_y, nu_k, nu_c, s = run(point[:2]).T
        left = nu_y - point[3] * nu_k - point[4] * nu_c
        return 0.5 * float(np.sum(left * left / s / math.exp(point[2]) + np.log(s) + point[2]))

    optimum = np.array([*best, math.log(variance), *linear])
    spread = covariance(cost, optimum, _steps(optimum, 3))
    return _model(optimum[0], linear, spread[np.ix_([0, 3, 4], [0, 3, 4])], scale, int(known.sum()), "angle")


def identify_yaw_from_fixes(fixes: Fixes, time: ArrayLike, rudder: ArrayLike) -> YawModel:
    """Identify K, T and b of the course from positions alone.

    Args:
        fixes: one vessel's positions, under way.
        time, rudder: (m,) Unix s, and the rudder from each time to the next, as for `identify_yaw`.

    Raises InputError as `identify_yaw` does, and if fewer than 30 fixes lie within the times of the rudder.
    """
    time, rudder = _columns(time, rudder)
    fixes = fixes.rows(fixes.has_position).in_order().between(time[0], time[-1])
    if len(fixes) < _FEWEST:
        raise InputError(f"{len(fixes)} fixes lie within the rudder's record, expected at least {_FEWEST}")
    motion = _smoothed(fixes)
    held = rudder[np.searchsorted(time, motion.time, side="right") - 1]
    start = identify_yaw(motion.time, held, motion.cog)
    scale = float(np.std(rudder))
    moments, held, north, east = _merged(fixes.rows(np.isin(fixes.time, motion.time)), time, rudder / scale)

    model = model_of_profile(Profile(speed_noise=1.0, course_rate_noise=1.0, position_std=1.0))

    def cost(point: Floats) -> float:
        """−log L of (log T, log S_ω, log S_U, log σ, K, c), with a wide prior on the noises."""
        if not _sane(point[:4]):
            return _BIG
        loosely = 0.5 * float(np.sum(((point[1:4] - _EXPECTED) / _EXPECTED_STD) ** 2))
        rate_noise, speed_noise, std = np.exp(point[1:4]).tolist()
        model.modes["rate_decay"], model.modes["rate_noise"] = math.exp(-point[0]), rate_noise
        model.modes["speed_noise"], model.receiver["fix_variance"] = speed_noise, std**2
        bank = _under_way(model, north, east, motion)
        return loosely + positions_cost(moments, held, north, east, point[4], point[5], model, bank)

    gain, push = start.gain.value * scale, start.gain.value * start.rudder_bias.value
    starts = [
        np.array([math.log(start.time_constant.value), math.log(rate), math.log(speed), math.log(std), gain, push])
        for rate, speed, std in product((1e-6, 1e-4, 1e-2), (1e-5, 1e-2), (0.05, 0.5, 3.0))
    ]
    optimum = _minimised(cost, min(starts, key=cost))
    spread = covariance(cost, optimum, _steps(optimum, 4))
    return _model(optimum[0], optimum[4:], spread[np.ix_([0, 4, 5], [0, 4, 5])], scale, len(fixes), "positions")


def _minimised(cost: Callable[[Floats], float], point: Floats) -> Floats:
    """The minimum by Nelder and Mead's simplex, restarted from its result until this gains less than 0.01."""
    value = cost(point)
    for _ in range(6):
        simplex = point + np.vstack([np.zeros(len(point)), np.diag(np.maximum(0.3 * np.abs(point), 0.02))])
        options = {"initial_simplex": simplex, "maxiter": 1500, "maxfev": 1500, "xatol": 1e-6, "fatol": 1e-4}
        found = minimize(cost, point, method="Nelder-Mead", options=options)
        gained, point, value = value - found.fun, found.x, found.fun
        if gained < 0.01:
            break
    return point


def _profiled(innovations: Floats) -> tuple[float, Floats, float]:
    """(−log L, (K, c), variance of an angle) at the best K, c and variance for these innovations."""
    nu_y, nu_k, nu_c, s = innovations.T
    weight = 1.0 / np.sqrt(s)
    linear, *_ = np.linalg.lstsq(np.column_stack([nu_k, nu_c]) * weight[:, None], nu_y * weight, rcond=None)
    left = (nu_y - linear[0] * nu_k - linear[1] * nu_c) * weight
    variance = max(float(left @ left) / len(left), 1e-30)
    return 0.5 * (len(left) * math.log(variance) + float(np.sum(np.log(s)))), linear, variance


def _steps(point: Floats, logarithms: int) -> Floats:
    """Steps for the curvature: 0.01 for logarithms; for K and c, 1 % of the larger of them."""
    steps = np.full(len(point), 1e-2)
    steps[logarithms:] = 1e-2 * max(float(np.max(np.abs(point[logarithms:]))), 1e-9)
    return steps


def _sane(logarithms: Floats) -> bool:
    """Whether (log T, log of noises) are plausible: T between 7 ms and 8 hours, noise within the range of floats."""
    return abs(logarithms[0] - 2.65) < 7.6 and bool(np.all(np.abs(logarithms) < 40.0))


def _model(log_time: float, linear: Floats, spread: Floats, scale: float, samples: int, measured: str) -> YawModel:
    """The model in the record's unit from (log T, K, c) for the scaled rudder and their covariance."""
    gain, push = linear
    if gain == 0.0:
        raise InputError("the vessel does not respond to the rudder, expected a manoeuvre that it follows")
    slope = np.array([-push / gain**2, 1.0 / gain])
    bias_variance = float(slope @ spread[1:, 1:] @ slope)
    stds = np.sqrt(np.maximum([spread[0, 0], spread[1, 1], bias_variance], 0.0)).tolist()
    return YawModel(
        gain=Interval.around(float(gain) / scale, stds[1] / scale),
        time_constant=Interval.around_positive(math.exp(log_time), stds[0]),
        rudder_bias=Interval.around(float(push / gain) * scale, stds[2] * scale),
        samples=samples,
        measured=measured,
    )


def _smoothed(fixes: Fixes) -> Motion:
    """The smoothed estimate at fixes that have a course and are not rejected, for the first guess and the start."""
    motion = estimate(fixes, smooth=True)
    known = np.isfinite(motion.cog) & (motion.status != REJECTED)
    if known.sum() < _FEWEST:
        raise InputError(f"course is defined at {known.sum()} fixes, expected at least {_FEWEST} under way")
    return motion.rows(known)


def _under_way(model: Model, north: Floats, east: Floats, motion: Motion) -> Bank:
    """A filter that starts at the first position, with the smoothed speed and course."""
    bank, position, speed = empty_bank(model), model.receiver["fix_variance"][0], motion.sog[0]
    bank.x[0] = north[0], east[0], speed, motion.cog[0], 0.0
    bank.p[0] = np.diag([position, position, (0.3 * speed) ** 2, 0.1 * speed**2, 0.1])
    bank.probability[0], bank.run["started"] = 1.0, 1
    return bank


def _merged(fixes: Fixes, time: Floats, rudder: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Fixes and rudder merged in time order: time, current rudder, north and east (NaN in rows without a fix)."""
    moments = np.unique(np.concatenate([time[time > fixes.time[0]], fixes.time]))
    held = rudder[np.clip(np.searchsorted(time, moments, side="right") - 1, 0, None)]
    north, east = np.full(len(moments), np.nan), np.full(len(moments), np.nan)
    places = [
        displacement(latitude, longitude, fixes.latitude[0], fixes.longitude[0])
        for latitude, longitude in zip(fixes.latitude, fixes.longitude, strict=True)
    ]
    rows = np.searchsorted(moments, fixes.time)
    north[rows], east[rows] = np.array(places).T
    return moments, held, north, east


def _columns(time: ArrayLike, rudder: ArrayLike, **others: ArrayLike) -> list[Floats]:
    columns = {"time": array_of("time", time, (None,))}
    for name, values in {"rudder": rudder, **others}.items():
        columns[name] = array_of(name, values, columns["time"].shape)
    if len(columns["time"]) < 2 or not np.all(np.diff(columns["time"]) > 0.0):
        raise InputError("time does not rise, expected rising seconds")
    if not np.isfinite(columns["rudder"]).all():
        raise InputError("the rudder is unknown in some rows, expected a number in each")
    if np.ptp(columns["rudder"]) == 0.0:
        raise InputError(f"the rudder stays at {columns['rudder'][0]:g}, expected a zigzag or a turning circle")
    return list(columns.values())


def _unwrapped(angle: Floats) -> Floats:
    known = np.isfinite(angle)
    angle = angle.copy()
    angle[known] = np.unwrap(angle[known])
    return angle


def _check_manoeuvre(rudder: Floats, known: NDArray[np.bool_], turned: float) -> None:
    if known.sum() < _FEWEST:
        raise InputError(f"{known.sum()} angles were measured, expected at least {_FEWEST}")
    if turned < _LEAST_TURN:
        raise InputError(f"the vessel turned by {math.degrees(turned):.1f}°, expected a zigzag or a turning circle")
