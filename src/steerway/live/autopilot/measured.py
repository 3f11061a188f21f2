"""Heading from whatever a boat's links report, and from what is ordered: the filters of scenarios aboard."""

import logging
import math

from steerway.control.heading_plant import HeadingResponse
from steerway.core.angles import wrap
from steerway.estimation.heading.aboard import HeadingAboard, model_of
from steerway.live.rows import InputRow
from steerway.live.source_choice import SourceChoice
from steerway.simulation.estimator_tables import HeadingEstimatorTable

LOG = logging.getLogger("steerway.live")
_SHORTEST_STEP, _LONGEST_STEP = 1e-3, 30.0
"""s between two measurements; after a longer pause, and where time goes back by as much, the filter begins anew."""
_FRESH = 2.0
"""s after the compass's last reading for which the heading is predicted, as the tracker's patience."""
_GYRO = 0.5
"""s for which a measured yaw rate holds."""


class MeasuredHeading:
    """Takes every row of the links, in the order of their arrival; `at` gives the heading.

    table: which filter, of those beside the tracker. time: of the yaw rate's response to an ordered one, s; limit: the
    largest that is ordered, rad/s; speed: usual through the water, m/s; speed_time: in which it follows an order, s.
    """

    def __init__(self, table: HeadingEstimatorTable, time: float, limit: float, speed: float, speed_time: float):
        response = HeadingResponse.of_nomoto(1.0, max(time, _GYRO))
        self._yaw = model_of(response.poles, response.gains, response.sample, limit)
        self._table, self._limit, self._speed, self._speed_time = table, limit, speed, speed_time
        self._is_known = False
        self.restart()

    def restart(self) -> None:
        """Forget the heading."""
        table = self._table
        stds = math.radians(table.compass_std_deg), math.radians(table.deviation_std_deg)
        self.filter = HeadingAboard(
            table.kind, self._yaw, self._limit, self._speed, *stds, weight=table.weight, speed_time=self._speed_time
        )
        self._choice = SourceChoice()  # one compass
        self._time = self._read = math.nan
        self._gyro = self._turned_at = math.nan
        self._ordered, self._ordered_speed, self._ordered_at = math.nan, math.nan, math.nan
        self._turned = self._since = self._mean = (
            0.0  # ordered since the last measurement: rad, s; and before it, rad/s
        )

    def take(self, row: InputRow) -> None:
        """Compass, gyro and velocity over ground of a row; rows without any are ignored."""
        if math.isfinite(row.yaw_rate):
            self._gyro, self._turned_at = row.yaw_rate, row.time
        is_compass = math.isfinite(row.heading) and self._choice.uses_aid("heading", row, row.time)
        heading = row.heading if is_compass else math.nan
        velocity = row.sog * math.cos(row.cog), row.sog * math.sin(row.cog)
        if not (is_compass or math.isfinite(velocity[0])):
            return
        if math.isfinite(self._time) and abs(row.time - self._time) > _LONGEST_STEP:
            self.restart()
        step = row.time - self._time if math.isfinite(self._time) else _SHORTEST_STEP
        step = max(step, _SHORTEST_STEP)
        self.filter.order(self._mean_order(row.time), self._ordered_speed)
        self.filter.step(heading, step, velocity)
        self._time = row.time if math.isnan(self._time) else self._time + step
        self._read = self._time if is_compass else self._read

    def order(self, yaw_rate: float, speed: float, time: float) -> None:
        """What is ordered from a time on (rad/s, m/s); NaN: someone else steers."""
        self._pass(time)
        self._ordered, self._ordered_speed = yaw_rate, speed

    def at(self, time: float) -> float:
        """The heading at a time, NaN while unknown, and without a compass: orders and velocity tell it then, which the
        steering filter knows itself.
        """
        gyro = self._measured_rate(time)
        rate = self.filter.yaw_rate if math.isnan(gyro) else gyro
        heading = wrap(self.filter.heading + rate * max(time - self._time, 0.0))
        return heading if time - self._read < _FRESH else math.nan

    def report(self, heading: float) -> None:
        """Log when the heading is known, and when it no longer is."""
        if self._is_known != math.isfinite(heading):
            self._is_known = not self._is_known
            std = math.degrees(self.filter.heading_std)
            LOG.info("heading (%s) %s", self._table.kind, f"known to ± {std:.0f}°" if self._is_known else "unknown")

    def _measured_rate(self, time):
        return self._gyro if time - self._turned_at < _GYRO else math.nan

    def _pass(self, time):
        """Add up what was ordered until a time; where someone else steers, what the gyro measured."""
        passed = max(time - self._ordered_at, 0.0) if math.isfinite(self._ordered_at) else 0.0
        rate = self._measured_rate(time) if math.isnan(self._ordered) else self._ordered
        self._turned += passed * (0.0 if math.isnan(rate) else rate)
        self._since += passed
        self._ordered_at = time

    def _mean_order(self, time):
        """The mean of what was ordered since the last measurements; of the last, for several that come at once."""
        self._pass(time if math.isnan(self._ordered_at) else max(time, self._ordered_at))
        if self._since > 0.0:
            self._mean = self._turned / self._since
        self._turned = self._since = 0.0
        return self._mean
