"""The route under way, aboard: which leg, how far off it, and the course that leads back to it."""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.earth import displaced, displacement
from steerway.formats.nmea0183.writing import Leg
from steerway.guidance.line_of_sight import LineOfSight
from steerway.guidance.route import Route
from steerway.guidance.waypoints import Mission, Passing, Phase
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.heard import Row

UNKNOWN_LEG = Leg(*[math.nan] * 8)
_BRAKING = 0.1
"""m/s², at which the last waypoint is approached."""
_SLOWEST = 0.6
"""Share of the asked speed with which it is reached: a boat without way has no course."""


class Guide:
    """Follows a route by what is said of the boat; one step a row.

    Shapes and units as in GeodeticRoute. Raises InputError for a route that cannot be sailed.
    """

    def __init__(self, line: GeodeticRoute):
        self._line = line
        self._origin = float(line.latitude[0]), float(line.longitude[0])
        places = [displacement(*place, *self._origin) for place in zip(line.latitude, line.longitude, strict=True)]
        north, east = np.array(places).T
        self.route = Route(north, east, acceptance=line.acceptance, speed=line.speed)
        self.mission = Mission(self.route, Passing(time_factor=None))
        self._law = LineOfSight(line.lookahead)
        self._time = math.nan

    def restart(self) -> None:
        """Begin again with the first leg."""
        self.mission.restart()
        self._time = math.nan

    @property
    def finished(self) -> bool:
        """Whether the last waypoint is behind."""
        return self.mission.phase is not Phase.UNDER_WAY

    def step(self, row: Row) -> Leg | None:
        """The leg as seen at a row, all of it unknown without a position; None when the route is done."""
        if self.finished:
            return None
        if not row.valid:
            return UNKNOWN_LEG
        dt = max(row.time - self._time, 0.0) if math.isfinite(self._time) else 0.0
        self._time = row.time
        place = displacement(row.latitude, row.longitude, *self._origin)
        seen = self.mission.step(*place, dt)
        target = seen.target
        steer = self._law.step(seen, row.cog, row.sog, dt).angle
        closing = row.sog * math.cos(wrap(seen.bearing - row.cog))
        destination = displaced(*self._origin, self.route.north[target], self.route.east[target])
        return Leg(
            seen.cross_track,
            seen.direction,
            seen.bearing,
            seen.distance,
            steer,
            closing,
            *destination,
            f"WP{max(target - 1, 0)}",
            f"WP{target}",
            bool(seen.distance <= self.route.acceptance[target]),
            seen.remaining <= 0.0,
            self._speed(seen),
        )

    def _speed(self, seen):
        """What the route asks for, less towards its end."""
        if seen.target < len(self.route) - 1:
            return seen.speed
        left = max(seen.remaining - self.route.acceptance[seen.target], 0.0)
        return max(_SLOWEST * seen.speed, min(seen.speed, math.sqrt(2.0 * _BRAKING * left)))
