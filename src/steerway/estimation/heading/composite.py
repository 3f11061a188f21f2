"""Heading from propellers and compass: a Kalman filter on [vehicle; compass], P4 §3.1 completed.

The input of the paper's compass model is the heading, which is unknown. Here the vehicle model, driven by the propeller
difference, predicts the heading, and the compass corrects it at 40 Hz: x = [v1 v2 c1 c2], heading = C v.

`model` is a vector of `Parameters`; compass states and readings are in degrees as in the paper, the
rest is SI. Readings reach the kernels as the (2, ticks) tables of `readings`.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats
from steerway.core.compiled import kernel, lean_kernel
from steerway.core.errors import InputError
from steerway.core.kalman import take_scalar
from steerway.core.linear_algebra import fill_lower
from steerway.core.shaping import shaped
from steerway.core.statistics import AID_GATE
from steerway.estimation.heading.models import (
    PAPER_YAW,
    READING_VARIANCE_DEG2,
    STATE_VARIANCE,
    TCM2,
    CompassModel,
    HeadingModel,
    held,
)
from steerway.estimation.heading.readings import Ticks, checked_difference

__all__ = ["AT", "START_VARIANCE", "WAVES", "CompositeFilter", "composite_model"]


class Parameters(NamedTuple):
    """The entries of `model`, in order."""

    pole: int  # the first of two, as input and output
    pole_2: int
    input: int  # rad per rad/s
    input_2: int
    output: int  # to degrees
    output_2: int
    a1: int
    a2: int
    b: int
    k: int
    shift: int
    vehicle_noise: int  # variance a second
    compass_noise: int  # variance a tick
    reading_noise: int  # variance of a reading, deg²


PARAMETERS = len(Parameters._fields)
AT = Parameters(*range(PARAMETERS))
"""Indices of a model's entries."""
BASIC = 4
"""Number of states of vehicle and compass; the states of `aided` follow."""
BIAS, SCALE, SINE, COSINE, CURRENT_NORTH, CURRENT_EAST, WATER_SPEED = range(BASIC, 11)
NO_WALKS = np.empty(0)
FARTHEST_OUTLIER = 36.0
"""NIS above which all outliers are equally likely: six σ."""
WAVES = 1e-14
"""Variance that waves add to each vehicle state a second, P4 §6."""
START_VARIANCE = 1e-12
"""Start variance of each vehicle state (0.002° of heading), not stated in P4; missions then agree with P4's Table 1."""


def composite_model(
    compass: CompassModel = TCM2,
    yaw: HeadingModel = PAPER_YAW,
    vehicle_noise: float = WAVES,
    reading_variance: float = READING_VARIANCE_DEG2,
    compass_noise: float = STATE_VARIANCE,
) -> Floats:
    """The (14,) parameters of a filter for this compass and this vehicle, whose steps are 1 s long.

    vehicle_noise: variance added to each state of yaw in a second; compass_noise: variance (deg²) added to each state
    of the compass in a tick; reading_variance: of one reading, deg².
    """
    _, inputs, outputs = yaw.matrices()
    noise = (vehicle_noise, compass_noise, reading_variance)
    return np.array([*yaw.poles, *inputs, *np.degrees(outputs), *compass, *noise])


def checked_model(model: ArrayLike) -> Floats:
    """A copy of (14,) parameters as an array; raises InputError for another shape or numbers that are not finite."""
    array = np.array(model, dtype=np.float64)
    if array.shape != (PARAMETERS,) or not np.isfinite(array).all():
        raise InputError(f"heading.model has shape {array.shape}, expected ({PARAMETERS},) known numbers")
    return array


def stepped(model: Floats, step: float) -> Floats:
    """The parameters of vehicle steps of `step` s: the same poles, exact for a held input; noise grows with time."""
    if step == 1.0:
        return model
    model = model.copy()
    for i in range(2):
        left, entered = held(model[AT.pole + i], step)
        model[AT.pole + i] = left
        model[AT.input + i] *= entered
    model[AT.vehicle_noise] *= step
    return model


def start_covariance(vehicle_variance: float = START_VARIANCE) -> Floats:
    """(4, 4) covariance at the start: that of the vehicle is given, that of the compass is one tick's noise."""
    return np.diag([vehicle_variance, vehicle_variance, STATE_VARIANCE, STATE_VARIANCE])


class FilterBank:
    """Kalman filters of one heading side by side, weighted by likelihood: base of the filters on composite models.

    `innovation` (deg) and `nis` are means over the last filter's readings in the last step, NaN without any.
    """

    def __init__(self, models: Floats, states: Floats, covariances: Floats) -> None:
        self._models, self._states, self._covariances = models, states, covariances  # (m, 14), (m, n), (m, n, n)
        self._scores = np.zeros(len(models))  # log likelihoods
        self._ticks = Ticks()
        self.innovation = self.nis = math.nan

    @property
    def weights(self) -> Floats:
        """(m,) probabilities, given that one of the filters is right."""
        scores, best = self._scores, self._scores.max()
        if not math.isfinite(best):  # a state beyond floating point
            scores = np.where(np.isfinite(scores), scores, -np.inf)
            best = scores.max()
            if best == -np.inf:
                return np.full(len(scores), 1.0 / len(scores))
        likely = np.exp(scores - best)
        return likely / likely.sum()

    @property
    def heading(self) -> float:
        """Heading (rad) of the first filter, unwrapped."""
        return math.radians(self._degrees[0])

    @property
    def heading_std(self) -> float:
        """1σ of the heading, rad: from the filters' own variances and their distance from the first one's heading."""
        apart = self._degrees - self._degrees[0]
        return self._spread(apart - 360.0 * np.rint(apart / 360.0))

    @property
    def _degrees(self) -> Floats:
        """(m,) headings, deg."""
        outputs = self._models[:, AT.output : AT.output_2 + 1]
        return np.asarray(outputs[:, 0] * self._states[:, 0] + outputs[:, 1] * self._states[:, 1])

    def _spread(self, apart: Floats) -> float:
        """1σ (rad) of the mixture, for filters this far (m,), deg, from the estimate."""
        own = [heading_variance_deg2(p, model) for p, model in zip(self._covariances, self._models, strict=True)]
        return math.radians(math.sqrt(self.weights @ (own + apart * apart)))

    def turned(self, std: float) -> None:
        """Increase the uncertainty of the heading by a turn that the model does not predict, 1σ `std` (rad)."""
        self._covariances[:, 0, 0] += (math.degrees(std) / self._models[:, AT.output]) ** 2

    def yaw_rate(self, difference: float) -> float:
        """Yaw rate of the first filter's model with n_d (rad/s) in force, rad/s."""
        return math.radians(yaw_rate_deg(self._states[0], self._models[0], difference))

    def _advance(self, difference: float, parts: Iterable[tuple[float, Floats]], walks: Floats = NO_WALKS) -> None:
        """Take tables of readings (see `readings.Ticks.parts`) and advance by n_d (rad/s).

        walks: (7,) variances that the further states of `aided` gain in a second.
        """
        total = squares = taken = 0.0
        for part, table in parts:
            models = self._models if part == 1.0 else np.array([stepped(each, part) for each in self._models])
            sums = advance_all(self._states, self._covariances, models, walks * part, self._scores, difference, table)
            total, squares, taken = total + sums.innovation, squares + sums.square, taken + sums.number
        self.innovation, self.nis = (total / taken, squares / taken) if taken else (math.nan, math.nan)


class CompositeFilter(FilterBank):
    """A Kalman filter of heading for one compass.

    `heading` (rad, unwrapped) is the estimate at the end of the last step. Raises InputError for a model of another
    shape.
    """

    def __init__(self, model: ArrayLike, vehicle_variance: float = START_VARIANCE) -> None:
        super().__init__(checked_model(model)[None], np.zeros((1, 4)), start_covariance(vehicle_variance)[None])

    def step(
        self, difference: float, readings: ArrayLike | None = None, dt: float = 1.0, times: ArrayLike | None = None
    ) -> float:
        """Take the readings of the next dt s (rad, any number) and advance by n_d (rad/s); returns the heading (rad).

        `readings`, `times` and errors: see `readings.Ticks.parts`.
        """
        difference = checked_difference(difference)
        self._advance(difference, self._ticks.parts(dt, readings, times))
        return self.heading


@kernel
def heading_deg(x: Floats, model: Floats) -> float:
    """Heading (deg) of a state (4,): C v of P4 (2)."""
    return model[AT.output] * x[0] + model[AT.output + 1] * x[1]


@kernel
def yaw_rate_deg(x: Floats, model: Floats, difference: float) -> float:
    """C ((A − I) v + B n_d), the change of heading in a step of 1 s, deg/s."""
    rate = 0.0
    for i in range(2):
        change = (model[AT.pole + i] - 1.0) * x[i] + model[AT.input + i] * difference
        rate += model[AT.output + i] * change
    return rate


@kernel
def heading_variance_deg2(p: Floats, model: Floats) -> float:
    """C P Cᵀ."""
    return (
        model[AT.output] ** 2 * p[0, 0]
        + model[AT.output + 1] ** 2 * p[1, 1]
        + 2 * model[AT.output] * model[AT.output + 1] * p[0, 1]
    )


@lean_kernel
def predict_compass(x: Floats, p: Floats, row: Floats, model: Floats) -> None:
    """One tick of the compass, P4 (5): c1 ← a1 c1 + a2 c2 + b ψ, c2 ← s c1; scale · ψ + deviation in place of ψ where
    those are states. `row` is workspace (n,)."""
    n, a1, a2, b, shift = len(x), model[AT.a1], model[AT.a2], model[AT.b], model[AT.shift]
    psi_deg = heading_deg(x, model)
    seen, slope, sine, cosine = psi_deg, b, 0.0, 0.0
    if n > BASIC:
        psi = math.radians(psi_deg)
        sine, cosine = math.sin(psi), math.cos(psi)
        seen = x[SCALE] * psi_deg + x[SINE] * sine + x[COSINE] * cosine
        slope = b * (x[SCALE] + math.radians(x[SINE] * cosine - x[COSINE] * sine))
    c1 = x[2]
    x[2] = a1 * c1 + a2 * x[3] + b * seen
    x[3] = shift * c1
    g0, g1 = slope * model[AT.output], slope * model[AT.output + 1]
    for j in range(n):
        row[j] = g0 * p[0, j] + g1 * p[1, j] + a1 * p[2, j] + a2 * p[3, j]
        if n > BASIC:
            row[j] += b * (psi_deg * p[SCALE, j] + sine * p[SINE, j] + cosine * p[COSINE, j])
    variance = g0 * row[0] + g1 * row[1] + a1 * row[2] + a2 * row[3]
    if n > BASIC:
        variance += b * (psi_deg * row[SCALE] + sine * row[SINE] + cosine * row[COSINE])
    late = shift * shift * p[2, 2] + model[AT.compass_noise]
    for j in range(n):
        if j != 2 and j != 3:
            p[3, j] = p[j, 3] = shift * p[2, j]
            p[2, j] = p[j, 2] = row[j]
    p[2, 3] = p[3, 2] = shift * row[2]
    p[2, 2], p[3, 3] = variance + model[AT.compass_noise], late


@lean_kernel
def observe(p: Floats, pc: Floats, model: Floats, number: float) -> float:
    """Variance of the innovation of the mean of `number` readings of one tick, P4 (6); pc (n,) receives its covariance
    with the state."""
    for j in range(len(pc)):
        pc[j] = model[AT.k] * p[2, j]
    return model[AT.k] * pc[2] + model[AT.reading_noise] / number


@lean_kernel
def predict_vehicle(x: Floats, p: Floats, model: Floats, difference: float) -> None:
    """One step of the vehicle, P4 (2), with n_d + bias where that is a state."""
    has_bias = len(x) > BASIC
    for i in range(2):
        pole, push = model[AT.pole + i], model[AT.input + i]
        x[i] = pole * x[i] + push * (difference + (x[BIAS] if has_bias else 0.0))
        for j in range(len(x)):
            p[i, j] = pole * p[i, j] + (push * p[BIAS, j] if has_bias else 0.0)
        for j in range(len(x)):
            p[j, i] = pole * p[j, i] + (push * p[j, BIAS] if has_bias else 0.0)
        p[i, i] += model[AT.vehicle_noise]


class Sums(NamedTuple):
    """Sums over the ticks with readings."""

    innovation: float  # deg
    square: float  # NIS
    score: float  # log likelihood
    number: float


@kernel
def advance_all(
    states: Floats,
    covariances: Floats,
    models: Floats,
    walks: Floats,
    scores: Floats,
    difference: float,
    readings: Floats,
) -> Sums:
    """`advance` every filter, and add its log likelihood to `scores` (m,). Returns the sums of the last one."""
    sums, work = Sums(0.0, 0.0, 0.0, 0.0), np.empty((2, states.shape[1]))
    for k in range(len(models)):
        if states.shape[1] == BASIC:  # loops of constant length take less than half the time
            x, p, row = shaped(states[k], (BASIC,)), shaped(covariances[k], (BASIC, BASIC)), shaped(work, (2, BASIC))
            sums = advance(x, p, row, models[k], walks, difference, readings)
        else:
            sums = advance(states[k], covariances[k], work, models[k], walks, difference, readings)
        scores[k] += sums.score
    return sums


@lean_kernel
def advance(
    x: Floats, p: Floats, work: Floats, model: Floats, walks: Floats, difference: float, readings: Floats
) -> Sums:
    """Take the ticks of a table of readings; then predict the vehicle and the random walks of further states.

    With further states a reading is modulo a turn and may be an outlier, which `AID_GATE` refuses. work: (2, n).
    """
    is_aided = len(x) > BASIC
    total = squares = likely = taken = 0.0
    for k in range(readings.shape[1]):
        predict_compass(x, p, work[0], model)
        if readings[1, k] > 0.0:
            s = observe(p, work[0], model, readings[1, k])
            innovation = readings[0, k] - model[AT.k] * x[2]
            if is_aided:
                innovation -= 360.0 * round(innovation / 360.0)
            take_scalar(x, p, work[0], work[1], s, innovation, AID_GATE if is_aided else math.inf)
            fill_lower(p)
            total += innovation
            squares += innovation * innovation / s
            likely += score(innovation, s, FARTHEST_OUTLIER if is_aided else math.inf)
            taken += 1.0
    predict_vehicle(x, p, model, difference)
    for i in range(len(walks)):
        p[BIAS + i, BIAS + i] += walks[i]
    return Sums(total, squares, likely, taken)


@kernel
def score(innovation: float, s: float, most: float) -> float:
    """Log likelihood of an innovation of variance s, whose NIS counts as `most` if it is larger."""
    return -0.5 * (math.log(s) + min(innovation * innovation / s, most))
