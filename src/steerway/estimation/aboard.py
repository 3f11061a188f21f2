"""The estimator aboard put together: course and speed over ground, with heading and speed by filters of their own."""

import math

from steerway.core.estimate import Estimate, Estimator, Measurements
from steerway.estimation.heading.aboard import HeadingAboard
from steerway.estimation.speed.fusion import SurgeFusion


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
