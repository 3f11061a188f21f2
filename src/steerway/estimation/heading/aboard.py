"""Heading of a boat under way from a poor compass, what was ordered, and GNSS velocity: filters of this package behind
one interface, for any boat whose response to its autopilot is known.

The boat is the model of P4 (2) with a response as that of `control.HeadingResponse`; its input is the ordered part of
the autopilot's limit. The compass is one without dynamics, whose readings are modulo a turn.
"""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.checks import not_negative, one_of, positive
from steerway.estimation.heading.aided import AidedHeadingFilter, HeadingTuning
from steerway.estimation.heading.composite import COMPASS_NOISE, READING_NOISE, CompositeFilter, composite_model
from steerway.sensors.tcm2 import CompassModel
from steerway.vessels.springer import RPM, HeadingModel

KINDS = ("tracker", "aided", "composite")
"""The first is `estimation.course.onboard.HeadingTracker`, which knows nothing of the boat."""
PLAIN_COMPASS = CompassModel(0.0, 0.0, 1.0, 1.0, 0.0)
"""A compass that reads the heading of its last tick."""
_VEHICLE_STD = math.radians(0.5)
"""What the model leaves of a heading, rad a root second."""
_BIAS = (0.1, 0.02)
"""1σ at first and walk of the input's bias, parts of the limit."""
_SURE = math.radians(20.0)
"""1σ of the heading above which it counts as unknown."""


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

    kind: "aided" (compass, orders, GNSS velocity) or "composite" (compass and orders). yaw: see `model_of`; limit: of
    the autopilot's output, in its unit. speed: through the water, m/s. compass_std: of one reading's noise,
    deviation_std: of sine and cosine of its deviation, rad. Raises InputError for what cannot be used.
    """

    def __init__(
        self,
        kind: str,
        yaw: HeadingModel,
        limit: float,
        speed: float,
        compass_std: float = math.radians(1.0),
        deviation_std: float = math.radians(4.0),
    ) -> None:
        one_of("estimator.heading.kind", kind, KINDS[1:])
        self._limit = positive("heading.limit", limit)
        reading = math.degrees(positive("estimator.heading.compass_std", compass_std))
        deviation = math.degrees(not_negative("estimator.heading.deviation_std", deviation_std))
        self._aided: AidedHeadingFilter | None = None
        self._composite: CompositeFilter | None = None
        if kind == "aided":
            tuning = HeadingTuning(
                vehicle_std=_VEHICLE_STD,
                vehicle_start_std=0.01,
                bias=_BIAS,
                scale=(0.0, 0.0),
                deviation=(deviation, 0.02),
                speed=speed,
                water_speed=(0.1 * speed, 1e-3),
                compass_std_deg=0.01,
                reading_std_deg=reading,
            )
            self._aided = AidedHeadingFilter(tuning, PLAIN_COMPASS, yaw, heading=None)
        else:
            model = composite_model(PLAIN_COMPASS, yaw, _VEHICLE_STD**2)
            model[COMPASS_NOISE], model[READING_NOISE] = 1e-4, reading**2 + deviation**2
            self._composite = CompositeFilter(model, vehicle_variance=math.pi**2)
        self.heading = self.yaw_rate = math.nan
        self._ordered = 0.0

    def order(self, yaw: float) -> None:
        """The autopilot's output in force until the next order, in its unit."""
        self._ordered = yaw / self._limit

    def step(
        self, heading: float, dt: float, velocity: tuple[float, float] = (math.nan, math.nan)
    ) -> tuple[float, float]:
        """(heading in [−π, π), yaw rate) now, dt s after the step before: rad and rad/s, NaN while unknown.

        heading: the compass's reading of now; velocity: north and east by GNSS, m/s; NaN for none.
        """
        if dt <= 0.0:
            return self.heading, self.yaw_rate
        readings = None if math.isnan(heading) else np.array([heading])
        if self._aided is not None:
            now = self._aided.step(self._ordered, readings, velocity, dt)
            std, rate = self._aided.heading_std, self._aided.yaw_rate(self._ordered)
        else:
            assert self._composite is not None
            before = self._composite.heading
            if readings is not None:
                readings[0] = before + wrap(heading - before)  # this filter's readings count the turns
            now = self._composite.step(self._ordered, readings, dt)
            std, rate = self._composite.heading_std, self._composite.yaw_rate(self._ordered)
        known = std < _SURE and math.isfinite(now)
        self.heading, self.yaw_rate = (wrap(now), rate) if known else (math.nan, math.nan)
        return self.heading, self.yaw_rate

    @property
    def heading_std(self) -> float:
        """rad; NaN while the heading is unknown."""
        known = self._aided or self._composite
        return math.nan if known is None or math.isnan(self.heading) else known.heading_std

    @property
    def water_speed(self) -> float:
        """m/s; NaN for the filter without GNSS."""
        return math.nan if self._aided is None else self._aided.water_speed

    @property
    def current(self) -> tuple[float, float]:
        """North and east, m/s; NaN for the filter without GNSS."""
        return (math.nan, math.nan) if self._aided is None else self._aided.current
