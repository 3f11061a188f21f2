"""The steering filter as an estimator of the loop."""

import math

from steerway.core.checks import not_negative, positive
from steerway.core.estimate import Estimate, Measurements
from steerway.core.slow_error import USUAL_STD
from steerway.estimation.steering.filter import SteeringFilter


class SteeringEstimator:
    """The steering filter as an `Estimator`. Call `order` after each step.

    gain: steady yaw rate (rad/s) for one unit of the autopilot's output. slow_std: 1σ (m) of the receiver's slow error,
    see `core.slow_error`.
    """

    def __init__(self, filter: SteeringFilter, gain: float = 1.0, slow_std: float = USUAL_STD):
        self.filter = filter
        self._slow_std = not_negative("slow_std", slow_std)
        self._gain = positive("steering_estimator.gain", gain)
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
        estimate = self.filter.at(self._now)
        return estimate._replace(position_std=math.hypot(estimate.position_relative_std, self._slow_std))

    def order(self, yaw: float, speed: float) -> None:
        """Set the applied output of the autopilot, and the ordered speed through the water (m/s, or NaN)."""
        self.filter.order(self._now, self._gain * yaw, speed)
