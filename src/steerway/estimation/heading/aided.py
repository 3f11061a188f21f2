"""Heading from propellers, an uncalibrated compass and GNSS velocity, for boats whose models are known roughly.

P4 treats a wrong compass model by bounds. Most of the error of a wrong compass is a scale and a deviation, most of that
of a wrong vehicle is a bias of the propellers; these are states here, and GNSS velocity, which does not depend on the
compass, makes them observable:

    x = [v1 v2 c1 c2 | bias of n_d | compass scale, sine and cosine of its deviation | current north, east | speed].

The compass sees scale · ψ + deviation, v_GNSS = speed · (cos ψ, sin ψ) + current, with the speed through the water. An
extended Kalman filter; readings are taken modulo a turn. A first heading that is not known is sought all round: filters
that begin at every 30° run side by side until their likelihoods have decided. Angles of the compass part in degrees as
in `composite`, the rest is SI.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.compiled import kernel
from steerway.core.errors import InputError
from steerway.core.kalman import take_scalar
from steerway.core.linear_algebra import fill_lower
from steerway.estimation.heading.composite import (
    A1,
    A2,
    COMPASS_NOISE,
    INPUT_1,
    OUTPUT_1,
    POLE_1,
    READING_NOISE,
    SHIFT,
    VEHICLE_NOISE,
    B,
    K,
    composite_model,
    heading_deg,
    heading_variance_deg2,
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

BIAS, SCALE, SINE, COSINE, CURRENT_NORTH, CURRENT_EAST, WATER_SPEED = range(4, 11)
STATES = 11
WALKS = STATES - BIAS
APART = math.radians(30.0)
"""Spacing of the first headings of the filters that seek an unknown one; half of it is their 1σ. Chosen."""
FARTHEST = 2.0 * math.pi
"""First headings are sought this far to either hand: the compass's scale acts on the whole turn made since north, so
that −45° and 315° are different beginnings."""
UNLIKELY = 1e-6
"""Probability below which a filter is given up. Chosen: one of these takes two readings of NIS 14 to come back."""
_SAME_HEADING_DEG, _SAME_SCALE = 3.0, 0.02
"""Differences of heading and of the compass's scale below which two filters are one. Chosen: a tenth of `APART`."""


@dataclass(frozen=True)
class HeadingTuning:
    """Noise of every state; pairs are (1σ at first, random walk in 1σ per √s). Zero pairs hold a state fixed."""

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
        """(7, 2) start and walk of the states beyond vehicle and compass."""
        both = (self.deviation, self.deviation, self.current, self.current)
        return np.array([self.bias, self.scale, *both, self.water_speed])


PRODUCT = HeadingTuning()
"""Chosen; `steerway study springer-mission` judges it in worlds that it does not know."""
SCALE_ONLY = HeadingTuning(1e-7, 1e-6, (0.0, 0.0), (0.3, 0.0), (0.0, 0.0), (0.0, 0.0), water_speed=(0.0, 0.0))
"""For P4's own world, where vehicle, propellers and noise are known and the compass alone is not."""


@dataclass
class _Beginning:
    """A filter that began at one heading, and the logarithm of its likelihood."""

    state: Floats
    covariance: Floats
    score: float = 0.0


class AidedHeadingFilter:
    """An extended Kalman filter of heading; see the module.

    heading: at the beginning, rad; None for unknown. Unwrapped headings count turns from there.

    At the end of the last step: heading, heading_std (rad), scale (the compass's gain over the model's) with scale_std,
    bias (rad/s), current (north, east; m/s), water_speed (m/s) and deviation (rad at sine and cosine). While several
    beginnings are possible they are those of the likeliest, and heading_std covers all; before anything was measured an
    unknown heading is NaN.
    """

    def __init__(
        self,
        tuning: HeadingTuning = PRODUCT,
        compass: CompassModel = TCM2,
        yaw: HeadingModel = PHYSICAL_YAW,
        heading: float | None = 0.0,
    ) -> None:
        self._model = composite_model(compass, yaw, tuning.vehicle_std**2)
        self._model[COMPASS_NOISE], self._model[READING_NOISE] = tuning.compass_std_deg**2, tuning.reading_std_deg**2
        pairs = tuning.pairs()
        self._walks = pairs[:, 1] ** 2
        self._velocity_variance = tuning.velocity_std**2
        std = tuning.vehicle_start_std
        if heading is None:
            count = round(FARTHEST / APART)
            headings = [APART * k for k in range(-count, count + 1)]
            std = 0.5 * math.degrees(APART) / self._model[OUTPUT_1]
        elif abs(heading) <= LARGEST_READING:
            headings = [heading]
        else:
            raise InputError(f"heading.heading is {heading:g} rad, expected None or at most {LARGEST_READING:g} rad")
        noise = tuning.compass_std_deg**2
        start = [std**2, tuning.vehicle_start_std**2, noise, noise]
        self._covariance_at_first = np.diag([*start, *pairs[:, 0] ** 2])
        self._beginnings = [self._begin(each, tuning.speed) for each in headings]
        self._best = self._beginnings[0]
        self._is_known = heading is not None
        self._work = np.empty((2, STATES))
        self._ticks = Ticks()

    def _begin(self, heading: float, speed: float) -> _Beginning:
        state = np.zeros(STATES)
        state[0] = math.degrees(heading) / self._model[OUTPUT_1]
        # The compass at rest on the heading, wherever its scale is 1.
        model = self._model
        gain = model[B] / (1.0 - model[A1] - model[SHIFT] * model[A2])
        state[2] = gain * math.degrees(heading)
        state[3] = model[SHIFT] * state[2]
        state[SCALE], state[WATER_SPEED] = 1.0, speed
        p = self._covariance_at_first.copy()
        # Its states are as uncertain as what they settle on: heading, scale and deviation.
        slope = np.zeros(STATES)
        slope[0], slope[SCALE] = gain * model[OUTPUT_1], gain * math.degrees(heading)
        slope[SINE], slope[COSINE] = gain * math.sin(heading), gain * math.cos(heading)
        spread = p @ slope
        variance = float(slope @ spread)
        for place, share in ((2, 1.0), (3, float(model[SHIFT]))):
            p[place] += share * spread
            p[:, place] += share * spread
        p[2, 2] += variance
        p[3, 3] += model[SHIFT] ** 2 * variance
        p[2, 3] = p[3, 2] = model[SHIFT] * variance
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
        """The speed through the water is `factor` times what it was, with 1σ `std` (m/s) beside."""
        for each in self._beginnings:
            x, p = each.state, each.covariance
            x[WATER_SPEED] *= factor
            p[WATER_SPEED] *= factor
            p[:, WATER_SPEED] *= factor
            p[WATER_SPEED, WATER_SPEED] += std * std

    def turned(self, std: float) -> None:
        """The boat has turned by more or less than its model says, 1σ in rad."""
        for each in self._beginnings:
            each.covariance[0, 0] += (math.degrees(std) / self._model[OUTPUT_1]) ** 2

    def heading_for(self, course: float) -> float:
        """The heading (rad, in [−π, π)) that makes a course over ground good in the estimated current.

        Where the current across is stronger than the boat, straight against it.
        """
        north, east = self.current
        across = east * math.cos(course) - north * math.sin(course)
        share = across / max(self.water_speed, 1e-6)
        return float(wrap(course - math.asin(min(max(share, -1.0), 1.0))))

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

        slip: 1σ of what the velocity through the water differs by from one along the bow, m/s. `readings`, `times` and
        errors: see `readings.Ticks.parts`.
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
                each.score += take_readings(x, p, self._work, model, table)
                predict_vehicle(x, p, model, difference, self._walks * part)
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
        """Give up what is unlikely, and of two that have come together the less likely."""
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
    """GNSS velocity as two scalars, by the update of every aid. Returns the logarithm of its likelihood."""
    likely = 0.0
    for axis in range(2):
        psi, speed = math.radians(heading_deg(x, model)), x[WATER_SPEED]
        ahead = math.cos(psi) if axis == 0 else math.sin(psi)
        turn = math.radians(speed * (-math.sin(psi) if axis == 0 else math.cos(psi)))
        pc, s = work[0], variance
        for j in range(STATES):
            pc[j] = turn * (model[OUTPUT_1] * p[0, j] + model[OUTPUT_2] * p[1, j])
            pc[j] += ahead * p[WATER_SPEED, j] + p[CURRENT_NORTH + axis, j]
        s += turn * (model[OUTPUT_1] * pc[0] + model[OUTPUT_2] * pc[1])
        s += ahead * pc[WATER_SPEED] + pc[CURRENT_NORTH + axis]
        measured = north if axis == 0 else east
        innovation = measured - speed * ahead - x[CURRENT_NORTH + axis]
        likely += score(innovation, s)
        take_scalar(x, p, pc, work[1], s, innovation)
        fill_lower(p)
    return likely


@kernel
def score(innovation: float, s: float) -> float:
    """Logarithm of the likelihood of an innovation of variance s; an outlier counts as one of six deviations."""
    return -0.5 * (math.log(s) + min(innovation * innovation / s, 36.0))


OUTPUT_2 = OUTPUT_1 + 1


@kernel
def predict_compass(x: Floats, p: Floats, row: Floats, model: Floats) -> None:
    """One tick: c1 ← a1 c1 + a2 c2 + b (scale ψ + deviation), c2 ← s c1. `row` is workspace (n,)."""
    psi_deg = heading_deg(x, model)
    psi = math.radians(psi_deg)
    sine, cosine, b, shift = math.sin(psi), math.cos(psi), model[B], model[SHIFT]
    slope = b * (x[SCALE] + math.radians(x[SINE] * cosine - x[COSINE] * sine))
    c1 = x[2]
    x[2] = model[A1] * c1 + model[A2] * x[3] + b * (x[SCALE] * psi_deg + x[SINE] * sine + x[COSINE] * cosine)
    x[3] = shift * c1
    g0, g1, g5, g6, g7 = slope * model[OUTPUT_1], slope * model[OUTPUT_2], b * psi_deg, b * sine, b * cosine
    for j in range(STATES):
        own = g0 * p[0, j] + g1 * p[1, j] + model[A1] * p[2, j] + model[A2] * p[3, j]
        row[j] = own + g5 * p[SCALE, j] + g6 * p[SINE, j] + g7 * p[COSINE, j]
    variance = g0 * row[0] + g1 * row[1] + model[A1] * row[2] + model[A2] * row[3]
    variance += g5 * row[SCALE] + g6 * row[SINE] + g7 * row[COSINE]
    late = shift * shift * p[2, 2] + model[COMPASS_NOISE]
    for j in range(STATES):
        if j != 2 and j != 3:
            p[3, j] = p[j, 3] = shift * p[2, j]
            p[2, j] = p[j, 2] = row[j]
    p[2, 3] = p[3, 2] = shift * row[2]
    p[2, 2], p[3, 3] = variance + model[COMPASS_NOISE], late


@kernel
def take_readings(x: Floats, p: Floats, work: Floats, model: Floats, readings: Floats) -> float:
    """The ticks of a table of readings, each reading modulo a turn. Returns the logarithm of their likelihood."""
    k, likely = model[K], 0.0
    for tick in range(readings.shape[1]):
        predict_compass(x, p, work[0], model)
        if readings[1, tick] > 0.0:
            innovation = readings[0, tick] - k * x[2]
            innovation -= 360.0 * round(innovation / 360.0)
            for j in range(STATES):
                work[0, j] = k * p[2, j]
            s = k * work[0, 2] + model[READING_NOISE] / readings[1, tick]
            likely += score(innovation, s)
            take_scalar(x, p, work[0], work[1], s, innovation)
            fill_lower(p)
    return likely


@kernel
def predict_vehicle(x: Floats, p: Floats, model: Floats, difference: float, walks: Floats) -> None:
    """One step of the vehicle with n_d + bias, and of the random walks, whose variances (7,) are those of the step."""
    for i in range(2):
        pole, push = model[POLE_1 + i], model[INPUT_1 + i]
        x[i] = pole * x[i] + push * (difference + x[BIAS])
        for j in range(STATES):
            p[i, j] = pole * p[i, j] + push * p[BIAS, j]
        for j in range(STATES):
            p[j, i] = pole * p[j, i] + push * p[j, BIAS]
        p[i, i] += model[VEHICLE_NOISE]
    for i in range(WALKS):
        p[BIAS + i, BIAS + i] += walks[i]
