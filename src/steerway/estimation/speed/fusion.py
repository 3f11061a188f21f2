"""One speed from GPS, Doppler log and accelerometer, and what is done when they contradict each other.

A reading that its gate refuses is lost, no more. Contradictions that last are settled so: GPS and log by `FaultVote`,
with the speed that the shaft's turns suggest as the third voice; the accelerometer, when the best of the others has
been refused for `PATIENCE` while those two agree; the current, when only what moves with the water is refused.
"""

import math
from dataclasses import dataclass

from steerway.estimation.course.update.outliers import AID_GATE
from steerway.estimation.speed.fault_vote import FaultVote
from steerway.estimation.speed.surge import BIAS, CURRENT, LEAK, SPEED, SurgeFilter, SurgeTuning

PATIENCE = 2.0
"""s of unbroken refusals after which it is the filter that is taken to be wrong, as in the five-state filter."""

SOG, BOTTOM, WATER, PROPELLER = range(4)
AIDS = ("sog", "bottom_speed", "water_speed", "propeller_speed")


@dataclass(frozen=True)
class FaultEvent:
    """`what` became of an instrument at `time` s: "excluded", "readmitted" or "doubted"."""

    time: float
    instrument: str
    what: str


class SurgeFusion:
    """`step` by step at the accelerometer's rate; others speak when they have something to say.

    `events` tells what was left out and taken back; `excluded` which aid is left out now, or None.
    """

    def __init__(self, tuning: SurgeTuning | None = None):
        self.filter = SurgeFilter(tuning)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.filter.reset()
        self.events: list[FaultEvent] = []
        self.nis = (math.nan,) * 4
        self._vote = FaultVote((self.filter.tuning.sog_std, self.filter.tuning.bottom_std))
        self._time = 0.0
        self._refused = [math.nan] * 4  # since when
        self._heard = [-math.inf] * 4
        self._propeller = math.nan

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
        """Speed over ground along the hull (m/s) after dt s of `acceleration` (m/s²) and what was said at their end.

        `sog` of the receiver, `bottom_speed` or `water_speed` of the log, `propeller_speed` made from the shaft's turns
        by an identified model, all m/s along the hull, NaN for silence. `reference`: as `propeller_speed`, of a model
        not good enough to aid, for the vote alone.
        """
        self._time += dt
        self.filter.predict(acceleration, dt)
        said = [sog, bottom_speed, water_speed, propeller_speed]
        if not any(map(math.isfinite, said)):
            return self.filter.speed
        third = propeller_speed if math.isfinite(propeller_speed) else reference
        self._hold_vote(said, third)
        self.nis = self.filter.aid_by(*said)
        self._watch()
        return self.filter.speed

    @property
    def speed(self) -> float:
        """Speed over ground along the hull, m/s."""
        return self.filter.speed

    @property
    def speed_std(self) -> float:
        return self.filter.speed_std

    @property
    def current(self) -> float:
        """The water's speed along the hull, m/s: known through the log's water track or the propeller only."""
        return self.filter.current

    @property
    def excluded(self) -> str | None:
        return None if self._vote.excluded is None else AIDS[self._vote.excluded]

    def _hold_vote(self, said, third):
        """Silence an aid that the vote leaves out; open the filter when it has been misled by it."""
        before = self._vote.excluded
        heard = [which for which in (SOG, BOTTOM) if math.isfinite(said[which])]
        for which in heard:
            self._vote.take(which, self._time, said[which], self.filter.speed, third)
        if heard:
            misled, window = self._vote.judge(self._time)
            now = self._vote.excluded
            if now != before:
                self._note(before if now is None else now, "readmitted" if now is None else "excluded")
            if misled**2 > 0.0:
                self._open_inertial(misled, misled / window)
        if self._vote.excluded is not None:
            said[self._vote.excluded] = math.nan

    def _watch(self):
        """Count refusals; after PATIENCE of them doubt the accelerometer, or the current."""
        for which, nis in enumerate(self.nis):
            if math.isnan(nis):
                continue
            self._heard[which] = self._time
            if nis <= AID_GATE:
                self._refused[which] = math.nan
            elif math.isnan(self._refused[which]):
                self._refused[which] = self._time
        over_ground = [which for which in (BOTTOM, SOG) if self._speaks(which)]
        if over_ground and self._lost(over_ground[0]) and not self._vote.conflict:
            self._note(-1, "doubted")
            self._open_inertial(1.0, self.filter.tuning.bias_std)
            self._refused = [math.nan] * 4
        elif self._lost(WATER) or self._lost(PROPELLER):
            self.filter.open(CURRENT, self.filter.tuning.current_std**2)
            self._refused[WATER] = self._refused[PROPELLER] = math.nan

    def _speaks(self, which):
        return self._vote.excluded != which and self._time - self._heard[which] < 1.0

    def _lost(self, which):
        return self._time - self._refused[which] >= PATIENCE

    def _open_inertial(self, speed_std, bias_std):
        """Know speed, bias and leak no better than so: what was learned of them was learned from a fault."""
        covariance = self.filter.covariance
        self.filter.open(SPEED, covariance[SPEED, SPEED] + speed_std**2)
        self.filter.open(BIAS, covariance[BIAS, BIAS] + bias_std**2)
        self.filter.open(LEAK, self.filter.tuning.leak_std**2)

    def _note(self, which, what):
        name = "acceleration" if which < 0 else AIDS[which]
        self.events.append(FaultEvent(self._time, name, what))
