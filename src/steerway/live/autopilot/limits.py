"""Limits of a boat under way: speed, distance from the leg, fence."""

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

    def _left(self, row):
        if not row.valid:
            return ""
        here = row.latitude, row.longitude, row.sog, row.cog
        return next(filter(None, (each.trouble(*here) for each in self._areas)), "")

    def _beyond_limit(self, row, cross_track, low):
        if row.sog > self._high:
            return f"speed is {row.sog:.2f} m/s, the limit {self._high:g} m/s"
        if row.sog < low:
            return f"speed is {row.sog:.2f} m/s, the least {low:g} m/s"
        if abs(cross_track) > self._wide and self._was_near:
            return f"{_OFF}{abs(cross_track):.1f} m off the leg, the limit {self._wide:g} m"
        return ""


def widest(limits: Limits, lookahead: float) -> float:
    """m off the leg: the mission's limit, or the usual one."""
    return limits.cross_track or WIDE * lookahead
