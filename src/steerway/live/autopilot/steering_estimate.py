"""The estimate that the autopilot aboard uses: it takes fixes and orders, and gives motion and current."""

import logging
import math

from steerway.core.earth import displacement
from steerway.core.estimate import NOTHING_KNOWN, Estimate
from steerway.estimation.steering import Response, SteeringFilter
from steerway.live.autopilot.measured import MeasuredHeading
from steerway.live.rows import InputRow, Row

LOG = logging.getLogger("steerway.live")
_LONGEST_GAP = 30.0
"""Largest interval between two fixes, s. After a longer one, or a step back in time, the filter restarts."""

_TOLD = 3.0
"""Time for which a reported throttle is used, s. Chosen: three intervals of heartbeats. A heartbeat of an unarmed
vehicle reports throttle 0."""

_DRIVES = 0.1
"""Fraction of full throttle above which the motor drives the boat."""

_SPEED_POWER = 0.75
"""Exponent p of the steady speed: top speed · throttle^p. Chosen: midway between 1 (the throttle sets the propeller's
speed) and 0.5 (it sets the thrust)."""


class SteeringEstimate:
    """Rows of the navigator as estimates in the tangent plane around an origin (latitude, longitude; rad).

    Once the steering filter has started, the estimate is that of the filter. Before, it is that of the row, without
    heading and current. The output of a `heading` filter is used in place of the compass.
    """

    def __init__(
        self,
        origin: tuple[float, float],
        response: Response,
        position_std: float,
        heading: MeasuredHeading | None = None,
    ):
        self._origin, self._response, self._std = origin, response, position_std
        self.heading = heading
        self._moment = self._fixed = math.nan
        self._idle_since = self._driven_since = math.inf  # when the motors began to idle, and to drive the boat
        self._throttle, self._throttle_told = math.nan, -math.inf
        self.ordered = math.nan  # ordered yaw rate, rad/s
        self.is_broken = False  # whether the estimate was not finite after the last fix
        self._stepped: tuple[Row, Estimate] | None = None  # last row and its estimate, which several callers request
        self.restart()

    def restart(self) -> None:
        """Forget the motion."""
        self._stepped = None
        self.filter = SteeringFilter(self._response, self._std)

    def take(self, row: InputRow) -> None:
        """Use the throttle and heading of any row of a link."""
        if math.isfinite(row.throttle):
            self._idle_since = min(self._idle_since, row.time) if row.throttle == 0.0 else math.inf
            self._driven_since = min(self._driven_since, row.time) if row.throttle > _DRIVES else math.inf
            self._throttle, self._throttle_told = row.throttle, row.time
        if self.heading is not None:
            self.heading.take(row)

    def throttle(self, time: float) -> float:
        """The motors' fraction of full throttle at a time (s); NaN without a recent report."""
        return self._throttle if time - self._throttle_told < _TOLD else math.nan

    def fix(self, row: InputRow) -> bool | None:
        """Use a fix. Returns whether it fits the steering filter's estimate; None before the filter has started."""
        if not 0.0 <= row.time - self._fixed <= _LONGEST_GAP:
            self.restart()
        self._fixed = row.time
        self._stepped = None
        place = displacement(row.latitude, row.longitude, *self._origin)
        velocity = row.sog * math.cos(row.cog), row.sog * math.sin(row.cog)
        is_told = math.isfinite(self.throttle(row.time))
        self.filter.idle_since = self._idle_since if is_told else math.inf
        self.filter.driven_since = self._driven_since if is_told else math.inf
        heading = row.heading if self.heading is None else self.heading.at(row.time)
        self._use(row.time, *place, *velocity, heading, row.yaw_rate)
        if self.heading is not None and self.filter.started:
            self.heading.report(heading)
        return self.filter.refused_for == 0.0 if self.filter.started else None

    def _use(self, time: float, *measured: float) -> None:
        """Update the filter with a fix; restart the filter if its estimate is then not finite."""
        try:
            self.filter.fix(time, *measured)
            self.is_broken = self.filter.started and not math.isfinite(sum(self.filter.at(time)[:5]))
        except (ArithmeticError, ValueError):
            self.is_broken = True
        if self.is_broken:
            LOG.error("the autopilot's estimate is no number and restarts")
            self.restart()

    def step(self, row: Row, dt: float) -> Estimate:
        """See `core.estimate.Estimator`."""
        self._moment = row.time
        if self._stepped is None or self._stepped[0] is not row:
            self._stepped = row, self._estimate(row)
        return self._stepped[1]

    def _estimate(self, row: Row) -> Estimate:
        if not row.valid:
            return NOTHING_KNOWN
        if self.filter.started and row.time - self._fixed <= _LONGEST_GAP:
            return self.filter.at(row.time)
        north, east = displacement(row.latitude, row.longitude, *self._origin)
        motion = row.sog, row.cog, row.course_rate, row.sog_std, row.cog_std, row.course_rate_std, row.position_std
        relative = row.position_relative_std
        return Estimate(north, east, *motion, math.nan, math.nan, position_relative_std=relative)

    def _driven(self) -> float:
        """The steady speed through the water (m/s) at the reported throttle; NaN without a report, and astern."""
        throttle = self.throttle(self._moment)
        return self._response.top_speed * throttle**_SPEED_POWER if throttle >= 0.0 else math.nan

    def order(self, yaw_rate: float, speed: float) -> None:
        """Take the yaw rate (rad/s) and speed (m/s) ordered from the last step on; NaN: the autopilot is off."""
        self.ordered = yaw_rate
        if math.isfinite(self._moment):
            self.filter.order(self._moment, yaw_rate, speed, self._driven())
            if self.heading is not None:
                self.heading.order(yaw_rate, speed, self._moment)
