"""Estimators aboard: each step takes measurements and returns one estimate."""

import math
from collections.abc import Sequence

from steerway.core.angles import wrap
from steerway.core.checks import not_negative, positive
from steerway.core.estimate import NO_MEASUREMENTS, Estimate, Estimator, Measurements
from steerway.core.slow_error import USUAL_STD
from steerway.estimation.heading.aboard import HeadingAboard
from steerway.estimation.speed.fusion import SurgeFusion
from steerway.estimation.stream import FiveStateFilter


class HeadingTracker:
    """Heading and yaw rate, at and between measurements, from a compass and an optional gyro.

    A critically damped observer of a constant rate, `bandwidth` ω in rad/s: with measurements every T s, both its poles
    are e^{−ωT} (Brookner, Tracking and Kalman Filtering Made Easy, 1998, section 1.2.6). After `patience` s without a
    compass, heading and yaw rate are NaN.
    """

    def __init__(self, bandwidth: float = 2.0, patience: float = 2.0):
        self.bandwidth = positive("heading_tracker.bandwidth", bandwidth)
        self.patience = positive("heading_tracker.patience", patience)
        self.heading = math.nan
        self.yaw_rate = math.nan
        self._since_compass = 0.0

    def step(self, heading: float, yaw_rate: float, dt: float) -> tuple[float, float]:
        """(heading, yaw rate) now; measurements in rad and rad/s, NaN for none. Raises InputError for dt < 0."""
        gyro, dt = not math.isnan(yaw_rate), not_negative("dt", dt)
        if gyro:
            self.yaw_rate = yaw_rate
        if math.isnan(self.heading) and math.isnan(heading):
            return math.nan, self.yaw_rate
        self._since_compass += dt
        if math.isnan(self.heading):
            self._begin(heading)
        else:
            self.heading = wrap(self.heading + self.yaw_rate * dt)
        if not math.isnan(heading):
            self._correct(heading, gyro)
        elif self._since_compass > self.patience:
            self.heading = self.yaw_rate = math.nan
        return self.heading, self.yaw_rate

    def _begin(self, heading: float) -> None:
        self.heading = heading
        self._since_compass = 0.0
        if math.isnan(self.yaw_rate):
            self.yaw_rate = 0.0

    def _correct(self, heading: float, gyro: bool) -> None:
        error = wrap(heading - self.heading)
        left = math.exp(-self.bandwidth * self._since_compass)
        self.heading = wrap(self.heading + (1.0 - left * left) * error)
        if not gyro and self._since_compass > 0.0:
            self.yaw_rate += (1.0 - left) ** 2 / self._since_compass * error
        self._since_compass = 0.0


class FilterEstimator:
    """A `FiveStateFilter` for the motion over ground, and a `HeadingTracker` for heading and yaw rate.

    slow_std: 1σ (m) of the receiver's slow error, see `core.slow_error`.
    """

    def __init__(
        self,
        filter: FiveStateFilter | None = None,
        tracker: HeadingTracker | None = None,
        slow_std: float = USUAL_STD,
    ):
        self.filter = filter or FiveStateFilter()
        self.tracker = tracker or HeadingTracker()
        self._slow_std = not_negative("slow_std", slow_std)

    def step(self, measurements: Measurements, dt: float) -> Estimate:
        """See Estimator."""
        north, east, sog, cog, _, heading, yaw_rate, water_speed, *_ = measurements
        self.filter.predict(dt)
        if not math.isnan(north):
            self.filter.update_north_east(north, east)
        if self.filter.aid:
            self.filter.aid_by(sog, cog, heading, water_speed, yaw_rate)
        north, east, sog, cog, rate, sog_std, cog_std, rate_std, relative = self.filter.output()
        std, (bow, turning) = math.hypot(relative, self._slow_std), self.tracker.step(heading, yaw_rate, dt)
        motion = north, east, sog, cog, rate, sog_std, cog_std, rate_std
        return Estimate(*motion, std, bow, turning, position_relative_std=relative)


class AtFaceValue:
    """The last measurements, unfiltered: to control by true states, the case with which the papers compare."""

    def __init__(self) -> None:
        self._last: Sequence[float] = NO_MEASUREMENTS

    def step(self, measurements: Measurements, dt: float) -> Estimate:
        """See Estimator."""
        kept = [old if math.isnan(new) else new for old, new in zip(self._last, measurements, strict=True)]
        self._last = kept
        north, east, sog, cog, course_rate, heading, yaw_rate, *_ = kept
        return Estimate(north, east, sog, cog, course_rate, 0.0, 0.0, 0.0, 0.0, heading, yaw_rate)


class ComposedEstimator:
    """An estimator whose heading, speed or both come from further filters.

    Args:
        ground: estimates everything else.
        heading: takes compass, orders and GNSS velocity. The rate of a gyro, if any, replaces its yaw rate.
        speed: takes accelerometer, the receiver's SOG and speed logs. Its speed along the hull replaces the SOG.
    """

    def __init__(
        self, ground: Estimator, heading: HeadingAboard | None = None, speed: SurgeFusion | None = None
    ) -> None:
        self.ground, self.heading, self.speed = ground, heading, speed

    def order(self, yaw: float, speed: float = math.nan) -> None:
        """Note the yaw order of the autopilot and the ordered speed (m/s), both in force until the next order."""
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
