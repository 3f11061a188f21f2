"""Heading from propellers, an uncalibrated compass and GNSS velocity, for boats whose models are known roughly.

P4 bounds the effect of a wrong compass model. Most of the error of a compass model is a scale and a deviation. Most of
the error of a vehicle model is a bias of the propellers. Scale, deviation and bias are states here. GNSS velocity,
which does not depend on the compass, makes them observable:

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
    FARTHEST_OUTLIER,
    SCALE,
    SINE,
    WATER_SPEED,
    FilterBank,
    composite_model,
    heading_deg,
    score,
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
from steerway.estimation.heading.readings import LARGEST_READING, checked_difference

STATES = WATER_SPEED + 1
APART = math.radians(30.0)
"""Spacing of the start headings of the filters that seek an unknown heading; half the spacing is their 1σ."""
FARTHEST = 2.0 * math.pi
"""Largest start heading in either direction, rad. −45° and 315° are different starts, because the compass's scale acts
on the total turn since north."""
UNLIKELY = 1e-6
"""Probability below which a filter is given up: it would take two readings of NIS 14 to become likely again."""
_SAME_HEADING_DEG, _SAME_SCALE = 3.0, 0.02
"""Differences of heading (a tenth of `APART`) and of the compass's scale below which two filters become one."""


@dataclass(frozen=True)
class HeadingTuning:
    """Noise of every state; pairs are (1σ at first, random walk in 1σ per √s). A pair of zeros holds a state fixed."""

    vehicle_std: float = 2e-4  # process noise of each vehicle state, 1σ in a second
    vehicle_start_std: float = 1e-5
    bias: tuple[float, float] = (20.0 * RPM, 0.2 * RPM)  # rad/s
    scale: tuple[float, float] = (0.3, 1e-4)
    deviation: tuple[float, float] = (4.0, 0.2)  # degrees; covers a card's harmonics too
    current: tuple[float, float] = (0.4, 2e-3)  # m/s
    velocity_std: float = 0.1  # of GNSS velocity, north and east, m/s
    speed: float = SPEED  # through the water at first, m/s
    water_speed: tuple[float, float] = (0.1, 1e-4)  # m/s
    compass_std_deg: float = math.sqrt(STATE_VARIANCE)  # process noise of each compass state, 1σ in a tick, P4 (7)
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


class AidedHeadingFilter(FilterBank):
    """An extended Kalman filter of heading; see the module.

    heading: at the start, rad; None for unknown. Headings are unwrapped: they count turns from the start.

    At the end of the last step: heading, heading_std (rad), scale (ratio of the compass's gain to the model's) with
    scale_std, bias (rad/s), current (north, east; m/s), water_speed (m/s) and deviation (rad; sine and cosine terms).
    While several start headings are possible, these are values of the likeliest, and heading_std covers all. An unknown
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
        model = composite_model(compass, yaw, tuning.vehicle_std**2, tuning.reading_std_deg**2, noise)
        pairs = tuning.pairs()
        self._walks = pairs[:, 1] ** 2
        self._velocity_variance = tuning.velocity_std**2
        std = tuning.vehicle_start_std
        if heading is None:
            count = round(FARTHEST / APART)
            headings = [APART * k for k in range(-count, count + 1)]
            std = 0.5 * math.degrees(APART) / model[AT.output]
        elif abs(heading) <= LARGEST_READING:
            headings = [heading]
        else:
            raise InputError(f"heading.heading is {heading:g} rad, expected None or at most {LARGEST_READING:g} rad")
        variances = np.array([std**2, tuning.vehicle_start_std**2, noise, noise, *pairs[:, 0] ** 2])
        beginnings = [_begin(model, variances, each, tuning.speed) for each in headings]
        states, covariances = (np.array(each) for each in zip(*beginnings, strict=True))
        super().__init__(np.repeat(model[None], len(headings), axis=0), states, covariances)
        self._is_known = heading is not None
        self._work = np.empty((2, STATES))

    @property
    def heading(self) -> float:
        return super().heading if self._is_known else math.nan

    @property
    def scale(self) -> float:
        return float(self._states[0, SCALE])

    @property
    def scale_std(self) -> float:
        return math.sqrt(self._covariances[0, SCALE, SCALE])

    @property
    def bias(self) -> float:
        return float(self._states[0, BIAS])

    @property
    def deviation(self) -> tuple[float, float]:
        return math.radians(self._states[0, SINE]), math.radians(self._states[0, COSINE])

    @property
    def current(self) -> tuple[float, float]:
        return float(self._states[0, CURRENT_NORTH]), float(self._states[0, CURRENT_EAST])

    @property
    def water_speed(self) -> float:
        return float(self._states[0, WATER_SPEED])

    def yaw_rate(self, difference: float) -> float:
        """Yaw rate of the model with n_d (rad/s) and its bias, rad/s."""
        return super().yaw_rate(difference + self.bias)

    def sped_up(self, factor: float, std: float) -> None:
        """Multiply the speed through the water by `factor`, and add the variance of 1σ `std` (m/s)."""
        p = self._covariances
        self._states[:, WATER_SPEED] *= factor
        p[:, WATER_SPEED] *= factor
        p[:, :, WATER_SPEED] *= factor
        p[:, WATER_SPEED, WATER_SPEED] += std * std

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
        """Take the present GNSS velocity (north, east, m/s; NaN for none) and the readings of the next dt s (rad, any
        number), and advance by n_d (rad/s). Returns the heading (rad).

        slip: 1σ (m/s) of the component of the velocity through the water that is not along the bow. `readings`, `times`
        and errors: see `readings.Ticks.parts`.
        """
        difference = checked_difference(difference)
        if np.shape(velocity) != (2,):
            raise InputError(f"heading.velocity has shape {np.shape(velocity)}, expected (north, east)")
        parts = list(self._ticks.parts(dt, readings, times))
        moves = math.isfinite(velocity[0]) and math.isfinite(velocity[1])
        variance = self._velocity_variance + slip * slip
        if moves:
            for k, (x, p, model) in enumerate(zip(self._states, self._covariances, self._models, strict=True)):
                self._scores[k] += take_velocity(x, p, self._work, model, *velocity, variance)
        self._advance(difference, parts, self._walks)
        self._is_known = self._is_known or moves or any((table[1] > 0.0).any() for _, table in parts)
        if len(self._states) > 1:
            self._decide()
        return self.heading

    def _decide(self) -> None:
        """Give up filters that are unlikely, and the less likely of two that have converged."""
        weights, degrees, scales = self.weights, self._degrees, self._states[:, SCALE]
        kept: list[int] = []
        for k in np.argsort(-weights, kind="stable").tolist():
            same = (np.abs(degrees[kept] - degrees[k]) < _SAME_HEADING_DEG) & (
                np.abs(scales[kept] - scales[k]) < _SAME_SCALE
            )
            if weights[k] > UNLIKELY and not same.any():
                kept.append(k)
        self._models, self._scores = self._models[kept], self._scores[kept]
        self._states, self._covariances = self._states[kept], self._covariances[kept]


def _begin(model: Floats, variances: Floats, heading: float, speed: float) -> tuple[Floats, Floats]:
    """State and covariance at the start at a heading (rad), with these variances of the states."""
    state = np.zeros(STATES)
    state[0] = math.degrees(heading) / model[AT.output]
    # The compass is assumed to have settled on the heading, with a scale of 1.
    gain = model[AT.b] / (1.0 - model[AT.a1] - model[AT.shift] * model[AT.a2])
    state[2] = gain * math.degrees(heading)
    state[3] = model[AT.shift] * state[2]
    state[SCALE], state[WATER_SPEED] = 1.0, speed
    p = np.diag(variances)
    # The compass's states are as uncertain as the heading, scale and deviation on which they settle.
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
    return state, p


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
        likely += score(innovation, s, FARTHEST_OUTLIER)
        take_scalar(x, p, pc, work[1], s, innovation)
        fill_lower(p)
    return likely
