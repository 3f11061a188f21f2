"""One speed from GPS, Doppler log and accelerometer, with fault detection.

A reading outside its gate is skipped. Lasting contradictions have three causes. `FaultVote` decides between GPS and
log, with the speed from shaft speed as third instrument and the integrated acceleration. The accelerometer is faulty if
the better of GPS and log has been rejected for `UNBROKEN_REJECTION` while the two agree. The current has changed if
only speeds through the water are rejected.
"""

import math
from dataclasses import dataclass

from steerway.core.statistics import AID_GATE, UNBROKEN_REJECTION
from steerway.estimation.speed.fault_vote import FaultVote
from steerway.estimation.speed.surge import BIAS, CURRENT, LEAK, SPEED, SurgeFilter

SOG, BOTTOM, WATER, PROPELLER = range(4)
AIDS = ("sog", "bottom_speed", "water_speed", "propeller_speed")


@dataclass(frozen=True)
class FaultEvent:
    """Change of an instrument's state at `time` s: "excluded", "readmitted" or "doubted"."""

    time: float
    instrument: str
    what: str


class SurgeFusion(SurgeFilter):
    """A `SurgeFilter` with fault detection: `step` runs at the accelerometer's rate; other instruments have their own.

    `events`: exclusions and readmissions; `excluded`: the aid that is left out now, or None.
    """

    def reset(self) -> None:
        """Start again from nothing."""
        super().reset()
        self.events: list[FaultEvent] = []
        self.nis = (math.nan,) * 4
        self._vote = FaultVote((self.tuning.sog_std, self.tuning.bottom_std))
        self._time = 0.0
        self._refused = [math.nan] * 4  # time (s) of the first of unbroken rejections
        self._measured_at = [-math.inf] * 4
        self._inertial = 0.0

    def step(
        self,
        acceleration: float,
        dt: float,
        sog: float = math.nan,
        bottom_speed: float = math.nan,
        water_speed: float = math.nan,
        propeller_speed: float = math.nan,
        reference: float = math.nan,
    ) -> float:
        """Speed over ground along the hull (m/s) after dt s of `acceleration` (m/s²) and the measurements at their end.

        `sog` of the receiver, `bottom_speed` or `water_speed` of the log, `propeller_speed` computed from shaft speed
        by an identified model, all m/s along the hull, NaN for none. `reference`: as `propeller_speed`, by a rough
        model; it is used in the vote alone.
        """
        self._time += dt
        self.predict(acceleration, dt)
        # After a pause of the accelerometer its integral restarts at 0, far from its value before.
        before = 0.0 if math.isnan(self._inertial) else self._inertial
        self._inertial = before + dt * (acceleration - self.acceleration_error)
        measured = [sog, bottom_speed, water_speed, propeller_speed]
        if not any(map(math.isfinite, measured)):
            return self.speed
        third = propeller_speed if math.isfinite(propeller_speed) else reference
        self._hold_vote(measured, third)
        self.nis = self.aid_by(*measured)
        self._watch()
        return self.speed

    @property
    def filter(self) -> SurgeFilter:
        """The fusion itself, for scripts written for earlier versions."""
        return self

    @property
    def excluded(self) -> str | None:
        return None if self._vote.excluded is None else AIDS[self._vote.excluded]

    def _hold_vote(self, measured: list[float], third: float) -> None:
        """Drop the excluded aid; increase the covariance when the filter has followed a faulty one."""
        before, speed = self._vote.excluded, self.speed
        present = [which for which in (SOG, BOTTOM) if math.isfinite(measured[which])]
        for which in present:
            reading = measured[which] / (self.log_scale if which == BOTTOM else 1.0)
            self._vote.take(which, self._time, reading, speed, third, self._inertial)
        if present:
            misled, window = self._vote.judge(self._time, abs(speed) * self.log_scale_std)
            now = self._vote.excluded
            if now is not None and now != before:
                self._note(now, "excluded")
            elif now is None and before is not None:
                self._note(before, "readmitted")
            if misled**2 > 0.0:
                self._open_inertial(misled, misled / window)
        if self._vote.excluded is not None:
            measured[self._vote.excluded] = math.nan

    def _watch(self) -> None:
        """Note when rejections began; after `UNBROKEN_REJECTION` s reset the accelerometer's errors, or the current."""
        for which, nis in enumerate(self.nis):
            if math.isnan(nis):
                continue
            self._measured_at[which] = self._time
            if nis <= AID_GATE:
                self._refused[which] = math.nan
            elif math.isnan(self._refused[which]):
                self._refused[which] = self._time
        over_ground = [which for which in (BOTTOM, SOG) if self._is_present(which)]
        if over_ground and self._lost(over_ground[0]) and not self._vote.conflict:
            self._note(-1, "doubted")
            self._open_inertial(1.0, self.tuning.bias_std)
            self._refused = [math.nan] * 4
        elif self._lost(WATER) or self._lost(PROPELLER):
            self.open(CURRENT, self.tuning.current_std**2)
            self._refused[WATER] = self._refused[PROPELLER] = math.nan

    def _is_present(self, which: int) -> bool:
        return self._vote.excluded != which and self._time - self._measured_at[which] < 1.0

    def _lost(self, which: int) -> bool:
        return self._time - self._refused[which] >= UNBROKEN_REJECTION

    def _open_inertial(self, speed_std: float, bias_std: float) -> None:
        """Increase the covariance of speed, bias and leak, which a fault has affected."""
        covariance = self.covariance
        self.open(SPEED, covariance[SPEED, SPEED] + speed_std**2)
        self.open(BIAS, covariance[BIAS, BIAS] + bias_std**2)
        self.open(LEAK, self.tuning.leak_std**2)

    def _note(self, which: int, what: str) -> None:
        name = "acceleration" if which < 0 else AIDS[which]
        self.events.append(FaultEvent(self._time, name, what))
