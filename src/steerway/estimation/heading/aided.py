"""Heading from propellers, an uncalibrated compass and GNSS velocity, for boats whose models are known roughly.

P4 bounds the effect of a wrong compass model. Most of the error of a compass model is a scale and a deviation, most of
that of a vehicle model is a bias of the propellers. Scale, deviation and bias are states here. GNSS velocity, which
does not depend on the compass, makes them observable:

    x = [v1 v2 c1 c2 | bias of n_d | compass scale, sine and cosine of its deviation | current north, east | speed].

The compass measures scale · ψ + deviation, and v_GNSS = speed · (cos ψ, sin ψ) + current, with the speed through the
water. The filter is an extended Kalman filter; readings are modulo a turn. If the first heading is unknown, filters
that start at every 30° run side by side until their likelihoods decide. Angles of the compass are in degrees as in
`composite`; all else is SI.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.kalman import take_scalar
from steerway.core.kinematics import heading_for
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.heading.composite import (
    AT,
    BIAS,
    COSINE,
    CURRENT_EAST,
    CURRENT_NORTH,
    SCALE,
    SINE,
    WATER_SPEED,
    composite_model,
    heading_deg,
    heading_variance_deg2,
    observe,
    predict_compass,
    predict_vehicle,
    stepped,
    yaw_rate_deg,
)
from steerway.estimation.heading.models import (
    PHYSICAL_YAW,
    READING_VARIANCE_DEG2,
    RPM,
    SPEED,
    STATE_VARIANCE,
    TCM2,
    CompassModel,
    HeadingModel,
)
from steerway.estimation.heading.readings import LARGEST_READING, Ticks, checked_difference

STATES = WATER_SPEED + 1
APART = math.radians(30.0)
"""Spacing of the start headings of the filters that seek an unknown heading; half the spacing is their 1σ."""
FARTHEST = 2.0 * math.pi
"""Start headings extend this far either way, rad. −45° and 315° are different starts, because the compass's scale acts
on the total turn since north."""
UNLIKELY = 1e-6
"""Probability below which a filter is given up: it would take two readings of NIS 14 to become likely again."""
_SAME_HEADING_DEG, _SAME_SCALE = 3.0, 0.02
"""Differences of heading (a tenth of `APART`) and of the compass's scale below which two filters become one."""


@dataclass(frozen=True)
class HeadingTuning:
    """Noise of every state; pairs are (1σ at first, random walk in 1σ per √s). A pair of zeros holds a state fixed."""

    vehicle_std: float = 2e-4  # of each vehicle state a second
    vehicle_start_std: float = 1e-5
    bias: tuple[float, float] = (20.0 * RPM, 0.2 * RPM)  # rad/s
    scale: tuple[float, float] = (0.3, 1e-4)
    deviation: tuple[float, float] = (4.0, 0.2)  # degrees; covers a card's harmonics too
    current: tuple[float, float] = (0.4, 2e-3)  # m/s
    velocity_std: float = 0.1  # of GNSS velocity, north and east, m/s
    speed: float = SPEED  # through the water at first, m/s
    water_speed: tuple[float, float] = (0.1, 1e-4)  # m/s
    compass_std_deg: float = math.sqrt(STATE_VARIANCE)  # of each state of the compass a tick, as in P4 (7)
    reading_std_deg: float = math.sqrt(READING_VARIANCE_DEG2)  # of one reading

    def __post_init__(self) -> None:
        for name in ("vehicle_std", "vehicle_start_std"):
            not_negative(f"heading_tuning.{name}", getattr(self, name))
        for name in ("bias", "scale", "deviation", "current", "water_speed"):
            for value in getattr(self, name):
                not_negative(f"heading_tuning.{name}", value)
        for name in ("velocity_std", "compass_std_deg", "reading_std_deg"):
            positive(f"heading_tuning.{name}", getattr(self, name))
        positive("heading_tuning.speed", self.speed)

    def pairs(self) -> Floats:
        """(7, 2) 1σ at the start and random walk of the states beyond vehicle and compass."""
        both = (self.deviation, self.deviation, self.current, self.current)
        return np.array([self.bias, self.scale, *both, self.water_speed])


PRODUCT = HeadingTuning()
"""The default tuning. `steerway study springer-mission` tests it on simulated boats that differ from its model."""
SCALE_ONLY = HeadingTuning(1e-7, 1e-6, (0.0, 0.0), (0.3, 0.0), (0.0, 0.0), (0.0, 0.0), water_speed=(0.0, 0.0))
"""For P4's own world, in which only the compass is unknown: vehicle, propellers and noise are known."""


@dataclass
class _Beginning:
    """A filter that started at one heading, and its log likelihood."""

    state: Floats
    covariance: Floats
    score: float = 0.0


class AidedHeadingFilter:
    """An extended Kalman filter of heading; see the module.

    heading: at the start, rad; None for unknown. Headings are unwrapped: they count turns from there.

    At the end of the last step: heading, heading_std (rad), scale (the compass's gain over the model's) with scale_std,
    bias (rad/s), current (north, east; m/s), water_speed (m/s) and deviation (rad; sine and cosine terms). While
    several start headings are possible, these are values of the likeliest, and heading_std covers all. An unknown
    heading is NaN until the first measurement.
    """

    def __init__(
        self,
        tuning: HeadingTuning = PRODUCT,
        compass: CompassModel = TCM2,
        yaw: HeadingModel = PHYSICAL_YAW,
        heading: float | None = 0.0,
    ) -> None:
        noise = tuning.compass_std_deg**2
        self._model = composite_model(compass, yaw, tuning.vehicle_std**2, tuning.reading_std_deg**2, noise)
        pairs = tuning.pairs()
        self._walks = pairs[:, 1] ** 2
        self._velocity_variance = tuning.velocity_std**2
        std = tuning.vehicle_start_std
        if heading is None:
            count = round(FARTHEST / APART)
            headings = [APART * k for k in range(-count, count + 1)]
            std = 0.5 * math.degrees(APART) / self._model[AT.output]
        elif abs(heading) <= LARGEST_READING:
            headings = [heading]
        else:
            raise InputError(f"heading.heading is {heading:g} rad, expected None or at most {LARGEST_READING:g} rad")
        start = [std**2, tuning.vehicle_start_std**2, noise, noise]
        self._covariance_at_first = np.diag([*start, *pairs[:, 0] ** 2])
        self._beginnings = [self._begin(each, tuning.speed) for each in headings]
        self._best = self._beginnings[0]
        self._is_known = heading is not None
        self._work = np.empty((2, STATES))
        self._ticks = Ticks()

    def _begin(self, heading: float, speed: float) -> _Beginning:
        state = np.zeros(STATES)
        state[0] = math.degrees(heading) / self._model[AT.output]
        # The compass is assumed to have settled on the heading, with a scale of 1.
        model = self._model
        gain = model[AT.b] / (1.0 - model[AT.a1] - model[AT.shift] * model[AT.a2])
        state[2] = gain * math.degrees(heading)
        state[3] = model[AT.shift] * state[2]
        state[SCALE], state[WATER_SPEED] = 1.0, speed
        p = self._covariance_at_first.copy()
        # Its states have the uncertainty of heading, scale and deviation, on which they settle.
        slope = np.zeros(STATES)
        slope[0], slope[SCALE] = gain * model[AT.output], gain * math.degrees(heading)
        slope[SINE], slope[COSINE] = gain * math.sin(heading), gain * math.cos(heading)
        spread = p @ slope
        variance = float(slope @ spread)
        for place, share in ((2, 1.0), (3, float(model[AT.shift]))):
            p[place] += share * spread
            p[:, place] += share * spread
        p[2, 2] += variance
        p[3, 3] += model[AT.shift] ** 2 * variance
        p[2, 3] = p[3, 2] = model[AT.shift] * variance
        return _Beginning(state, p)

    @property
    def heading(self) -> float:
        if not self._is_known:
            return math.nan
        return math.radians(heading_deg(self._best.state, self._model))

    @property
    def heading_std(self) -> float:
        if len(self._beginnings) == 1:
            return math.radians(math.sqrt(heading_variance_deg2(self._best.covariance, self._model)))
        best, total = heading_deg(self._best.state, self._model), 0.0
        for each, weight in zip(self._beginnings, self._weights(), strict=True):
            apart = heading_deg(each.state, self._model) - best
            apart -= 360.0 * round(apart / 360.0)
            total += weight * (heading_variance_deg2(each.covariance, self._model) + apart * apart)
        return math.radians(math.sqrt(total))

    @property
    def scale(self) -> float:
        return float(self._best.state[SCALE])

    @property
    def scale_std(self) -> float:
        return math.sqrt(self._best.covariance[SCALE, SCALE])

    @property
    def bias(self) -> float:
        return float(self._best.state[BIAS])

    @property
    def deviation(self) -> tuple[float, float]:
        return math.radians(self._best.state[SINE]), math.radians(self._best.state[COSINE])

    @property
    def current(self) -> tuple[float, float]:
        return float(self._best.state[CURRENT_NORTH]), float(self._best.state[CURRENT_EAST])

    @property
    def water_speed(self) -> float:
        return float(self._best.state[WATER_SPEED])

    def yaw_rate(self, difference: float) -> float:
        """Yaw rate of the model with n_d (rad/s) and its bias, rad/s."""
        return math.radians(yaw_rate_deg(self._best.state, self._model, difference + self.bias))

    def sped_up(self, factor: float, std: float) -> None:
        """Multiply the speed through the water by `factor`, and add the variance of 1σ `std` (m/s)."""
        for each in self._beginnings:
            x, p = each.state, each.covariance
            x[WATER_SPEED] *= factor
            p[WATER_SPEED] *= factor
            p[:, WATER_SPEED] *= factor
            p[WATER_SPEED, WATER_SPEED] += std * std

    def turned(self, std: float) -> None:
        """Increase the uncertainty of the heading by a turn that the model does not predict, 1σ `std` (rad)."""
        for each in self._beginnings:
            each.covariance[0, 0] += (math.degrees(std) / self._model[AT.output]) ** 2

    def heading_for(self, course: float) -> float:
        """The heading (rad, in [−π, π)) that yields a course over ground (rad) in the estimated current."""
        return float(heading_for(course, self.water_speed, *self.current)[0])

    def step(
        self,
        difference: float,
        readings: ArrayLike | None = None,
        velocity: tuple[float, float] = (math.nan, math.nan),
        dt: float = 1.0,
        times: ArrayLike | None = None,
        slip: float = 0.0,
    ) -> float:
        """Take a GNSS velocity (north, east, m/s; NaN for none) of now, the readings of the next dt s (rad, any number)
        and advance by n_d (rad/s); returns the heading (rad).

        slip: 1σ (m/s) of the component of the velocity through the water that is not along the bow. `readings`, `times`
        and errors: see `readings.Ticks.parts`.
        """
        difference = checked_difference(difference)
        if np.shape(velocity) != (2,):
            raise InputError(f"heading.velocity has shape {np.shape(velocity)}, expected (north, east)")
        parts = list(self._ticks.parts(dt, readings, times))
        moves = math.isfinite(velocity[0]) and math.isfinite(velocity[1])
        variance = self._velocity_variance + slip * slip
        for each in self._beginnings:
            x, p = each.state, each.covariance
            if moves:
                each.score += take_velocity(x, p, self._work, self._model, *velocity, variance)
            for part, table in parts:
                model = stepped(self._model, part)
                each.score += advance(x, p, self._work, model, self._walks * part, difference, table)
        self._is_known = self._is_known or moves or any((table[1] > 0.0).any() for _, table in parts)
        if len(self._beginnings) > 1:
            self._decide()
        return self.heading

    def _weights(self) -> Floats:
        scores = np.array([each.score for each in self._beginnings])
        scores = np.where(np.isfinite(scores), scores, -np.inf)  # of a state beyond floating point
        if np.isneginf(scores).all():
            return np.full(len(scores), 1.0 / len(scores))
        likely = np.exp(scores - scores.max())
        return likely / likely.sum()

    def _decide(self) -> None:
        """Give up filters that are unlikely, and the less likely of two that have converged."""
        kept: list[_Beginning] = []
        for weight, each in sorted(zip(self._weights(), self._beginnings, strict=True), key=lambda pair: -pair[0]):
            if weight > UNLIKELY and not any(self._is_same(each, other) for other in kept):
                kept.append(each)
        self._beginnings, self._best = kept, kept[0]

    def _is_same(self, one: _Beginning, other: _Beginning) -> bool:
        apart = heading_deg(one.state, self._model) - heading_deg(other.state, self._model)
        return abs(apart) < _SAME_HEADING_DEG and abs(one.state[SCALE] - other.state[SCALE]) < _SAME_SCALE


@kernel
def take_velocity(
    x: Floats, p: Floats, work: Floats, model: Floats, north: float, east: float, variance: float
) -> float:
    """Take a GNSS velocity (m/s) as two scalar measurements. Returns its log likelihood."""
    likely = 0.0
    for axis in range(2):
        psi, speed = math.radians(heading_deg(x, model)), x[WATER_SPEED]
        ahead = math.cos(psi) if axis == 0 else math.sin(psi)
        turn = math.radians(speed * (-math.sin(psi) if axis == 0 else math.cos(psi)))
        pc, s = work[0], variance
        for j in range(STATES):
            pc[j] = turn * (model[AT.output] * p[0, j] + model[AT.output + 1] * p[1, j])
            pc[j] += ahead * p[WATER_SPEED, j] + p[CURRENT_NORTH + axis, j]
        s += turn * (model[AT.output] * pc[0] + model[AT.output + 1] * pc[1])
        s += ahead * pc[WATER_SPEED] + pc[CURRENT_NORTH + axis]
        measured = north if axis == 0 else east
        innovation = measured - speed * ahead - x[CURRENT_NORTH + axis]
        likely += score(innovation, s)
        take_scalar(x, p, pc, work[1], s, innovation)
        fill_lower(p)
    return likely


@kernel
def score(innovation: float, s: float) -> float:
    """Log likelihood of an innovation of variance s; an outlier counts as an innovation of six σ."""
    return -0.5 * (math.log(s) + min(innovation * innovation / s, 36.0))


@kernel
def advance(
    x: Floats, p: Floats, work: Floats, model: Floats, walks: Floats, difference: float, readings: Floats
) -> float:
    """Take the ticks of a table of readings, each modulo a turn; then predict the vehicle and the random walks, with
    variances (7,) for the step. Returns the log likelihood of the readings."""
    likely = 0.0
    for tick in range(readings.shape[1]):
        predict_compass(x, p, work[0], model)
        if readings[1, tick] > 0.0:
            innovation = readings[0, tick] - model[AT.k] * x[2]
            innovation -= 360.0 * round(innovation / 360.0)
            s = observe(p, work[0], model, readings[1, tick])
            likely += score(innovation, s)
            take_scalar(x, p, work[0], work[1], s, innovation)
            fill_lower(p)
    predict_vehicle(x, p, model, difference)
    for i in range(len(walks)):
        p[BIAS + i, BIAS + i] += walks[i]
    return likely
