"""Whether the estimate can be steered by: its fixes, their clock, the links. It judges; the autopilot acts."""

import math
from collections import deque
from itertools import pairwise

from steerway.core.checks import positive
from steerway.core.records import STATUSES
from steerway.live.clock import FixClock
from steerway.live.heard import Row

LATE_TICK = 0.5
"""s between two steps above which the service does not keep time."""
SETTLED = 3.0
"""s for which nothing may be wrong before the autopilot is ready."""
LARGEST_COURSE_STD = math.radians(30.0)
"""rad, of a course that is worth steering by from the start."""
LARGEST_NIS = 6.0
"""Mean NIS of late fixes above which estimate and fixes contradict each other; 2 where the profile fits."""
UNFIT, LONGEST_UNFIT = 0.75, 1.5
"""s of unbroken rejections after which to stop, and of slow fixes, of which three are waited for at most that long: the
filter believes the fixes after 2 s and jumps to them."""
UNTIMELY = 0.7
"""s for which the receiver's time may stand still, lag or stray."""
UNKNOWN = 3.0
"""s for which fixes may come and the course be unknown, as after a gap; the reference is followed meanwhile."""
STEP = 0.5
"""s by which the receiver's time may run ahead from one fix to the next."""
LAG = 2.0
"""s by which fixes may come later than the promptest of them."""

_REJECTED = STATUSES.index("rejected")
_KEPT = 20  # fixes by which interval and NIS are judged


class Watch:
    """One step a tick; `fix` between steps. `patience`: s without a fix for which dead reckoning is allowed."""

    def __init__(self, patience: float = 10.0):
        self.patience = positive("patience", patience)
        self.settled = 0.0  # s since something was wrong
        self._now = 0.0
        self._event = ""
        self._links: dict[str, bool] = {}
        self._nis: deque[float] = deque(maxlen=_KEPT)
        self._times: deque[float] = deque(maxlen=_KEPT)
        self._clock = FixClock()
        self._accepted = self._accepted_time = math.nan  # when the last good fix was heard, and its own time
        self._advanced = math.nan  # when a fix was last later than the one before
        self._unfit_since = self._unknown_since = self._late_since = self._astray_since = math.nan

    @property
    def interval(self) -> float:
        """Median interval of late fixes, s; NaN before there are two."""
        intervals = sorted(later - earlier for earlier, later in pairwise(self._times))
        return intervals[len(intervals) // 2] if intervals else math.nan

    def link(self, name: str, alive: bool) -> None:
        """Whether the other end of a link is there."""
        self._links[name] = alive

    def fix(self, row: Row) -> None:
        """A fix was taken, or rejected by the filter's gate."""
        self._astray_since = math.nan
        self._judge_time(row.time)
        if row.status == _REJECTED:
            self._unfit_since = _since(self._unfit_since, self._now)
            return
        self._unfit_since = math.nan
        self._unknown_since = _since(self._unknown_since, self._now) if math.isnan(row.cog) else math.nan
        self._accepted, self._accepted_time = self._now, row.time
        if not math.isnan(row.nis):
            self._nis.append(row.nis)

    def astray(self) -> None:
        """A position was heard whose time does not follow that of the last fix."""
        self._astray_since = _since(self._astray_since, self._now)

    def step(self, row: Row, dt: float) -> str:
        """What makes it impossible to steer, "" when nothing does."""
        self._now += dt
        if dt > LATE_TICK:
            self._event = f"the service was late by {dt:.1f} s"
            self._forget_clock()
        trouble, self._event = self._event or self._lasting_trouble(row), ""
        self.settled = 0.0 if trouble or self._obstacle_now(row) else self.settled + dt
        return trouble

    def doubt(self, row: Row) -> str:
        """What makes steering less than sound, "" when nothing does."""
        if self._is_blind(row):
            return f"no fix for {self._age(row):.0f} s, by dead reckoning"
        if not math.isnan(self._unfit_since):
            return "fixes do not fit the estimate"
        return "the course is not known" if math.isnan(row.cog) else ""

    def obstacle(self, row: Row) -> str:
        """Why not to start yet, "" when there is nothing against it."""
        now = self._obstacle_now(row)
        if now or self.settled >= SETTLED:
            return now
        return f"all has been well for {self.settled:.1f} s, {SETTLED:g} s are wanted"

    def _obstacle_now(self, row):
        if math.isnan(self._accepted) or not row.valid:
            return "no position yet" if math.isnan(self._accepted) else "no position"
        if math.isnan(row.cog):
            return "the course is not known, she has no way"
        if not row.cog_std <= LARGEST_COURSE_STD:
            return f"the course is known to {math.degrees(row.cog_std):.0f}° only"
        mean = sum(self._nis) / len(self._nis) if len(self._nis) == _KEPT else 0.0
        if mean > LARGEST_NIS:
            return f"fixes scatter more than the profile says, a mean NIS of {mean:.1f} where 2 is expected"
        return self._lost_link() or self.doubt(row)

    def _lasting_trouble(self, row):
        age = self._age(row)
        if age > self.patience:
            return f"no fix for {age:.1f} s"
        if self._now - self._unfit_since >= self._allowed_unfit:
            return f"fixes do not fit the estimate for {self._now - self._unfit_since:.1f} s"
        if self._accepted >= self._advanced + UNTIMELY:
            return "the receiver's time stands still"
        if self._now - self._astray_since >= UNTIMELY:
            return "the receiver's time has stepped"
        if self._now - self._late_since >= UNTIMELY:
            return f"fixes come more than {LAG:g} s late"
        if self._now - self._unknown_since >= UNKNOWN:
            return "the course is not known"
        return self._lost_link()

    @property
    def _allowed_unfit(self):
        interval = self.interval
        return min(max(UNFIT, 3.0 * interval), LONGEST_UNFIT) if math.isfinite(interval) else UNFIT

    def _lost_link(self):
        return next((f"link {name} is lost" for name, alive in self._links.items() if not alive), "")

    def _judge_time(self, time):
        ahead = time - self._clock.now(self._now)
        if ahead > STEP or (self._times and time < self._times[-1]):
            self._event = f"the receiver's time stepped by {ahead:+.1f} s"
            self._forget_clock()
        self._clock.hear(time, self._now)
        if not self._times or time > self._times[-1]:
            self._times.append(time)
            self._advanced = self._now
        self._late_since = _since(self._late_since, self._now) if ahead < -LAG else math.nan

    def _forget_clock(self):
        self._clock.forget()
        self._times.clear()
        self._late_since = math.nan

    def _age(self, row):
        """s since the last fix that was believed, by this clock and by that of the receiver; NaN before the first."""
        by_receiver = row.time - self._accepted_time
        age = self._now - self._accepted
        return max(age, by_receiver) if math.isfinite(by_receiver) else age

    def _is_blind(self, row):
        """Whether fixes stay away for longer than they use to."""
        interval = self.interval
        return not self._age(row) <= (max(1.0, 3.0 * interval) if math.isfinite(interval) else 1.0)


def _since(before, now):
    return now if math.isnan(before) else before
