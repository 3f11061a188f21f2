"""The steering filter as an estimator of the loop."""

import math

from steerway.core.checks import positive
from steerway.core.estimate import Estimate, Measurements
from steerway.estimation.steering.filter import SteeringFilter


class SteeringEstimator:
    """Measurements in, estimate out; `order` after each step tells what was ordered.

    gain: yaw rate (rad/s) that the boat settles at for a unit of the autopilot's output. follows_orders False: as if
    someone else steered.
    """

    def __init__(self, filter: SteeringFilter, gain: float = 1.0, follows_orders: bool = True):
        self.filter = filter
        self._gain = positive("steering_estimator.gain", gain)
        self.follows_orders = follows_orders
        self._now = 0.0
        self._heading = self._yaw_rate = math.nan

    def step(self, measurements: Measurements, dt: float) -> Estimate:
        """See Estimator."""
        north, east, sog, cog, _, heading, yaw_rate, *_, age = measurements
        self._now += dt
        if not math.isnan(heading):
            self._heading = heading
        if not math.isnan(yaw_rate):
            self._yaw_rate = yaw_rate
        if not math.isnan(north):
            velocity = sog * math.cos(cog), sog * math.sin(cog)
            self.filter.fix(self._now - age, north, east, *velocity, self._heading, self._yaw_rate)
            self._heading = self._yaw_rate = math.nan
        return self.filter.at(self._now)

    def order(self, yaw: float, speed: float) -> None:
        """What the actuators made of the autopilot's output, and the ordered speed through the water (m/s, or NaN)."""
        if self.follows_orders:
            self.filter.order(self._now, self._gain * yaw, speed)
