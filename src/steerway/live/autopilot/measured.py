"""Heading from whatever a boat's links report, and from what is ordered: the filters of scenarios aboard."""

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

    def _measured_rate(self, time: float) -> float:
        return self._gyro if time - self._turned_at < _GYRO else math.nan

    def _pass(self, time: float) -> None:
        """Add up what was ordered until a time; where someone else steers, what the gyro measured."""
        passed = max(time - self._ordered_at, 0.0) if math.isfinite(self._ordered_at) else 0.0
        rate = self._measured_rate(time) if math.isnan(self._ordered) else self._ordered
        self._turned += passed * (0.0 if math.isnan(rate) else rate)
        self._since += passed
        self._ordered_at = time

    def _mean_order(self, time: float) -> float:
        """The mean of what was ordered since the last measurements; of the last, for several that come at once."""
        self._pass(time if math.isnan(self._ordered_at) else max(time, self._ordered_at))
        if self._since > 0.0:
            self._mean = self._turned / self._since
        self._turned = self._since = 0.0
        return self._mean


_LONGEST_SPEED_STEP = 1.0
"""s; after a longer pause the speed is as good as unknown and found anew."""
_HELD = 0.5
"""s for which an acceleration holds."""
_FRESH_SPEED = 3.0
"""s after the last measured speed for which the fused one is used."""
TUNING = SurgeTuning(sog_std=0.1, bottom_std=0.02, water_std=0.05, acceleration_walk=3e-3, leak_std=0.1, leak_time=2.0)
"""For instruments of small boats in waves: a hull that pitches leaks gravity."""


class MeasuredSpeed:
    """Takes every row of the links; `speed` and `shaft` are of now."""

    def __init__(self, tuning: SurgeTuning = TUNING):
        self.fusion = SurgeFusion(tuning)
        self.shaft = math.nan
        self._time = self._measured = self._felt = -math.inf
        self._acceleration = math.nan

    def take(self, row: InputRow) -> None:
        """Measurements of a row, in the order of their arrival; rows without any are ignored."""
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
        """Speed over ground along the hull at a time, m/s; NaN when nothing has measured it lately."""
        return self.fusion.speed if time - self._measured < _FRESH_SPEED else math.nan


def measured_speed(table: SpeedEstimatorTable) -> MeasuredSpeed | None:
    """The speed of [estimator.speed], with `TUNING` for what it leaves out; None for that of the course filter."""
    if table.kind == "course":
        return None
    return MeasuredSpeed(replace(TUNING, **table.model_dump(exclude={"kind"}, exclude_unset=True)))
