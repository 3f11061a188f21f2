"""Estimators aboard: by an inferred profile, and with further filters of heading and speed."""

import math

from steerway.core.earth import displaced, displacement
from steerway.core.estimate import Estimate, Estimator, Measurements
from steerway.estimation.course.onboard import HeadingTracker
from steerway.estimation.heading.aboard import HeadingAboard
from steerway.estimation.inference.stream import InferredFilter
from steerway.estimation.speed.fusion import SurgeFusion


class InferredEstimator:
    """A filter by an inferred profile for motion over ground, the heading tracker for heading and yaw rate.

    The filter takes latitude and longitude: north and east are laid out on the equator, where a plane errs least.
    """

    def __init__(self, filter: InferredFilter, tracker: HeadingTracker | None = None) -> None:
        self.filter, self.tracker = filter, tracker or HeadingTracker()

    def step(self, measurements: Measurements, dt: float) -> Estimate:
        """See Estimator."""
        north, east, sog, cog, _, heading, yaw_rate, water_speed, *_ = measurements
        place = displaced(0.0, 0.0, north, east)
        values, _, _ = self.filter.row(dt, *place, (sog, cog, heading, water_speed, yaw_rate))
        position = displacement(0.0, 0.0, *values[:2])
        return Estimate(*position, *values[2:], *self.tracker.step(heading, yaw_rate, dt))


class ComposedEstimator:
    """An estimator whose heading, speed or both come from further filters.

    ground: gives the rest. heading: takes compass, orders and GNSS velocity; a gyro, where there is one, gives the yaw
    rate. speed: takes accelerometer, receiver's speed and logs; its speed along the hull stands for the speed over
    ground.
    """

    def __init__(
        self, ground: Estimator, heading: HeadingAboard | None = None, speed: SurgeFusion | None = None
    ) -> None:
        self.ground, self.heading, self.speed = ground, heading, speed

    def order(self, yaw: float, speed: float = math.nan) -> None:
        """The autopilot's output, and the speed (m/s) that it would settle at, in force until the next order."""
        if self.heading is not None:
            self.heading.order(yaw, speed)

    def step(self, measurements: Measurements, dt: float) -> Estimate:
        """See Estimator."""
        estimate = self.ground.step(measurements, dt)
        if self.heading is not None:
            sog, cog = measurements.sog, measurements.cog
            velocity = (sog * math.cos(cog), sog * math.sin(cog))
            heading, yaw_rate = self.heading.step(measurements.heading, dt, velocity)
            if math.isfinite(measurements.yaw_rate):
                yaw_rate = measurements.yaw_rate
            north, east = self.heading.current
            estimate = estimate._replace(
                heading=heading,
                yaw_rate=yaw_rate,
                heading_std=self.heading.heading_std,
                water_speed=self.heading.water_speed,
                current_north=north,
                current_east=east,
            )
        if self.speed is not None:
            speed = self.speed.step(
                measurements.acceleration,
                dt,
                measurements.sog,
                measurements.bottom_speed,
                measurements.water_speed,
            )
            estimate = estimate._replace(sog=abs(speed), sog_std=self.speed.speed_std)
        return estimate
