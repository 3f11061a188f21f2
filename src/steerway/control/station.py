"""Station keeping without sway force: the bow points into the disturbance, and thrust balances it.

The force that would hold the boat is a vector in north and east: proportional and integral on the position, damping on
the velocity. The boat turns towards the slowly varying part of the force and applies the component along the bow. In a
current the integral converges to the drag, so that the boat stays at the point with its bow into the current.
"""

import math
from dataclasses import dataclass

from steerway.core.angles import wrap
from steerway.core.checks import positive

Vector = tuple[float, float]
"""North and east."""


@dataclass(frozen=True)
class StationGains:
    """mass: including added mass, kg; bandwidth: ω of the position loop, rad/s; radius: distance within which the boat
    backs to a point astern instead of turning round, m; least_force: force below which the bow keeps its direction, N;
    limit and limit_astern: of the surge force, N, both positive."""

    mass: float
    bandwidth: float = 0.2
    radius: float = 5.0
    least_force: float = 2.0
    limit: float = math.inf
    limit_astern: float = math.inf

    def __post_init__(self) -> None:
        for name in ("mass", "bandwidth", "radius", "least_force"):
            positive(f"station.{name}", getattr(self, name))


class StationKeeper:
    """Keeps a boat at a point; `heading` is the desired heading."""

    def __init__(self, gains: StationGains):
        self.gains = gains
        self.restart()

    def restart(self) -> None:
        """Reset the integral and the desired heading."""
        self.integral = (0.0, 0.0)
        self.heading = math.nan

    def step(
        self, distance: float, bearing: float, course: float, speed: float, heading: float, dt: float
    ) -> tuple[tuple[float, float, float], float]:
        """((desired heading, 0, 0), surge force in N) for a point at a distance (m) and bearing (rad).

        course and speed are over ground; an unknown course counts as no speed. An unknown heading gives no force.
        """
        gains = self.gains
        stiffness = gains.mass * gains.bandwidth**2
        pull = _vector(stiffness * distance, bearing)
        way = _vector(2.0 * gains.mass * gains.bandwidth * speed, course)
        lasting = _sum(pull, self.integral)
        self._point(lasting, distance, heading)
        if not math.isfinite(heading):
            return (self.heading, 0.0, 0.0), 0.0
        wanted = _along((lasting[0] - way[0], lasting[1] - way[1]), heading)
        force = max(-gains.limit_astern, min(gains.limit, wanted))
        # Integrate only near the point and within the limits of thrust.
        if force == wanted and distance < 4.0 * gains.radius:
            share = 0.1 * gains.bandwidth * dt
            self.integral = _sum(self.integral, (share * pull[0], share * pull[1]))
        return (self.heading, 0.0, 0.0), force

    def _point(self, lasting: Vector, distance: float, heading: float) -> None:
        """Point the bow along the slow force. To a near point astern the boat backs, unless there is a current."""
        if math.isnan(self.heading):
            self.heading = heading
        for force in (lasting, self.integral):
            towards = math.atan2(force[1], force[0])
            strong = math.hypot(*force) > self.gains.least_force
            ahead = abs(wrap(towards - self.heading)) < 0.5 * math.pi
            if strong and (ahead or distance > self.gains.radius or force is self.integral):
                self.heading = wrap(towards)
                return


def _vector(size: float, direction: float) -> Vector:
    """(north, east), zero where either is unknown."""
    if not (math.isfinite(size) and math.isfinite(direction)):
        return (0.0, 0.0)
    return (size * math.cos(direction), size * math.sin(direction))


def _sum(one: Vector, other: Vector) -> Vector:
    return (one[0] + other[0], one[1] + other[1])


def _along(vector: Vector, direction: float) -> float:
    return vector[0] * math.cos(direction) + vector[1] * math.sin(direction)
