"""Speed along the hull from whatever a boat's links report: receiver, logs, accelerometer, shaft."""

import math
from dataclasses import replace

from steerway.estimation.speed.fusion import SurgeFusion
from steerway.estimation.speed.surge import SurgeTuning
from steerway.live.rows import InputRow
from steerway.simulation.estimator_tables import SpeedEstimatorTable

_LONGEST_STEP = 1.0
"""s; after a longer pause the speed is as good as unknown and found anew."""
_HELD = 0.5
"""s for which an acceleration holds."""
_FRESH = 3.0
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
        dt = min(max(row.time - self._time, 0.0), _LONGEST_STEP)
        self._time = max(self._time, row.time)
        if math.isfinite(row.acceleration):
            self._acceleration, self._felt = row.acceleration, row.time
        held = self._acceleration if row.time - self._felt < _HELD else math.nan
        self.fusion.step(held, dt, *speeds)
        if measured:
            self._measured = max(self._measured, row.time)

    def speed(self, time: float) -> float:
        """Speed over ground along the hull at a time, m/s; NaN when nothing has measured it lately."""
        return self.fusion.speed if time - self._measured < _FRESH else math.nan


def measured_speed(table: SpeedEstimatorTable) -> MeasuredSpeed | None:
    """The speed of [estimator.speed], with `TUNING` for what it leaves out; None for that of the course filter."""
    if table.kind == "course":
        return None
    return MeasuredSpeed(replace(TUNING, **table.model_dump(exclude={"kind"}, exclude_unset=True)))
