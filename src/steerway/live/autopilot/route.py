"""The route under way, aboard: which leg, how far off it, and the course that leads back to it."""

import math

from steerway.core.angles import wrap
from steerway.core.leg import UNKNOWN_LEG, Leg
from steerway.guidance.waypoints import Phase
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.autopilot.piloting import pilot_of
from steerway.live.base.rows import Row
from steerway.pilot import Pilot

_BRAKING = 0.1
"""m/s², at which the last waypoint is approached."""
_SLOWEST = 0.6
"""Share of the route's speed at which it is reached: a boat at rest has no course."""


class Guide:
    """The guidance of a pilot on a route, one step a row, engaged or not: other programs steer by its leg too.

    Without a `pilot` one of default settings is made. Raises InputError for a route that cannot be sailed.
    """

    def __init__(self, line: GeodeticRoute, pilot: Pilot | None = None):
        self._line = line
        self._pilot = pilot_of(line) if pilot is None else pilot
        self._time = math.nan

    def restart(self) -> None:
        """Begin again with the first leg."""
        self._pilot.mission.restart()
        self._time = math.nan

    def interrupt(self) -> None:
        """The route is not followed for a while, which does not count."""
        self._time = math.nan

    def go_on_from(self, leg: int) -> None:
        """Follow the route from a leg on; leg k leads to waypoint k."""
        self._pilot.mission.go_to(leg)

    @property
    def finished(self) -> bool:
        """Whether the last waypoint is passed."""
        return self._pilot.mission.phase is not Phase.UNDER_WAY

    def step(self, row: Row) -> Leg | None:
        """The leg as seen at a row, all of it unknown without a position; None when the route is finished."""
        if self.finished:
            return None
        if not row.valid:
            return UNKNOWN_LEG
        dt = max(row.time - self._time, 0.0) if math.isfinite(self._time) else 0.0
        self._time = row.time
        estimate = self._pilot.estimator.step(row, dt)
        seen = self._pilot.mission.step(estimate.north, estimate.east, dt)
        self._pilot.look_ahead(seen, estimate, dt)
        target = seen.target
        steer = self._pilot.law.step(self._pilot.seen(seen, seen.speed, estimate), estimate.cog, estimate.sog, dt).angle
        closing = row.sog * math.cos(wrap(seen.bearing - row.cog))
        return Leg(
            seen.cross_track,
            seen.direction,
            seen.bearing,
            seen.distance,
            steer,
            closing,
            float(self._line.latitude[target]),
            float(self._line.longitude[target]),
            f"WP{max(target - 1, 0)}",
            f"WP{target}",
            bool(seen.distance <= self._pilot.mission.route.acceptance[target]),
            seen.remaining <= 0.0,
            self._speed(seen),
        )

    def _speed(self, seen):
        """The route's speed, less towards its end."""
        route = self._pilot.mission.route
        if seen.target < len(route) - 1:
            return seen.speed
        left = max(seen.remaining - route.acceptance[seen.target], 0.0)
        return max(_SLOWEST * seen.speed, min(seen.speed, math.sqrt(2.0 * _BRAKING * left)))
