"""Heading of a boat under way from a poor compass, the autopilot's orders and GNSS velocity: filters of this package
behind one interface. They suit any boat with a known response to its autopilot.

The boat is the model of P4 (2) with a response as in `control.HeadingResponse`; its input is the ordered share of the
autopilot's limit. The compass has no dynamics, and its readings are modulo a turn.
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
"""Kinds of heading filter. The first is `estimation.aboard.HeadingTracker`, which has no model of the boat."""
PLAIN_COMPASS = CompassModel(0.0, 0.0, 1.0, 1.0, 0.0)
"""A compass that reads the heading of its last tick."""
_VEHICLE_STD = math.radians(0.5)
"""Process noise of the heading, rad/√s: gusts and waves turn a boat by 4° in a minute."""
_BIAS = (0.1, 0.02)
"""1σ at the start and random walk (1/√s) of the input's bias, as shares of the limit. For comparison: `HeadingTuning`
starts with 20 of the Springer's 300 rpm, 0.07."""
_UNORDERED = 0.1
"""1σ of the change of speed in 1 s, as a share of the usual speed, while no speed is ordered. After 100 s the σ of the
change is the usual speed."""
_LEAST_SPEED = 0.1
"""Share of the usual speed below which the boat's speed is not proportional to the ordered speed. Thrust grows with the
square of the speed: here it is a hundredth of the usual thrust and less than the force of wind."""
_SLIP, _SLIP_TIME = 0.2, 3.0
"""Sideslip in the sharpest turn, rad (11°), and the time for which it lasts, s."""
_MISJUDGED = 0.5
"""1σ of the error of an ordered change of speed, as a share of the change: the boat's speed table may err by half."""
_MISTURNED, _MISTURNED_TIME = 0.5, 1.0
"""1σ of the error of the modelled yaw rate, as a share of this rate, and the time for which the error lasts, s. Drag
grows with the square of the rate and halves the rate of a sharp turn; a compass shows this within a second."""
_HARMONICS = 0.1
"""Random walk (°/√s) of the sine and cosine terms of the compass's deviation. It covers the higher harmonics, which
change with the heading. Chosen among 0.02 to 0.2 by the share of errors within 2σ in six runs."""
_SURE = math.radians(20.0)
"""1σ of the heading above which it counts as unknown; two σ are 40°."""


def model_of(poles: tuple[float, float], gains: tuple[float, float], sample: float, limit: float) -> HeadingModel:
    """The model of a response to an input that is a share of `limit`, for steps of 1 s. Raises InputError for a sample
    or limit that is not above 0."""
    positive("heading.limit", limit)
    per_second = 1.0 / positive("heading.sample", sample)
    kept = [pole**per_second for pole in poles]
    # The effect of an input that is held for a second, relative to its effect in a sample.
    entered = [per_second if p == 1.0 else (k - 1.0) / (p - 1.0) for p, k in zip(poles, kept, strict=True)]
    inputs = [g * e * limit * RPM for g, e in zip(gains, entered, strict=True)]
    return HeadingModel((kept[0], kept[1]), (inputs[0], inputs[1]), (1.0, 1.0))


class HeadingAboard:
    """Heading and yaw rate at every step of a loop.

    kind: "aided" (compass, orders, GNSS velocity), "composite" (compass, orders) or "interval" (compass, orders; bounds
    over all deviations within two `deviation_std`, and the heading at `weight` between them, P4 (19)). yaw: see
    `model_of`. limit: the largest output of the autopilot; slew: the largest change of this output in a second. speed:
    the usual speed through the water, m/s; speed_time: the time constant with which the boat follows an ordered speed,
    s, infinite if none is ordered. compass_std: 1σ of a reading's noise; deviation_std: 1σ of the sine and cosine terms
    of the deviation, rad. Raises InputError for a kind or a number that is not possible.
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
        self._settled = yaw.inputs[0] * yaw.outputs[0] / RPM  # steady yaw rate at the limit
        reading = math.degrees(positive("estimator.heading.compass_std", compass_std))
        deviation = math.degrees(not_negative("estimator.heading.deviation_std", deviation_std))
        self._aided: AidedHeadingFilter | None = None
        self._deviation = 0.0  # 1σ of the deviation that the filter's own σ leaves out, rad
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
        self._given = self._ordered = self._turning = 0.0  # shares of the limit; the last one lags like the yaw rate
        self._pole = max(min(yaw.poles), 0.0)  # of 1 s
        self._cruise, self._speed, self._ordered_speed = speed, at_first, at_first

    def order(self, yaw: float, speed: float = math.nan) -> None:
        """Set the autopilot's output (in its unit) and the ordered speed (m/s), in force until the next order."""
        self._ordered, self._ordered_speed = yaw / self._limit, speed

    def step(
        self, heading: float, dt: float, velocity: tuple[float, float] = (math.nan, math.nan)
    ) -> tuple[float, float]:
        """Advance by dt s. Returns (heading in [−π, π), yaw rate) now, rad and rad/s, NaN while unknown.

        heading: the compass reading now; velocity: north and east by GNSS, m/s; NaN for none.
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
        """1σ (m/s) of the sway in a turn; larger for velocities within `_SLIP_TIME`: their errors are correlated."""
        self._since += dt
        if math.isnan(velocity):
            return 0.0
        known = 0.0 if math.isnan(self.yaw_rate) else self.yaw_rate / self._settled
        turning = min(1.0, max(abs(known), abs(self._given)))
        slip = _SLIP * self._cruise * turning * math.sqrt(max(_SLIP_TIME / self._since, 1.0))
        self._since = 0.0
        return slip

    def _follow(self, known: AidedHeadingFilter, dt: float) -> None:
        """Scale the speed through the water with the ordered speed; let it wander while no speed is ordered."""
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
        """1σ of the heading, rad; NaN while the heading is unknown."""
        return math.nan if math.isnan(self.heading) else math.hypot(self._filter.heading_std, self._deviation)

    @property
    def yaw_bias(self) -> float:
        """The yaw rate at which the boat settles without an order, rad/s; 0 for a filter that does not estimate it."""
        return 0.0 if self._aided is None else self._aided.bias * self._settled

    @property
    def water_speed(self) -> float:
        """Speed through the water, m/s; NaN while the heading is unknown, and for a filter without GNSS."""
        return math.nan if self._aided is None or math.isnan(self.heading) else self._aided.water_speed

    @property
    def current(self) -> tuple[float, float]:
        """Current north and east, m/s; NaN when `water_speed` is."""
        known = None if math.isnan(self.heading) else self._aided
        return (math.nan, math.nan) if known is None else known.current
