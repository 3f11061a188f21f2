"""Limits of a boat under way: speed, distance from the leg, fence; and the largest yaw rate that it is ordered.

That is as the mission or the vehicle says, less where the boat turns less: a vehicle reports the limit of its own loop,
what the boat can turn depends on its thrust besides.
"""

import math
from collections.abc import Sequence

from steerway.live.autopilot.fence import Fence, NoGo
from steerway.live.autopilot.mission import Limits
from steerway.live.rows import Row

LASTING = 0.5
"""s for which speed or distance has to be beyond a limit, since an estimate scatters."""
_OFF = "the boat is "
_LONGEST_STEP = 0.2
"""s of a step that count: what was seen once does not last because the step is late."""
WIDE = 3.0
"""Lookaheads off the leg beyond which a boat that was on it has lost it, where the mission gives no limit."""
ACCELERATING = 15.0
"""s after the start, and after a position was held, within which the least speed is not checked."""


class LimitGuard:
    """Checks each step; counts for how long a limit is exceeded.

    Where the mission gives no cross-track limit there is a usual one, for a boat that was on its leg; and so is that of
    the mission for one that comes back to its leg.
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
        """The autopilot is started."""
        self._under_way = 0.0
        self._beyond = 0.0
        self._is_off_route = False
        self._was_near = self._is_given

    def rejoin(self) -> None:
        """The boat comes back to its leg from wherever it was led: the limit counts from the leg on."""
        self._was_near = False

    def obstacle(self, row: Row, cross_track: float) -> str:
        """Why not to start here, so many m off the leg; "" for no reason."""
        return self._left(row) or self._beyond_limit(row, cross_track, 0.0)

    @property
    def is_off_route(self) -> bool:
        """Whether the last step stopped for the distance from the leg."""
        return self._is_off_route

    def step(self, row: Row, cross_track: float, is_held: bool, dt: float) -> str:
        """Why to stop, "" while all limits are kept. is_held: whether a position is held."""
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
"""Limit of the ordered yaw rate, rad/s, while neither the mission nor the vehicle gives one."""
MOST = math.radians(60.0)
"""Largest ordered yaw rate of a vehicle that reports its limit, rad/s. Chosen: on squares at 2 m/s corners are then
within 1.5 m."""
_SHARE = 0.75
"""Largest ordered yaw rate over the vehicle's limit: its own loop needs the rest. Chosen."""
_LEAST = math.radians(8.0)
"""Least value of the limit, rad/s."""
_RESPONSE = 0.8
"""Time constant with which the yaw rate should follow an order, with the delay of a fix, s. Chosen."""
_SHORT, _SHORT_FOR = 0.6, 0.5
"""A turn falls short where the yaw rate is below this share of the expected one for so many s."""
_DRIVEN = 0.4
"""Least share of full thrust with which a turn that falls short lowers the limit for later turns: a rudder turns less
without thrust."""
_ENDING = 0.9
"""An order below this share of the expected yaw rate ends the turn. Chosen: the expected rate approaches an order at
the limit from above, so that with 1 the limit could not grow again within a turn."""
_REGAINED = 0.1
"""Relative growth of the limit while the boat turns as expected, 1/s."""
_AT_ONCE = 0.5
"""Relative growth, 1/s, of a limit that little thrust lowered in this turn, up to the limit for later turns. Chosen."""


class TurnLimit:
    """The largest yaw rate to order, lowered where a gyro shows that the boat turns less than ordered.

    declared: limit of the mission, rad/s; None: the vehicle's own limit is used."""

    def __init__(self, declared: float | None = None):
        self._declared = declared
        self._told = self._able = self._most = UNTOLD if declared is None else declared
        self._expected = self._ordered = self._short = self._thrust = self._driven = 0.0

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

    def order(self, yaw_rate: float, thrust: float, dt: float, throttle: float = math.nan) -> None:
        """The yaw rate (rad/s) and the share of full thrust ordered over the last dt s; NaN: none.

        throttle: share of full that the vehicle's motors have, NaN where it reports none.
        """
        share = -math.expm1(-dt / _RESPONSE)
        self._ordered = yaw_rate if math.isfinite(yaw_rate) else 0.0
        self._expected += share * (self._ordered - self._expected)
        thrust = thrust if math.isfinite(thrust) else 0.0
        self._thrust += share * (thrust - self._thrust)
        self._driven += share * (min(thrust, throttle) - self._driven)  # the thrust itself where throttle is NaN

    def turned(self, yaw_rate: float, dt: float) -> None:
        """A yaw rate was measured (rad/s; NaN: none), dt s after the one before."""
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
