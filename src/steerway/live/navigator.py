"""Navigation: takes input rows as they arrive and gives estimates at the fixes or at any other time.

No clock and no I/O: a replayed log and a live link give the same rows. The filter steps from fix to fix, as `estimate`
does. A copy of the filter predicts the rows between and after fixes, so that requesting them changes no estimate.
"""

import math
from collections import Counter, deque
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from steerway.core.checks import not_negative, positive
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import NO_COURSE, OK, REJECTED
from steerway.core.slow_error import USUAL_STD, slow_std
from steerway.estimation.fit.auto_aids import AUTO, velocity_parts
from steerway.estimation.learning import LearningFilter
from steerway.estimation.stream import FiveStateFilter
from steerway.estimation.vessel.aids import AIDS
from steerway.estimation.vessel.profile import Profile, profile_of
from steerway.live.rows import InputRow, Row, lost
from steerway.live.source_choice import SourceChoice

STEP = 60.0
"""Largest difference in time between two fixes, s. A fix beyond it is held until the next fix confirms it."""
AHEAD = 1.0
"""Largest time (s) by which a fix after a gap may be ahead of a known present. A fix beyond it is held likewise."""
_LEAD, _LEAD_S = 0.3, 0.1
"""Largest time by which a fix may be ahead of the present: _LEAD intervals or _LEAD_S s, if that is longer. After a
larger lead the present is treated as unknown: a log is being replayed faster than recorded, and may have gaps."""
_BEHIND, _BEHIND_ROWS = 1.0, 3
"""Least span (s) and number of fixes that show a receiver's clock set back. All are older than the last used fix, but
in order."""

MEETS = 1e-4
"""Largest difference between a requested time and a fix at which the row of the fix is output, s."""

Place = tuple[float, float]
Aids = tuple[float, ...]


class _Used(NamedTuple):
    """A row that the filter has used, and the filter's state before it."""

    time: float
    latitude: float
    longitude: float
    position_std: float
    aids: tuple[float, ...]
    before: Any


class Navigator:
    """The estimate aboard: chooses sources, orders fixes in time, and steps or predicts the filter.

    profile: as in `FiveStateFilter`, or a filter that learns its profile.
    aid: as in `FiveStateFilter`; "auto" as in `filter_of`.
    sources:  names of sources in order of priority; see `SourceChoice`.
    max_dead_reckoning: longest time without a fix for which the motion is predicted, s; afterwards it is unknown.
    rate:     Hz; the filter also steps at every multiple of 1/rate, as `estimate` does when it gives rows at a rate.
        None: it steps from fix to fix.
    recall:   largest delay of a late fix that is still used at its own time, s.
    accuracy: whether the reported accuracy of fixes is used.
    lag:      time by which the rows of fixes are delayed and smoothed by later fixes, s; 0 for none.

    After a step of the receiver's clock, the motion continues without a gap unless the position contradicts this.

    `counts`: numbers of rows by kind: used; late (used at their own time); too late (dropped); stray (a time far from
    all others); clock steps; other source; repeated.
    """

    def __init__(
        self,
        profile: Profile | LearningFilter | str | None = None,
        aid: tuple[str, ...] = (),
        sources: tuple[str, ...] = (),
        max_dead_reckoning: float = 10.0,
        recall: float = 5.0,
        rate: float | None = None,
        accuracy: bool = True,
        lag: float = 0.0,
    ):
        self.filter = profile if isinstance(profile, LearningFilter) else filter_of(profile, aid)
        self.lag = not_negative("lag", lag)
        if lag:
            self.filter.wait(lag)
        self.choice = SourceChoice(sources)
        self.max_dead_reckoning = positive("max_dead_reckoning", max_dead_reckoning)
        self.recall = not_negative("recall", recall)
        self.rate = None if rate is None else positive("rate", rate)
        self.accuracy = accuracy
        self.counts: Counter[str] = Counter()
        self.fix_time = math.nan
        self._time = math.nan
        self.last_input: InputRow | None = None  # the last row with a position that was used in order
        self._used: deque[_Used] = deque()
        self._stray: InputRow | None = None
        self._behind: list[InputRow] = []
        self._lead = math.nan
        self._before_behind = self.filter.snapshot(), math.nan
        self._row = lost(math.nan)
        self._ahead = FiveStateFilter(self.filter.profile, self.filter.aid)
        self._ahead_time = math.nan
        self._receiver = ""
        self._slow = USUAL_STD  # 1σ of the receiver's slow error at the last fix, m
        self._last_filter = self.filter  # the filter that gave the last row

    @property
    def last_fix(self) -> Row:
        """The row of the last fix in order."""
        return self._row

    @property
    def position_covariance(self) -> tuple[float, float, float]:
        """Covariance of the last row's position: variance of north, covariance, variance of east, m²."""
        covariance = self._last_filter.position_covariance + self._slow**2 * np.eye(2)
        return float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])

    @property
    def untimely(self) -> int:
        """Number of rows out of time order: older than the row before, or far ahead and not confirmed."""
        return self.counts["late"] + self.counts["too late"] + self.counts["stray"] + (self._stray is not None)

    def add(self, row: InputRow, present: float = math.nan) -> list[Row]:
        """Use an input row and return the new estimates: one per fix in time order, none for other rows.

        `present` is the time of a fix that would arrive now with the lowest latency, NaN in a replay. It distinguishes
        a dropout from a clock step.
        """
        if not math.isfinite(row.time):
            return []
        place = (row.latitude, row.longitude) if row.has_position else (math.nan, math.nan)
        now = row.time if math.isnan(present) else present
        if row.has_position and not self.choice.uses_position(row, now):
            self.counts["other source"] += 1
            place = math.nan, math.nan
        aids = self._aids(row, now)
        if math.isnan(place[0]) and all(map(math.isnan, aids)):
            return []
        place, aids = self._news(row.time, place, aids)
        if math.isnan(place[0]) and all(map(math.isnan, aids)):
            self.counts["repeated"] += 1
            return []
        std = row.position_std if self.accuracy else math.nan
        row = row._replace(latitude=place[0], longitude=place[1], position_std=std)
        return self._in_time(row, aids, row.time - present)

    def at(self, time: float) -> Row:
        """The estimate at a time (Unix, s): predicted from the last fix, unknown if that fix is too old."""
        if math.isnan(self._time) or not time - self.fix_time <= self.max_dead_reckoning:
            return lost(time)
        if abs(time - self._row.time) < MEETS:
            self._last_filter = self.filter
            return self._row
        self._last_filter = self._ahead
        if self.rate is None or not self._ahead_time <= time:
            self._ahead.restore(self.filter.snapshot())
            self._ahead_time = self._time
        values, _, status = self._ahead.row(self._approach(self._ahead, self._ahead_time, time))
        self._ahead_time = max(time, self._ahead_time)
        return _row(self._ahead_time, values, self._slow, math.nan, status)

    def finish(self) -> list[Row]:
        """At the end of a log, use the row that waits for confirmation; return the last estimates."""
        held, self._stray = self._stray, None
        rows = [] if held is None or held.time < self._time else self._use(held, self._aids(held, held.time))
        return rows + self._smoothed(rest=True)

    def _aids(self, row: InputRow, now: float) -> Aids:
        """The row's aids in the order of AIDS; NaN for aids that are not used from its source."""
        wanted = self.filter.aid
        return tuple(
            value if name in wanted and not math.isnan(value) and self.choice.uses_aid(name, row, now) else math.nan
            for name, value in ((name, getattr(row, name)) for name in AIDS)
        )

    def _news(self, time: float, place: Place, aids: Aids) -> tuple[Place, Aids]:
        """Position and aids, NaN where a used row of the same time has given the same value."""
        for used in reversed(self._used):
            if used.time < time:
                break
            if used.time == time:
                place = (math.nan, math.nan) if place == (used.latitude, used.longitude) else place
                aids = tuple(math.nan if a == b else a for a, b in zip(aids, used.aids, strict=True))
        return place, aids

    def _in_time(self, row: InputRow, aids: Aids, surplus: float) -> list[Row]:
        """Use a row at its own time, after the last used row or between earlier ones; or hold it back; or drop it."""
        ahead = 0.0 if math.isnan(self._time) else row.time - self._time
        lead, surplus = surplus, surplus if self._lead <= max(_LEAD * self.choice.interval, _LEAD_S) else math.nan
        too_early = ahead > self.choice.silence and surplus > AHEAD
        if too_early or ahead < -STEP or (ahead > STEP and math.isnan(surplus)):
            return self._held_back(row, aids, surplus)
        self._stray = None
        if ahead >= 0.0:
            self._behind, self._lead = [], lead if row.has_position else self._lead
            return self._use(row, aids)
        if row.has_position and self._is_set_back(row):
            return self._stepped(self._behind, surplus)
        if self._used and row.time >= self._used[0].time:
            self.counts["late"] += 1
            self._insert(row, aids)
        else:
            self.counts["too late"] += 1
        return []

    def _held_back(self, row: InputRow, aids: Aids, surplus: float) -> list[Row]:
        """Hold a fix whose time is far from the last one until the next fix confirms it."""
        held, self._stray = self._stray, row if row.has_position else None
        if held is None or not 0.0 <= row.time - held.time <= STEP:
            self.counts["stray"] += held is not None or not row.has_position
            return []
        self._stray = None
        if math.isnan(surplus) and held.time > self._time:
            return [each for late in (held, row) for each in self._use(late, self._aids(late, late.time))]
        return self._stepped([held, row], surplus)

    def _is_set_back(self, row: InputRow) -> bool:
        """Whether the clock was set back: all newest fixes are older than the last used one, over `_BEHIND` s."""
        if not self._behind or row.time <= self._behind[-1].time:
            self._behind, self._before_behind = [], (self.filter.snapshot(), self._time)
        self._behind.append(row)
        is_long = row.time - self._behind[0].time >= _BEHIND and len(self._behind) >= _BEHIND_ROWS
        if is_long:
            snapshot, self._time = self._before_behind
            self.filter.restore(snapshot)
        return is_long

    def _stepped(self, rows: Sequence[InputRow], by: float) -> list[Row]:
        """Use rows after a clock step of `by` s; NaN: the first row follows the last fix by one interval."""
        self.counts["clock steps"] += 1
        if math.isnan(by):
            by = 2.0 * rows[0].time - rows[1].time - self._time
        self._time += by
        self.choice.shift(by)
        self._used.clear()
        self._behind = []
        estimates = self._use(rows[0], self._aids(rows[0], rows[0].time))
        if self._row.time == rows[0].time and self._row.status == REJECTED:
            self.filter.reset()
            self._used.clear()
            estimates = self._use(rows[0], self._aids(rows[0], rows[0].time))
        return estimates + [each for late in rows[1:] for each in self._use(late, self._aids(late, late.time))]

    def _use(self, row: InputRow, aids: Aids) -> list[Row]:
        if row.has_position and row.source != self._receiver:
            self.filter.change_receiver()
            self._receiver = row.source
        estimate = self._step(row.time, row.latitude, row.longitude, row.position_std, aids)
        while self._used and self._used[0].time < row.time - self.recall:
            self._used.popleft()
        if not row.has_position:
            return []
        self.counts["used"] += 1
        self.last_input = row
        self.fix_time = row.time
        self._row = estimate
        return self._smoothed() if self.lag else [estimate]

    def _smoothed(self, rest: bool = False) -> list[Row]:
        """The smoothed rows that are `lag` old; `rest`: all waiting ones."""
        return [
            _row(self._time - age, values, self._slow, math.nan, NO_COURSE if math.isnan(values[3]) else OK)
            for age, values in self.filter.lagged(rest)
        ]

    def _step(self, time: float, latitude: float, longitude: float, position_std: float, aids: Aids) -> Row:
        self._used.append(_Used(time, latitude, longitude, position_std, aids, self.filter.snapshot()))
        dt = self._approach(self.filter, self._time, time)
        values, nis, status = self.filter.row(dt, latitude, longitude, aids, position_std)
        if math.isfinite(latitude):
            self._slow = float(slow_std(position_std))
        self._time = time
        self._ahead_time = math.nan
        return _row(time, values, self._slow, nis, status)

    def _insert(self, row: InputRow, aids: Aids) -> None:
        """Restore the filter to its state before a late row, use that row, then use the later rows again."""
        later = []
        while self._used and self._used[-1].time > row.time:
            later.append(self._used.pop())
        self.filter.restore(later[-1].before)
        self._time = self._used[-1].time
        self._step(row.time, row.latitude, row.longitude, row.position_std, aids)
        for used in reversed(later):
            self._step(used.time, used.latitude, used.longitude, used.position_std, used.aids)

    def _approach(self, estimator: Any, start: float, stop: float) -> float:
        """Predict from start to the last multiple of 1/rate before stop; return the remaining time to stop, s."""
        if math.isnan(start):
            return 0.0
        if self.rate is not None and stop - start <= LONGEST_GAP:
            for k in range(math.ceil(start * self.rate), math.floor(stop * self.rate) + 1):
                step = k / self.rate
                if start + MEETS <= step <= stop - MEETS:
                    estimator.predict(step - start)
                    start = step
        return max(stop - start, 0.0)


def filter_of(profile: Profile | str | None, aid: tuple[str, ...] = ()) -> FiveStateFilter:
    """The filter of a profile; "auto" among the aids stands for SOG and COG, if the profile's structures model them."""
    if AUTO in aid:
        aid = tuple(dict.fromkeys(each for each in (*aid, *velocity_parts(profile_of(profile))) if each != AUTO))
    return FiveStateFilter(profile, aid)


def _row(time: float, values: Sequence[float], slow: float, nis: float, status: int) -> Row:
    *motion, relative = values
    return Row._make((time, *motion, math.hypot(relative, slow), relative, nis, status))
