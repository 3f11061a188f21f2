"""The largest yaw rate that a vehicle is ordered: as the mission or the vehicle says, less where the boat turns less.

A vehicle reports the limit of its own yaw-rate loop; what the boat can turn depends on its thrust besides. A gyro shows
within a second that a turn falls short, before much of it is missed.
"""

import math

UNTOLD = math.radians(20.0)
"""rad/s while neither the mission nor the vehicle says one."""
MOST = math.radians(60.0)
"""rad/s at the most of what a vehicle says: on squares at 2 m/s corners are within 1.5 m with it. Chosen."""
_SHARE = 0.75
"""Share of the vehicle's limit that is ordered; the rest is left to its own loop. Chosen."""
_LEAST = math.radians(8.0)
"""rad/s that are always ordered."""
_RESPONSE = 0.8
"""s in which the yaw rate is expected to follow an order, with the delay of a fix. Chosen."""
_SHORT, _LASTING = 0.6, 0.5
"""Share of the expected yaw rate below which a turn falls short, and s for which it has to."""
_DRIVEN = 0.4
"""Share of full thrust from which on a turn that falls short is remembered: a rudder turns less without thrust."""
_REGAINED = 0.1
"""1/s at which the limit grows again while the boat turns as expected, as a share."""


class TurnLimit:
    """declared: rad/s, of the mission, None where it says none: then the vehicle's own counts."""

    def __init__(self, declared: float | None = None):
        self._declared = declared
        self._told = self._able = self._most = UNTOLD if declared is None else declared
        self._expected = self._ordered = self._short = self._thrust = 0.0

    @property
    def rate(self) -> float:
        """The limit now, rad/s: half where the thrust is low, of a limit that the vehicle says."""
        if self._declared is not None or self._told <= UNTOLD:
            return self._most
        return min(self._most, self._told * min(1.0, max(0.5, self._thrust / _DRIVEN)))

    def vehicle(self, limit: float) -> None:
        """The vehicle's own limit, rad/s."""
        if self._declared is None and limit > 0.0:
            self._told = self._able = self._most = max(_LEAST, min(MOST, _SHARE * limit))

    def order(self, yaw_rate: float, thrust: float, dt: float) -> None:
        """The yaw rate (rad/s) and the share of full thrust ordered over the last dt s; NaN: none."""
        share = -math.expm1(-dt / _RESPONSE)
        self._ordered = yaw_rate if math.isfinite(yaw_rate) else 0.0
        self._expected += share * (self._ordered - self._expected)
        self._thrust += share * ((thrust if math.isfinite(thrust) else 0.0) - self._thrust)

    def turned(self, yaw_rate: float, dt: float) -> None:
        """A yaw rate was measured (rad/s; NaN: none), dt s after the one before."""
        expected, turned = abs(self._expected), yaw_rate * math.copysign(1.0, self._expected)
        if not math.isfinite(yaw_rate) or expected < max(0.5 * _LEAST, 0.4 * self.rate):
            self._short, self._most = 0.0, self._able
        elif abs(self._ordered) < expected:  # the turn is ending
            self._short = 0.0
        elif turned < _SHORT * expected:
            self._short += min(dt, 0.5)
            if self._short >= _LASTING:
                self._most = max(_LEAST, min(self._most, turned))
                if self._thrust > _DRIVEN:
                    self._able = self._most
        else:
            self._short = 0.0
            self._able = min(self._told, self._able * (1.0 + _REGAINED * min(dt, 0.5)))
