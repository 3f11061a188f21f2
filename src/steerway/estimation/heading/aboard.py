"""Heading of a boat under way from a poor compass, what was ordered, and GNSS velocity: filters of this package behind
one interface, for any boat whose response to its autopilot is known.

The boat is the model of P4 (2) with a response as that of `control.HeadingResponse`; its input is the ordered part of
the autopilot's limit. The compass is one without dynamics, whose readings are modulo a turn.
"""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.checks import not_negative, one_of, positive, positive_or_unlimited
from steerway.estimation.heading.aided import AidedHeadingFilter, HeadingTuning
from steerway.estimation.heading.composite import CompositeFilter, composite_model
from steerway.estimation.heading.interval.deviation import DeviationBounds
from steerway.estimation.heading.interval.weighting import weighted
from steerway.estimation.heading.models import RPM, CompassModel, HeadingModel

KINDS = ("tracker", "aided", "composite", "interval")
"""The first is `estimation.aboard.HeadingTracker`, which knows nothing of the boat."""
PLAIN_COMPASS = CompassModel(0.0, 0.0, 1.0, 1.0, 0.0)
"""A compass that reads the heading of its last tick."""
_VEHICLE_STD = math.radians(0.5)
"""Process noise of the heading, rad/√s. Chosen: gusts and waves turn a boat by 4° in a minute."""
_BIAS = (0.1, 0.02)
"""1σ at first and random walk (1/√s) of the input's bias, as shares of the limit. Chosen: `HeadingTuning` begins with
20 rpm of the Springer's 300, 0.07."""
_UNORDERED = 0.1
"""1σ of the change of speed in 1 s, as a share of the usual speed, while no speed is ordered. Chosen: after 100 s the
change has a σ of the whole usual speed."""
_LEAST_SPEED = 0.1
"""Part of the usual speed below which the boat's is not in proportion to the ordered one. Chosen: its thrust, as its
drag with the square of speed, is a hundredth of the usual there, less than wind's."""
_SLIP, _SLIP_TIME = 0.2, 3.0
"""Sideslip in the sharpest turn, rad, and s for which it lasts. Chosen: 11°."""
_MISJUDGED = 0.5
"""Part of an ordered change of speed that the boat makes more or less, 1σ. Chosen: its speed table may be off by
half."""
_MISTURNED, _MISTURNED_TIME = 0.5, 1.0
"""Part of the yaw rate that the model makes of orders, by which the boat's differs, 1σ, and s for which it does so.
Chosen: drag that grows with the square of the rate halves a sharp turn, and a compass shows it within a second."""
_HARMONICS = 0.1
"""Random walk of sine and cosine of the compass's deviation, °/√s: what it has beside them changes with the
heading. Chosen among 0.02 to 0.2 on six runs, by the share within 2σ."""
_SURE = math.radians(20.0)
"""1σ of the heading above which it counts as unknown. Chosen: two of them are 40°."""


def model_of(poles: tuple[float, float], gains: tuple[float, float], sample: float, limit: float) -> HeadingModel:
    """The model of a response whose input is a part of `limit`, for steps of 1 s. Raises InputError for a sample or
    limit that is not above 0."""
    positive("heading.limit", limit)
    per_second = 1.0 / positive("heading.sample", sample)
    kept = [pole**per_second for pole in poles]
    # What an input held for a second does, in units of what it does in a sample.
    entered = [per_second if p == 1.0 else (k - 1.0) / (p - 1.0) for p, k in zip(poles, kept, strict=True)]
    inputs = [g * e * limit * RPM for g, e in zip(gains, entered, strict=True)]
    return HeadingModel((kept[0], kept[1]), (inputs[0], inputs[1]), (1.0, 1.0))


class HeadingAboard:
    """Heading and yaw rate at every step of a loop.

    kind: "aided" (compass, orders, GNSS velocity), "composite" (compass and orders) or "interval" (as that, with bounds
    over every deviation within two `deviation_std`, and the heading by `weight` between them, P4 (19)). yaw: see
    `model_of`; limit: of the autopilot's output, and slew: of its change a second, in its unit. speed: through the
    water, m/s; speed_time: in which it follows an ordered one, s, infinite where none is ordered. compass_std: of one
    reading's noise, deviation_std: of sine and cosine of its deviation, rad. Raises InputError for what cannot be used.
    """

    def __init__(
        self,
        kind: str,
        yaw: HeadingModel,
        limit: float,
        speed: float,
        compass_std: float = math.radians(1.0),
        deviation_std: float = math.radians(4.0),
        *,
        weight: float = 0.5,
        speed_time: float = math.inf,
        slew: float = math.inf,
    ) -> None:
        one_of("estimator.heading.kind", kind, KINDS[1:])
        self._limit, self._slew = positive("heading.limit", limit), positive_or_unlimited("heading.slew", slew) / limit
        self._weight, self._speed_time = weight, speed_time
        self._settled = yaw.inputs[0] * yaw.outputs[0] / RPM  # yaw rate of a boat that goes on turning at the limit
        reading = math.degrees(positive("estimator.heading.compass_std", compass_std))
        deviation = math.degrees(not_negative("estimator.heading.deviation_std", deviation_std))
        self._aided: AidedHeadingFilter | None = None
        self._deviation = 0.0  # 1σ of what of it the filter's own σ leaves out, rad
        self._filter: AidedHeadingFilter | CompositeFilter | DeviationBounds
        # A boat whose speed is controlled may begin at rest.
        at_first, known = (speed, 0.1) if speed_time == math.inf else (0.5 * speed, 0.5)
        if kind == "aided":
            tuning = HeadingTuning(
                vehicle_std=_VEHICLE_STD,
                vehicle_start_std=0.01,
                bias=_BIAS,
                scale=(0.0, 0.0),
                deviation=(deviation, _HARMONICS),
                speed=at_first,
                water_speed=(known * speed, 1e-3),
                compass_std_deg=0.01,
                reading_std_deg=reading,
            )
            self._filter = self._aided = AidedHeadingFilter(tuning, PLAIN_COMPASS, yaw, heading=None)
        elif kind == "composite":
            model = composite_model(PLAIN_COMPASS, yaw, _VEHICLE_STD**2, reading**2, 1e-4)
            self._deviation = math.radians(deviation)
            self._filter = CompositeFilter(model, vehicle_variance=math.pi**2)
        else:
            self._filter = DeviationBounds(yaw, 2.0 * deviation_std, compass_std, _VEHICLE_STD)
        self.heading = self.yaw_rate = math.nan
        self._since = 0.0  # s since the last velocity
        self._given = self._ordered = self._turning = 0.0  # parts of the limit; the last as the yaw rate follows
        self._pole = max(min(yaw.poles), 0.0)  # of 1 s
        self._cruise, self._speed, self._ordered_speed = speed, at_first, at_first

    def order(self, yaw: float, speed: float = math.nan) -> None:
        """The autopilot's output in force until the next order, in its unit, and the ordered speed (m/s)."""
        self._ordered, self._ordered_speed = yaw / self._limit, speed

    def step(
        self, heading: float, dt: float, velocity: tuple[float, float] = (math.nan, math.nan)
    ) -> tuple[float, float]:
        """(heading in [−π, π), yaw rate) now, dt s after the step before: rad and rad/s, NaN while unknown.

        heading: the compass's reading of now; velocity: north and east by GNSS, m/s; NaN for none.
        """
        if dt <= 0.0:
            return self.heading, self.yaw_rate
        known, most = self._filter, self._slew * dt
        self._given += max(-most, min(most, self._ordered - self._given))
        self._turning += (1.0 - self._pole**dt) * (self._given - self._turning)
        known.turned(_MISTURNED * abs(self._settled * self._turning) * math.sqrt(2.0 * _MISTURNED_TIME * dt))
        readings = None if math.isnan(heading) else np.array([heading])
        if isinstance(known, AidedHeadingFilter):
            self._follow(known, dt)
            now = known.step(self._given, readings, velocity, dt, slip=self._slip(velocity[0], dt))
        elif isinstance(known, CompositeFilter):
            if readings is not None:  # this filter's readings count the turns
                readings[0] = known.heading + wrap(heading - known.heading)
            now = known.step(self._given, readings, dt)
        else:
            now = weighted(*known.step(self._given, readings, dt), self._weight)
        is_known = known.heading_std < _SURE and math.isfinite(now)
        rate = known.yaw_rate(self._given)
        self.heading, self.yaw_rate = (wrap(now), rate) if is_known else (math.nan, math.nan)
        return self.heading, self.yaw_rate

    def _slip(self, velocity: float, dt: float) -> float:
        """1σ of the speed sideways in a turn, as noise of one velocity among those of its time; m/s."""
        self._since += dt
        if math.isnan(velocity):
            return 0.0
        known = 0.0 if math.isnan(self.yaw_rate) else self.yaw_rate / self._settled
        turning = min(1.0, max(abs(known), abs(self._given)))
        slip = _SLIP * self._cruise * turning * math.sqrt(max(_SLIP_TIME / self._since, 1.0))
        self._since = 0.0
        return slip

    def _follow(self, known: AidedHeadingFilter, dt: float) -> None:
        """The speed through the water changes as the ordered one lets expect, in proportion, or freely without one."""
        if math.isnan(self._ordered_speed):
            known.sped_up(1.0, _UNORDERED * self._cruise * math.sqrt(dt))
            self._speed = math.nan
            return
        before = self._ordered_speed if math.isnan(self._speed) else self._speed
        self._speed = before - math.expm1(-dt / self._speed_time) * (self._ordered_speed - before)
        least = _LEAST_SPEED * self._cruise
        factor = max(self._speed, least) / max(before, least)
        known.sped_up(factor, _MISJUDGED * abs(self._speed - before))

    @property
    def heading_std(self) -> float:
        """rad; NaN while the heading is unknown."""
        return math.nan if math.isnan(self.heading) else math.hypot(self._filter.heading_std, self._deviation)

    @property
    def yaw_bias(self) -> float:
        """The yaw rate at which the boat settles without an order, rad/s; 0 for a filter that does not estimate it."""
        return 0.0 if self._aided is None else self._aided.bias * self._settled

    @property
    def water_speed(self) -> float:
        """m/s; NaN while the heading is unknown, and for a filter without GNSS."""
        return math.nan if self._aided is None or math.isnan(self.heading) else self._aided.water_speed

    @property
    def current(self) -> tuple[float, float]:
        """North and east, m/s; NaN as `water_speed` is."""
        known = None if math.isnan(self.heading) else self._aided
        return (math.nan, math.nan) if known is None else known.current
