"""What is said of the boat, out of what instruments say: rows in as they come, rows out at the fixes or at any time.

No clock of its own and no I/O: a replayed log and a live link give the same rows. The filter only ever goes from fix to
fix, as `estimate` does; rows between and ahead of fixes are predicted from a copy, so that asking changes nothing.
"""

import math
from collections import Counter, deque
from typing import NamedTuple

import numpy as np

from steerway.core.checks import not_negative, positive
from steerway.core.records import REJECTED
from steerway.estimation.course.filter import FiveStateFilter
from steerway.estimation.course.motion.layout import LONGEST_GAP
from steerway.estimation.profiles import AIDS, Profile
from steerway.live.choice import SourceChoice
from steerway.live.heard import Heard, Row, lost

STEP = 60.0
"""s: a time so far from the last one, forward or back, is believed when a second one confirms it."""
AHEAD = 1.0
"""s: so is one that leaves a gap, and is so far ahead of the present where that is known."""
_LEAD, _LEAD_S = 0.3, 0.1
"""Intervals, and s, by which a fix may be ahead of the present; where one was further, a log is played in haste, and
what is next ahead may be a gap in it."""
_BEHIND, _BEHIND_ROWS = 1.0, 3
"""s and fixes in unbroken order, all behind those taken: not late any more, the receiver's clock has been set back."""

MEETS = 1e-4
"""s from a fix within which a row asked for is the row of the fix."""


class _Taken(NamedTuple):
    """A row the filter has taken, and the filter before it."""

    time: float
    latitude: float
    longitude: float
    position_std: float
    aids: tuple[float, ...]
    before: np.ndarray


class Navigator:
    """The estimate aboard.

    profile, aid: as of `FiveStateFilter`.
    sources:  names of sources in order of priority; see `SourceChoice`.
    patience: s without a fix for which the motion is dead-reckoned; then nothing is said.
    rate:     Hz at whose multiples the filter makes a step, as `estimate` does when it gives rows at a rate; without it
        the filter steps from fix to fix.
    recall:   s by which a fix may be late and still be taken at its own time.
    accuracy: whether what receivers say of the accuracy of their fixes counts.

    When the receiver's clock steps, the motion goes on as if it had not, unless the position says otherwise.

    `counts` tells what became of rows: taken, late (taken at their own time), too late (dropped), stray (one time far
    from all others), clock steps, other source, told twice.
    """

    def __init__(
        self,
        profile: Profile | str = "small-usv",
        aid: tuple[str, ...] = (),
        sources: tuple[str, ...] = (),
        patience: float = 10.0,
        recall: float = 5.0,
        rate: float | None = None,
        accuracy: bool = True,
    ):
        self.filter = FiveStateFilter(profile, aid)
        self.choice = SourceChoice(sources)
        self.patience = positive("patience", patience)
        self.recall = not_negative("recall", recall)
        self.rate = None if rate is None else positive("rate", rate)
        self.accuracy = accuracy
        self.counts: Counter = Counter()
        self.fix_time = math.nan
        self._time = math.nan
        self._taken: deque[_Taken] = deque()
        self._astray: Heard | None = None
        self._behind: list[Heard] = []
        self._lead = math.nan
        self._before_behind = self.filter.snapshot(), math.nan
        self._row = lost(math.nan)
        self._ahead = FiveStateFilter(self.filter.profile, aid)
        self._ahead_time = math.nan
        self._receiver = ""
        self._teller = self.filter  # which filter said the last row

    @property
    def last_fix(self) -> Row:
        """The row of the last fix in order."""
        return self._row

    @property
    def position_covariance(self) -> tuple[float, float, float]:
        """Of the position said last: variance of north, covariance, variance of east, m²."""
        covariance = self._teller.covariance
        return float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])

    @property
    def strayed(self) -> int:
        """How many rows had a time that did not follow: older than the one before, or far ahead and not confirmed."""
        return self.counts["late"] + self.counts["too late"] + self.counts["stray"] + (self._astray is not None)

    def hear(self, heard: Heard, present: float = math.nan) -> list[Row]:
        """Take what was said; the rows that are new by it: one a fix in order, none for anything else.

        `present` is the time of which a fix could be that comes now without delay, NaN in a replay: by it a dropout is
        told from a clock that stepped.
        """
        if not math.isfinite(heard.time):
            return []
        place = (heard.latitude, heard.longitude) if heard.has_position else (math.nan, math.nan)
        now = heard.time if math.isnan(present) else present
        if heard.has_position and not self.choice.takes(heard, now):
            self.counts["other source"] += 1
            place = math.nan, math.nan
        aids = self._aids(heard, now)
        if math.isnan(place[0]) and all(map(math.isnan, aids)):
            return []
        news, aids = self._news(heard.time, place, aids)
        if news != place and heard.time == self._time:
            return self._again(heard.time, aids)
        place = news
        if math.isnan(place[0]) and all(map(math.isnan, aids)):
            self.counts["told twice"] += 1
            return []
        std = heard.position_std if self.accuracy else math.nan
        heard = heard._replace(latitude=place[0], longitude=place[1], position_std=std)
        return self._in_time(heard, aids, heard.time - present)

    def at(self, time: float) -> Row:
        """What is said of a time: predicted from the last fix, nothing when that is too long ago."""
        if math.isnan(self._time) or not time - self.fix_time <= self.patience:
            return lost(time)
        if abs(time - self._row.time) < MEETS:
            self._teller = self.filter
            return self._row
        self._teller = self._ahead
        if self.rate is None or not self._ahead_time <= time:
            self._ahead.restore(self.filter.snapshot())
            self._ahead_time = self._time
        said, _, status = self._ahead.row(self._approach(self._ahead, self._ahead_time, time))
        self._ahead_time = max(time, self._ahead_time)
        return _row(self._ahead_time, said, math.nan, status)

    def finish(self) -> list[Row]:
        """Nothing more will be heard: what waited for confirmation is believed."""
        held, self._astray = self._astray, None
        return [] if held is None or held.time < self._time else self._take(held, self._aids(held, held.time))

    def _aids(self, heard, now):
        """The aids in the order of AIDS that this row may give."""
        wanted = self.filter.aid
        return tuple(
            value if name in wanted and not math.isnan(value) and self.choice.gives(name, heard, now) else math.nan
            for name, value in ((name, getattr(heard, name)) for name in AIDS)
        )

    def _again(self, time, aids):
        """The row of a fix that has been taken already; new are at most aids that it comes with."""
        self.counts["told twice"] += 1
        return [self._step(time, math.nan, math.nan, math.nan, aids)._replace(status=self._row.status)]

    def _news(self, time, place, aids):
        """What of place and aids no row taken of the same time has said."""
        for taken in reversed(self._taken):
            if taken.time < time:
                break
            if taken.time == time:
                place = (math.nan, math.nan) if place == (taken.latitude, taken.longitude) else place
                aids = tuple(math.nan if a == b else a for a, b in zip(aids, taken.aids, strict=True))
        return place, aids

    def _in_time(self, heard, aids, surplus):
        """Take a row where its time belongs: next, or back among those taken already, or nowhere."""
        ahead = 0.0 if math.isnan(self._time) else heard.time - self._time
        lead, surplus = surplus, surplus if self._lead <= max(_LEAD * self.choice.interval, _LEAD_S) else math.nan
        too_early = ahead > self.choice.silence and surplus > AHEAD
        if too_early or ahead < -STEP or (ahead > STEP and math.isnan(surplus)):
            return self._doubted(heard, aids, surplus)
        self._astray = None
        if ahead >= 0.0:
            self._behind, self._lead = [], lead if heard.has_position else self._lead
            return self._take(heard, aids)
        if heard.has_position and self._is_set_back(heard):
            return self._stepped(self._behind, surplus)
        if self._taken and heard.time >= self._taken[0].time:
            self.counts["late"] += 1
            self._insert(heard, aids)
        else:
            self.counts["too late"] += 1
        return []

    def _doubted(self, heard, aids, surplus):
        """A time far from the last: a fix is held until the next one agrees with it."""
        held, self._astray = self._astray, heard if heard.has_position else None
        if held is None or not 0.0 <= heard.time - held.time <= STEP:
            self.counts["stray"] += held is not None or not heard.has_position
            return []
        self._astray = None
        if math.isnan(surplus) and held.time > self._time:
            return [row for each in (held, heard) for row in self._take(each, self._aids(each, each.time))]
        return self._stepped([held, heard], surplus)

    def _is_set_back(self, heard):
        """Whether fixes have come from the past, and nothing else, for too long to be late."""
        if not self._behind or heard.time <= self._behind[-1].time:
            self._behind, self._before_behind = [], (self.filter.snapshot(), self._time)
        self._behind.append(heard)
        is_long = heard.time - self._behind[0].time >= _BEHIND and len(self._behind) >= _BEHIND_ROWS
        if is_long:
            snapshot, self._time = self._before_behind
            self.filter.restore(snapshot)
        return is_long

    def _stepped(self, rows, by):
        """The clock has stepped by so much before these rows; unknown: so that the first comes one interval after."""
        self.counts["clock steps"] += 1
        if math.isnan(by):
            by = 2.0 * rows[0].time - rows[1].time - self._time
        self._time += by
        self.choice.shift(by)
        self._taken.clear()
        self._behind = []
        said = self._take(rows[0], self._aids(rows[0], rows[0].time))
        if said and said[0].status == REJECTED:
            self.filter.reset()
            self._taken.clear()
            said = self._take(rows[0], self._aids(rows[0], rows[0].time))
        return said + [row for each in rows[1:] for row in self._take(each, self._aids(each, each.time))]

    def _take(self, heard, aids):
        if heard.has_position and heard.source != self._receiver:
            self.filter.change_receiver()
            self._receiver = heard.source
        row = self._step(heard.time, heard.latitude, heard.longitude, heard.position_std, aids)
        while self._taken and self._taken[0].time < heard.time - self.recall:
            self._taken.popleft()
        if not heard.has_position:
            return []
        self.counts["taken"] += 1
        self.fix_time = heard.time
        self._row = row
        return [row]

    def _step(self, time, latitude, longitude, position_std, aids):
        self._taken.append(_Taken(time, latitude, longitude, position_std, aids, self.filter.snapshot()))
        dt = self._approach(self.filter, self._time, time)
        said, nis, status = self.filter.row(dt, latitude, longitude, aids, position_std)
        self._time = time
        self._ahead_time = math.nan
        return _row(time, said, nis, status)

    def _insert(self, heard, aids):
        """Go back to before a late row, take it, and take again what came after it."""
        later = []
        while self._taken and self._taken[-1].time > heard.time:
            later.append(self._taken.pop())
        self.filter.restore(later[-1].before)
        self._time = self._taken[-1].time
        self._step(heard.time, heard.latitude, heard.longitude, heard.position_std, aids)
        for taken in reversed(later):
            self._step(taken.time, taken.latitude, taken.longitude, taken.position_std, taken.aids)

    def _approach(self, estimator, start, stop):
        """Predict from start to the last step of the rate's grid before stop; the s that remain."""
        if math.isnan(start):
            return 0.0
        if self.rate is not None and stop - start <= LONGEST_GAP:
            for k in range(math.ceil(start * self.rate), math.floor(stop * self.rate) + 1):
                step = k / self.rate
                if start + MEETS <= step <= stop - MEETS:
                    estimator.predict(step - start)
                    start = step
        return max(stop - start, 0.0)


def _row(time, said, nis, status):
    return Row(time, *said, nis, status)
