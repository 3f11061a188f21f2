"""Monitors fixes, their clock, the estimate and the links, on which steering depends. The supervisor acts on it."""

import math
from collections import deque
from itertools import pairwise

from steerway.core.checks import positive
from steerway.core.records import STATUSES
from steerway.live.rows import Row
from steerway.live.tick_timing import FixClock

LATE_TICK = 0.5
"""Interval between two steps above which the service is late, s."""
LONGEST_LATE, FORGIVEN = 2.0, 0.1
"""Largest sum of late intervals, s; rate at which the sum falls, s per second. In a late interval the boat follows the
last order, and the estimate assumes this. Chosen: below the 3 s after which ArduPilot drops an order."""
SETTLED = 3.0
"""Time without trouble before the autopilot is ready, s."""
LARGEST_COURSE_STD = math.radians(30.0)
"""Largest 1σ of the course at the start, rad."""
LARGEST_NIS = 6.0
"""Mean NIS of recent fixes above which the profile does not fit them; 2 is expected."""
UNFIT, LONGEST_UNFIT = 0.75, 1.5
"""Shortest and longest time (s) of rejected fixes after which the autopilot stops. Between these bounds it is three
intervals of fixes. Chosen: after 2 s the filter accepts the rejected fixes, and its position jumps."""
UNTIMELY = 0.7
"""Longest time for which the receiver's time may stand still, lag or be out of order, s."""
UNKNOWN = 3.0
"""Longest time for which the course may be unknown while fixes arrive, as after a gap, s. The trim is then held."""
STEP = 0.5
"""Largest forward jump of the receiver's time from one fix to the next, s."""
LAG = 2.0
"""Largest delay of fixes compared with the least delayed one, s."""

_REJECTED = STATUSES.index("rejected")
_KEPT = 20  # number of newest fixes that give the median interval and the mean NIS


class Watch:
    """Call `step` at each tick, and `fix` between steps. `max_dead_reckoning`: longest time without a fix, s."""

    def __init__(self, max_dead_reckoning: float = 10.0):
        self.max_dead_reckoning = positive("max_dead_reckoning", max_dead_reckoning)
        self.settled = 0.0  # s since the last trouble
        self.interval = math.nan  # median interval of recent fixes, s; NaN before the second fix
        self._now = 0.0
        self._knows_orders = False
        self._event = ""
        self._links: dict[str, bool] = {}
        self._late = self._lateness = 0.0  # sum of late intervals, reduced by FORGIVEN per second, and the last one, s
        self._nis: deque[float] = deque(maxlen=_KEPT)
        self._times: deque[float] = deque(maxlen=_KEPT)
        self._clock = FixClock()
        self._accepted = self._accepted_time = math.nan  # arrival of the last accepted fix, and its own time
        self._advanced = math.nan  # when the receiver's time last advanced
        self._unfit_since = self._unknown_since = self._late_since = self._untimely_since = math.nan

    def link(self, name: str, alive: bool) -> None:
        """Take whether the peer of a link answers."""
        self._links[name] = alive

    def fix(self, row: Row, fits: bool | None = None, since: float = 0.0) -> None:
        """Take a fix, `since` s after the last step.

        fits: whether the fix fits the autopilot's own estimate; None without this estimate. Rejections by the
        navigator's filter only count if `fits` is None, because that filter does not use the ordered turns.
        """
        self._untimely_since = math.nan
        self._judge_time(row.time, self._now + since)
        self._knows_orders = fits is not None
        if row.status == _REJECTED if fits is None else not fits:
            self._unfit_since = _since(self._unfit_since, self._now)
            return
        self._unfit_since = math.nan
        lost = math.isnan(row.cog) and not self._knows_orders
        self._unknown_since = _since(self._unknown_since, self._now) if lost else math.nan
        self._accepted, self._accepted_time = self._now, row.time
        if not math.isnan(row.nis) and not self._knows_orders:
            self._nis.append(row.nis)

    def untimely(self) -> None:
        """Note a position whose time does not follow the time of the last fix."""
        self._untimely_since = _since(self._untimely_since, self._now)

    def step(self, row: Row, dt: float) -> str:
        """Take a step; return why to stop, "" for no reason."""
        self._now += dt
        self._judge_lateness(dt)
        trouble, self._event = self._event or self._lasting_trouble(row), ""
        self.settled = 0.0 if trouble or self._obstacle_now(row) else self.settled + dt
        return trouble

    def degradation(self, row: Row) -> str:
        """Why steering is degraded; "" if it is not."""
        if self._is_blind(row):
            return f"no fix for {self._age(row):.0f} s, by dead reckoning"
        if not math.isnan(self._unfit_since):
            return "fixes do not fit the estimate"
        if self._late > 0.0:
            return f"the service was late by {self._lateness:.1f} s"
        return "the course is not known" if math.isnan(row.cog) and not self._knows_orders else ""

    def obstacle(self, row: Row) -> str:
        """Why not to start yet; "" for no reason."""
        now = self._obstacle_now(row)
        if now or self.settled >= SETTLED:
            return now
        return f"no trouble for {self.settled:.1f} s, expected {SETTLED:g} s"

    def _obstacle_now(self, row: Row) -> str:
        if math.isnan(self._accepted) or not row.valid:
            return "no position yet" if math.isnan(self._accepted) else "no position"
        if self._knows_orders:
            return self._lost_link() or self.degradation(row)
        if math.isnan(row.cog):
            return "the course is not known, the boat is below steerageway"
        if not row.cog_std <= LARGEST_COURSE_STD:
            return f"the course is known to ± {math.degrees(row.cog_std):.0f}° only"
        mean = sum(self._nis) / len(self._nis) if len(self._nis) == _KEPT else 0.0
        if mean > LARGEST_NIS:
            return f"fixes scatter more than the profile expects, the mean NIS is {mean:.1f}, expected about 2"
        return self._lost_link() or self.degradation(row)

    def _lasting_trouble(self, row: Row) -> str:
        age = self._age(row)
        if age > self.max_dead_reckoning:
            return f"no fix for {age:.1f} s"
        if not row.valid and math.isfinite(self._accepted):
            return "the estimate is no number"
        if self._now - self._unfit_since >= self._allowed_unfit:
            return f"fixes do not fit the estimate for {self._now - self._unfit_since:.1f} s"
        if self._accepted >= self._advanced + UNTIMELY:
            return "the receiver's time stands still"
        if self._now - self._untimely_since >= UNTIMELY:
            return "the receiver's time has stepped"
        if self._now - self._late_since >= UNTIMELY:
            return f"fixes come more than {LAG:g} s late"
        if self._now - self._unknown_since >= UNKNOWN:
            return "the course is not known"
        return self._lost_link()

    @property
    def _allowed_unfit(self) -> float:
        interval = self.interval
        return min(max(UNFIT, 3.0 * interval), LONGEST_UNFIT) if math.isfinite(interval) else UNFIT

    def _lost_link(self) -> str:
        return next((f"link {name} is lost" for name, alive in self._links.items() if not alive), "")

    def _judge_lateness(self, dt: float) -> None:
        """Add a late step; a sum above `LONGEST_LATE` stops. Other troubles do not grow older during a late step."""
        if dt <= LATE_TICK:
            self._late = max(self._late - FORGIVEN * dt, 0.0)
            return
        self._late, self._lateness = self._late + dt, dt
        self._unfit_since += dt
        self._unknown_since += dt
        self._late_since += dt
        self._untimely_since += dt
        if self._late > LONGEST_LATE:
            self._event = f"the service was late by {self._late:.1f} s"
            self._late = 0.0
            self._forget_clock()

    def _judge_time(self, time: float, now: float) -> None:
        ahead = time - self._clock.now(now)
        if ahead > STEP or (self._times and time < self._times[-1]):
            self._event = f"the receiver's time stepped by {ahead:+.1f} s"
            self._forget_clock()
        self._clock.add(time, now)
        if not self._times or time > self._times[-1]:
            self._times.append(time)
            self._advanced = self._now
            intervals = sorted(later - earlier for earlier, later in pairwise(self._times))
            self.interval = intervals[len(intervals) // 2] if intervals else math.nan
        self._late_since = _since(self._late_since, self._now) if ahead < -LAG else math.nan

    def _forget_clock(self) -> None:
        self._clock.forget()
        self._times.clear()
        self.interval = math.nan
        self._late_since = math.nan

    def _age(self, row: Row) -> float:
        """Time since the last accepted fix, s, by this clock or the receiver's: the larger. NaN before the first."""
        by_receiver = row.time - self._accepted_time
        age = self._now - self._accepted
        return max(age, by_receiver) if math.isfinite(by_receiver) else age

    def _is_blind(self, row: Row) -> bool:
        """Whether fixes are missing: no fix for three usual intervals, and for at least 1 s."""
        interval = self.interval
        return not self._age(row) <= (max(1.0, 3.0 * interval) if math.isfinite(interval) else 1.0)


def _since(before: float, now: float) -> float:
    return now if math.isnan(before) else before
