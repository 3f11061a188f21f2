"""Limits of a boat under way: speed, distance from the leg and fence; and the limit of the ordered yaw rate.

The mission or the vehicle gives the limit of the yaw rate. The limit is lowered if the boat turns more slowly: a
vehicle reports the limit of its own loop, but the boat's largest yaw rate also depends on its thrust.
"""

import math
from collections.abc import Sequence

from steerway.live.autopilot.fence import Fence, NoGo
from steerway.live.autopilot.mission import Limits
from steerway.live.rows import Row

LASTING = 0.5
"""Time for which speed or distance has to exceed a limit, s: single estimates scatter."""
_OFF = "the boat is "
_LONGEST_STEP = 0.2
"""Longest time that one step adds, s. Without this bound, a single value in a late step could last for `LASTING`."""
WIDE = 3.0
"""Default cross-track limit, in lookaheads. It applies once the boat has been on its leg."""
ACCELERATING = 15.0
"""Time after the start, and after a position was held, in which the lowest speed is not checked, s."""


class LimitGuard:
    """Checks the limits at each step, and counts for how long one is exceeded.

    Without a cross-track limit in the mission, the default limit applies once the boat has been near its leg. After a
    return to the leg (`rejoin`), the mission's limit also applies only from then on.
    """

    def __init__(
        self, limits: Limits, fence: Fence | None = None, lookahead: float = math.inf, no_go: Sequence[NoGo] = ()
    ):
        self._areas: list[Fence | NoGo] = [*([] if fence is None else [fence]), *no_go]
        self._low = limits.min_sog_mps or 0.0
        self._high = limits.max_sog_mps or math.inf
        self._wide = widest(limits, lookahead)
        self._is_given = limits.cross_track is not None
        self.start()

    def start(self) -> None:
        """Reset, when the autopilot is started."""
        self._under_way = 0.0
        self._beyond = 0.0
        self._is_off_route = False
        self._was_near = self._is_given

    def rejoin(self) -> None:
        """Note that the boat returns to its leg: the cross-track limit applies again once the boat is near the leg."""
        self._was_near = False

    def obstacle(self, row: Row, cross_track: float) -> str:
        """Why not to start here, `cross_track` m off the leg; "" for no reason."""
        return self._left(row) or self._beyond_limit(row, cross_track, 0.0)

    @property
    def is_off_route(self) -> bool:
        """Whether the cross-track limit was exceeded in the last step."""
        return self._is_off_route

    def step(self, row: Row, cross_track: float, is_held: bool, dt: float) -> str:
        """Why to stop; "" while all limits are kept. is_held: whether a position is held."""
        self._under_way = 0.0 if is_held else self._under_way + dt
        self._was_near |= abs(cross_track) < (self._wide if self._is_given else 0.5 * self._wide)
        beyond = self._beyond_limit(row, cross_track, self._low if self._under_way > ACCELERATING else 0.0)
        self._is_off_route = beyond.startswith(_OFF)
        self._beyond = self._beyond + min(dt, _LONGEST_STEP) if beyond else 0.0
        return self._left(row) or (beyond if self._beyond >= LASTING else "")

    def _left(self, row: Row) -> str:
        if not row.valid:
            return ""
        here = row.latitude, row.longitude, row.sog, row.cog
        return next(filter(None, (each.trouble(*here) for each in self._areas)), "")

    def _beyond_limit(self, row: Row, cross_track: float, low: float) -> str:
        if row.sog > self._high:
            return f"speed is {row.sog:.2f} m/s, the limit {self._high:g} m/s"
        if row.sog < low:
            return f"speed is {row.sog:.2f} m/s, the least {low:g} m/s"
        if abs(cross_track) > self._wide and self._was_near:
            return f"{_OFF}{abs(cross_track):.1f} m off the leg, the limit {self._wide:g} m"
        return ""


def widest(limits: Limits, lookahead: float) -> float:
    """Largest cross-track error (m): the mission's limit, or three lookaheads."""
    return limits.cross_track or WIDE * lookahead


UNTOLD = math.radians(20.0)
"""Limit of the ordered yaw rate while neither the mission nor the vehicle gives one, rad/s."""
MOST = math.radians(60.0)
"""Largest ordered yaw rate for a vehicle that reports its limit, rad/s. Chosen: on squares at 2 m/s the boat then
passes the corners within 1.5 m."""
_SHARE = 0.75
"""Largest ordered yaw rate as a fraction of the vehicle's limit. The vehicle's own loop needs the rest."""
_LEAST = math.radians(8.0)
"""Least value of the limit, rad/s."""
_RESPONSE = 0.8
"""Expected time constant from an ordered to a measured yaw rate, including the delay of a fix, s."""
_SHORT, _SHORT_FOR = 0.6, 0.5
"""A turn falls short if the yaw rate is below _SHORT times the expected rate for _SHORT_FOR s."""
_DRIVEN = 0.4
"""Least fraction of full thrust at which a turn that falls short also lowers the limit for later turns. With less
thrust a rudder turns the boat less."""
_ENDING = 0.9
"""An order below this fraction of the expected yaw rate ends the turn. Chosen: the expected rate approaches an order at
the limit from above, so that with 1 the limit could not grow again within a turn."""
_REGAINED = 0.1
"""Relative growth of the limit while the boat turns as expected, 1/s."""
_AT_ONCE = 0.5
"""Relative growth (1/s) of a limit that was lowered for this turn only. It ends at the limit for later turns."""


class TurnLimit:
    """The largest yaw rate to order; it is lowered if a gyro shows that the boat turns less than ordered.

    declared: limit of the mission, rad/s; None: the vehicle's own limit is used."""

    def __init__(self, declared: float | None = None):
        self._declared = declared
        self._told = self._able = self._most = UNTOLD if declared is None else declared
        self._expected = self._ordered = self._short = self._thrust = self._driven = 0.0

    @property
    def rate(self) -> float:
        """The present limit, rad/s. A limit that the vehicle reports is reduced at low thrust, down to half."""
        if self._declared is not None or self._told <= UNTOLD:
            return self._most
        return min(self._most, self._told * min(1.0, max(0.5, self._thrust / _DRIVEN)))

    def vehicle(self, limit: float) -> None:
        """Take the vehicle's own limit, rad/s."""
        if self._declared is None and limit > 0.0:
            self._told = self._able = self._most = max(_LEAST, min(MOST, _SHARE * limit))

    def order(self, yaw_rate: float, thrust: float, dt: float, throttle: float = math.nan) -> None:
        """Take the yaw rate (rad/s) and the fraction of full thrust ordered over the last dt s; NaN: no order.

        throttle: reported fraction of the motors' full throttle; NaN without a report.
        """
        share = -math.expm1(-dt / _RESPONSE)
        self._ordered = yaw_rate if math.isfinite(yaw_rate) else 0.0
        self._expected += share * (self._ordered - self._expected)
        thrust = thrust if math.isfinite(thrust) else 0.0
        self._thrust += share * (max(thrust, throttle if math.isfinite(throttle) else 0.0) - self._thrust)
        self._driven += share * (min(thrust, throttle) - self._driven)  # the thrust itself where throttle is NaN

    def turned(self, yaw_rate: float, dt: float) -> None:
        """Take a measured yaw rate (rad/s; NaN for none), dt s after the last one, and adapt the limit."""
        expected, turned = abs(self._expected), yaw_rate * math.copysign(1.0, self._expected)
        if not math.isfinite(yaw_rate) or expected < max(0.5 * _LEAST, 0.4 * self.rate):
            self._short, self._most = 0.0, self._able
        elif abs(self._ordered) < _ENDING * expected:  # the turn is ending
            self._short = 0.0
        elif turned < _SHORT * expected:
            self._short += min(dt, 0.5)
            if self._short >= _SHORT_FOR:
                self._most = max(_LEAST, min(self._most, turned))
                if self._driven > _DRIVEN:
                    self._able = self._most
        else:
            self._short = 0.0
            self._able = min(self._told, self._able * (1.0 + _REGAINED * min(dt, 0.5)))
            self._most = min(self._able, self._most * (1.0 + _AT_ONCE * min(dt, 0.5)))
