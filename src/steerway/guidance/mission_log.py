"""The mission log: waypoints reached and missed, distance, time, cross-track error and control effort."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from steerway.core.leg import LegState


class Passage(NamedTuple):
    """How the boat passed one waypoint."""

    waypoint: int
    reached: bool
    why: str  # remaining | circle | turn | corner | plane | time | start | the word given to `skip`
    time: float  # since the mission began
    sailed: float  # m since the mission began
    distance: float  # m to the waypoint when it was passed
    closest: float  # m, least distance to the waypoint on its leg


@dataclass
class MissionLog:
    """Totals of a mission while it is under way.

    `distance` sums the steps between positions. Pass estimated positions: the noise of raw fixes would add up.
    """

    passages: list[Passage] = field(default_factory=list)
    time: float = 0.0
    distance: float = 0.0
    energy: float = 0.0  # ∫ effort dt
    cross_track_max: float = 0.0  # largest |y_e|
    closest: float = math.inf
    _seen_time: float = 0.0
    _cross_track_square: float = 0.0
    _at: tuple[float, float] | None = None

    @property
    def reached(self) -> list[int]:
        """Indices of the waypoints reached."""
        return [each.waypoint for each in self.passages if each.reached]

    @property
    def missed(self) -> list[int]:
        """Indices of the waypoints missed."""
        return [each.waypoint for each in self.passages if not each.reached]

    @property
    def cross_track_rms(self) -> float:
        """Root mean square of y_e over the time with a known position; NaN before any."""
        return math.sqrt(self._cross_track_square / self._seen_time) if self._seen_time > 0.0 else math.nan

    @property
    def mean_effort(self) -> float:
        """Energy over time; P4 (24) when the effort is (n_d/60)². NaN before any time has passed."""
        return self.energy / self.time if self.time > 0.0 else math.nan

    def record(self, passage: Passage) -> None:
        """Append the passage of a waypoint."""
        self.passages.append(passage)

    def add(self, north: float, east: float, leg: LegState | None, dt: float, effort: float) -> None:
        """Add one step. An unknown position adds time and effort only; the next known one adds the distance from the
        last known one."""
        self.time += dt
        self.energy += effort * dt
        if leg is None or not (math.isfinite(north) and math.isfinite(east)):
            return
        if self._at is not None:
            self.distance += math.hypot(north - self._at[0], east - self._at[1])
        self._at = (north, east)
        deviation = abs(leg.cross_track)
        self._seen_time += dt
        self._cross_track_square += deviation * deviation * dt
        self.cross_track_max = max(self.cross_track_max, deviation)
        self.closest = min(self.closest, leg.distance)
