"""Heading and speed aboard, from the reports of all links and the orders, by the filters that scenarios also use."""

import logging
import math
from dataclasses import replace

from steerway.control.heading_plant import HeadingResponse
from steerway.core.angles import wrap
from steerway.estimation.estimator_tables import HeadingEstimatorTable, SpeedEstimatorTable
from steerway.estimation.heading.aboard import HeadingAboard, model_of
from steerway.estimation.speed.fusion import SurgeFusion
from steerway.estimation.speed.surge import SurgeTuning
from steerway.live.rows import InputRow
from steerway.live.source_choice import SourceChoice

LOG = logging.getLogger("steerway.live")
_SHORTEST_STEP, _LONGEST_STEP = 1e-3, 30.0
"""Shortest and longest interval between two measurements, s. After a longer one or a step back the filter restarts."""
_FRESH = 2.0
"""Time after the compass's last reading for which the heading is predicted, s; as in the tracker."""
_GYRO = 0.5
"""Time for which a measured yaw rate is used, s."""


class MeasuredHeading:
    """Takes every row of the links in order of arrival; `at` gives the heading.

    table: the kind of filter (not the tracker) and its numbers; time: time constant of the yaw rate after an order, s;
    limit: largest ordered yaw rate, rad/s; speed: usual speed through the water, m/s; speed_time: time constant of this
    speed after an order, s.
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
            0.0  # since the last measurement: ordered turn (rad), time (s); before it: mean ordered yaw rate (rad/s)
        )

    def take(self, row: InputRow) -> None:
        """Use compass, gyro and velocity over ground of a row; rows without any of them are ignored."""
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
        """Take the yaw rate (rad/s) and speed (m/s) ordered from a time on; NaN: another program or a person steers."""
        self._pass(time)
        self._ordered, self._ordered_speed = yaw_rate, speed

    def at(self, time: float) -> float:
        """The heading at a time; NaN while it is unknown, and without a recent compass reading.

        Without a compass the steering filter finds the heading from orders and velocity itself.
        """
        gyro = self._measured_rate(time)
        rate = self.filter.yaw_rate if math.isnan(gyro) else gyro
        heading = wrap(self.filter.heading + rate * max(time - self._time, 0.0))
        return heading if time - self._read < _FRESH else math.nan

    def report(self, heading: float) -> None:
        """Log a change between a known and an unknown heading."""
        if self._is_known != math.isfinite(heading):
            self._is_known = not self._is_known
            std = math.degrees(self.filter.heading_std)
            LOG.info("heading (%s) %s", self._table.kind, f"known to ± {std:.0f}°" if self._is_known else "unknown")

    def _measured_rate(self, time: float) -> float:
        return self._gyro if time - self._turned_at < _GYRO else math.nan

    def _pass(self, time: float) -> None:
        """Add the turn ordered until a time; if the autopilot did not steer, the turn measured by the gyro."""
        passed = max(time - self._ordered_at, 0.0) if math.isfinite(self._ordered_at) else 0.0
        rate = self._measured_rate(time) if math.isnan(self._ordered) else self._ordered
        self._turned += passed * (0.0 if math.isnan(rate) else rate)
        self._since += passed
        self._ordered_at = time

    def _mean_order(self, time: float) -> float:
        """The mean yaw rate ordered since the last measurement; unchanged for measurements at the same time."""
        self._pass(time if math.isnan(self._ordered_at) else max(time, self._ordered_at))
        if self._since > 0.0:
            self._mean = self._turned / self._since
        self._turned = self._since = 0.0
        return self._mean


_LONGEST_SPEED_STEP = 1.0
"""Longest step of the speed filter, s; after a longer one the speed is practically unknown."""
_HELD = 0.5
"""Time for which a measured acceleration is used, s."""
_FRESH_SPEED = 3.0
"""The fused speed is used until this time after the last measured speed, s."""
TUNING = SurgeTuning(sog_std=0.1, bottom_std=0.02, water_std=0.05, acceleration_walk=3e-3, leak_std=0.1, leak_time=2.0)
"""Tuning for instruments of small boats in waves: pitch adds a part of gravity to the measured acceleration."""


class MeasuredSpeed:
    """Takes every row of the links. `speed` gives the fused speed; `shaft` is the last measured shaft speed, rev/s."""

    def __init__(self, tuning: SurgeTuning = TUNING):
        self.fusion = SurgeFusion(tuning)
        self.shaft = math.nan
        self._time = self._measured = self._felt = -math.inf
        self._acceleration = math.nan

    def take(self, row: InputRow) -> None:
        """Use the speeds, acceleration and shaft speed of a row, in order of arrival; other rows are ignored."""
        speeds = row.sog, row.bottom_speed, row.water_speed
        if math.isfinite(row.shaft):
            self.shaft = row.shaft
        measured = any(map(math.isfinite, speeds))
        if not (measured or math.isfinite(row.acceleration)):
            return
        dt = min(max(row.time - self._time, 0.0), _LONGEST_SPEED_STEP)
        self._time = max(self._time, row.time)
        if math.isfinite(row.acceleration):
            self._acceleration, self._felt = row.acceleration, row.time
        held = self._acceleration if row.time - self._felt < _HELD else math.nan
        self.fusion.step(held, dt, *speeds)
        if measured:
            self._measured = max(self._measured, row.time)

    def speed(self, time: float) -> float:
        """Speed over ground along the hull at a time, m/s; NaN without a recent measurement of a speed."""
        return self.fusion.speed if time - self._measured < _FRESH_SPEED else math.nan


def measured_speed(table: SpeedEstimatorTable) -> MeasuredSpeed | None:
    """The speed filter of [estimator.speed]; `TUNING` gives missing keys. None for the speed of the course filter."""
    if table.kind == "course":
        return None
    return MeasuredSpeed(replace(TUNING, **table.model_dump(exclude={"kind"}, exclude_unset=True)))
