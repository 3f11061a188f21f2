"""FiveStateFilter: a profile as a filter, fix by fix, with the same numbers as `estimate`.

Its structures and their whole state are in `Running`, so that a snapshot is one copy. For rows between and after fixes,
restore the snapshot in another filter and predict with that one. A profile of one mode without further states, aids or
lag runs by the paper's Table 1 (`filter.five_state`), all others by the general filter (`filter.row`).
"""

import math
from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import elapsed, not_negative
from steerway.core.errors import InputError
from steerway.core.records import NO_COURSE, OK, PREDICTED, REJECTED, STARTING, Fixes, Motion
from steerway.estimation.fixed_lag import FixedLag
from steerway.estimation.log.accuracy import variance_scale
from steerway.estimation.log.course import COG, RATE, SOG
from steerway.estimation.log.run import motion_of
from steerway.estimation.log_estimate import estimate
from steerway.estimation.running import Running, Set, output_of, set_of
from steerway.estimation.stream_row import (
    KNOWN,
    NIS,
    SINCE,
    USUAL,
    USUAL_COUNT,
    WRONG,
    note_fix,
    note_interval,
    predict_plain,
    take_plain,
    true_course,
    walk,
)
from steerway.estimation.vessel.aids import AIDS, NO_AIDS, expect_aids
from steerway.estimation.vessel.profile import Profile, prior_profile, profile_of

_NORTH_POLE, _WHOLE_TURN = 0.5 * math.pi + 1e-9, 2.0 * math.pi + 1e-9  # rad, with room for rounding


class FiveStateFilter:
    """Speed over ground, course over ground and course rate from positions, fix by fix or over whole records.

    S. Fossen and T. I. Fossen, Sensors 21, 2021, 7910, extended for real receivers.

    Streaming: `predict(dt)` between fixes at any rate, `update(latitude, longitude)` at each fix (or
    `update_north_east` in a plane of your own), then read the properties. Whole record: `filter(fixes)`,
    `smooth(fixes)`. Filters are independent of one another.

    Args:
        profile: a profile, the name of a built-in one or a .toml file. None for an unknown vessel:
            vessels of every declared kind, with receivers of 0.025 to 6.4 m, are filtered together and weighted by
            their likelihood; a whole record is estimated as by `steerway.estimate`.
        aid: which of "sog", "cog", "heading", "water_speed", "yaw_rate" to use beside positions, where structures of
            the profile have parts for them.
        learns: whether the weights of structures follow the likelihood of the fixes. Without a profile they always do.
        lag: s for which `lagged` waits for later fixes, 0 for none.

    Raises InputError for an unknown profile or aid, and for a negative lag.
    """

    def __init__(
        self,
        profile: Profile | str | None = None,
        aid: tuple[str, ...] = (),
        learns: bool = False,
        lag: float = 0.0,
    ):
        expect_aids(aid)
        self._waiting = FixedLag(lag) if not_negative("lag", lag) > 0.0 else None
        self.aid, self._infers = tuple(aid), profile is None
        self.profile = prior_profile(self.aid) if profile is None else profile_of(profile)
        self._geodetic = True
        self._begin(set_of(self.profile.models(self.aid), learns or self._infers))

    def _begin(self, running: Set) -> None:
        may_be_plain = not self.aid and self._waiting is None
        self._running = Running(running, self.profile.steerageway, may_be_plain)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_running": copy(self._running)}  # so that a copy of a filter has its own state

    def __repr__(self) -> str:
        aided = f", aid={self.aid}" if self.aid else ""
        return f"{type(self).__name__}({self.profile.name!r}{aided}): {self._now()}"

    def _now(self) -> str:
        if not self.started:
            return "not started"
        _, _, sog, cog, rate, sog_std, cog_std, *_ = self.output()
        speed = f"SOG {sog:.2f} ± {sog_std:.2f} m/s"
        if not self.underway:
            return f"{speed}, course not defined"
        course, width = math.degrees(cog) % 360.0, math.degrees(cog_std)
        return f"{speed}, COG {course:.1f} ± {width:.1f}°, course rate {math.degrees(rate):+.2f} °/s (1σ)"

    def reset(self) -> None:
        """Return to the state before the first fix."""
        self.wait(0.0 if self._waiting is None else self._waiting.lag)

    def snapshot(self) -> tuple[Set, Floats]:
        """A copy of the whole state, for `restore` in this filter or another."""
        return self._running.snapshot()

    def restore(self, snapshot: tuple[Set, Floats]) -> None:
        """Return to the state of a `snapshot`."""
        self._running.restore(snapshot)
        if self._waiting is not None:
            self._waiting.drop_after(self._running.elapsed)

    def change_receiver(self) -> None:
        """Forget the usual accuracy of the receiver, since fixes come from another one from now on."""
        self._running.state[USUAL : USUAL_COUNT + 1] = 0.0

    def predict(self, dt: float) -> None:
        """Advance by dt seconds; a negative dt (a clock set back) counts as 0. Raises InputError for an infinite dt."""
        if not 0.0 <= dt < math.inf:
            dt = elapsed("dt", dt)
        running = self._running
        plain = running.plain
        if plain is not None:  # here, not in a method of `running`: another call would take a tenth of the time
            running.is_current = False
            predict_plain(running.state, plain, dt)
            return
        running.state[SINCE] += dt
        self._advance(dt, math.nan, math.nan, 1.0, NO_AIDS)

    def update(self, latitude: float, longitude: float, position_std: float | None = None) -> float:
        """Correct by a fix (rad). Returns its NIS, NaN for the first.

        `position_std` is the accuracy that the receiver reports (m), as in `Fixes`: see `log.accuracy`.

        Raises InputError, a ValueError, for a latitude beyond ±π/2 or a longitude beyond ±2π, such as degrees.
        """
        if abs(latitude) > _NORTH_POLE or abs(longitude) > _WHOLE_TURN:
            raise InputError(
                f"update takes radians: latitude is {latitude:g}, longitude {longitude:g}, expected at most "
                f"±π/2 and ±2π (math.radians of degrees)"
            )
        self._geodetic = True
        return self._take(*walk(self._running.state, latitude, longitude), position_std)

    def update_north_east(self, north: float, east: float, position_std: float | None = None) -> float:
        """Correct by a fix in a fixed plane (m), in place of `update`. Returns its NIS, NaN for the first."""
        self._geodetic = False
        return self._take(north, east, position_std)

    def _take(self, first: float, second: float, position_std: float | None) -> float:
        reported = math.nan if position_std is None else position_std
        running = self._running
        plain = running.plain
        if plain is not None:
            running.is_current = True
            return take_plain(running.state, plain, first, second, reported, running.least_speed, running.room)
        excess = variance_scale(running.state[USUAL : USUAL_COUNT + 1], reported)
        nis, _ = self._fix(0.0, first, second, excess, NO_AIDS)
        return nis

    def _fix(self, dt: float, first: float, second: float, excess: float, aids: Floats) -> tuple[float, float]:
        """Advance by dt and correct by a fix in the plane. Returns its NIS and its probability of an outlier."""
        running = self._running
        note_interval(running.state, dt)
        self._advance(dt, first, second, excess, aids)
        note_fix(running.state, running.settle())
        return running.weighed(NIS), running.weighed(WRONG)

    def aid_by(self, *values: float, **named: float) -> None:
        """Correct by measurements of other instruments (SI, angles in rad from true north; NaN or omitted for unknown).

        By name, or in the order of `AIDS`: sog, cog, heading, water_speed, yaw_rate. Only those of `aid` are used.
        """
        given = dict(zip(AIDS, values, strict=False)) | named
        measured = [given.pop(name, math.nan) for name in AIDS]
        if given or len(values) > len(AIDS):
            raise TypeError(f"aids are {', '.join(AIDS)}; {', '.join(given) or len(values)} given")
        self._advance(0.0, math.nan, math.nan, 1.0, self._aids(measured))

    def _aids(self, aids: Sequence[float] | Floats | None) -> Floats:
        """The values of those in `aid` as a table (1, aids); without any (0, aids)."""
        if not self.aid or aids is None:
            return NO_AIDS
        return np.array([[a if name in self.aid else math.nan for name, a in zip(AIDS, aids, strict=True)]])

    def row(
        self,
        dt: float,
        latitude: float = math.nan,
        longitude: float = math.nan,
        aids: Sequence[float] | Floats | None = None,
        position_std: float = math.nan,
    ) -> tuple[list[float], float, int]:
        """One row of `filter`, streaming: advance by dt (s), then correct by the measurements of that time.

        Args:
            latitude, longitude: of a fix (rad), NaN for none.
            aids: in the order of `AIDS`, NaN for unknown; None for none. Only those of `aid` are used.
            position_std: reported accuracy of the fix (m), NaN for none.

        Returns the list of `output`, the NIS (NaN without a fix) and the status, an index into `records.STATUSES`.
        """
        state, dt = self._running.state, elapsed("dt", dt)
        self._geodetic = True
        table = self._aids(aids)
        fixed = math.isfinite(latitude) and math.isfinite(longitude)
        state[SINCE] += dt
        if fixed and self.profile.structures and self._running.is_copy(latitude, longitude):
            fixed = False
        nis = wrong = math.nan
        if fixed:
            excess = variance_scale(state[USUAL : USUAL_COUNT + 1], position_std)
            nis, wrong = self._fix(dt, *walk(state, latitude, longitude), excess, table)
        else:
            self._advance(dt, math.nan, math.nan, 1.0, table)
            self._running.settle()
        return self.output(), nis, self._status(fixed and not math.isnan(nis), wrong)

    def _status(self, fixed: bool, wrong: float) -> int:
        if not self.started:
            return STARTING
        if wrong > 0.5:
            return REJECTED
        if not self.underway:
            return NO_COURSE
        return OK if fixed else PREDICTED

    def _advance(self, dt: float, first: float, second: float, excess: float, aids: Floats) -> None:
        running = self._running
        running.advance(dt, first, second, excess, aids)
        if self._waiting is not None and (math.isfinite(first) or len(aids)):
            table = aids if len(aids) or not self.aid else np.full((1, len(AIDS)), math.nan)
            self._waiting.add(running, first, second, excess, table)

    def wait(self, lag: float) -> None:
        """Return to the state before the first fix, with another `lag` (s)."""
        self._waiting = FixedLag(lag) if not_negative("lag", lag) > 0.0 else None
        self._begin(self._running.set)

    def lagged(self, rest: bool = False) -> list[tuple[float, list[float]]]:
        """(age in s, smoothed `output`) for the rows that have become `lag` s old since the last call, oldest first.

        Each is smoothed by all later rows. rest: also return rows that are younger, as at the end of a log. The list
        is empty without a lag, and has no rows from before the speed was known.
        """
        if self._waiting is None:
            return []
        now = self._running.elapsed
        ready = self._waiting.due(math.inf if rest else now, self._running.least_speed)
        return [(now - each.time, output_of(each.header, each.estimate, self._geodetic)) for each in ready]

    @property
    def sog(self) -> float:
        """Speed over ground, m/s; NaN until the filter has started."""
        return self._running.estimate().item(SOG) if self.started else math.nan

    @property
    def cog(self) -> float:
        """Course over ground, rad in [−π, π); NaN while it is undefined."""
        return true_course(self._running.state, self._running.estimate()) if self.started else math.nan

    @property
    def course_rate(self) -> float:
        """Rate of the course, rad/s, + to starboard; NaN while the course is undefined."""
        return self._running.estimate().item(RATE) if self.started else math.nan

    @property
    def underway(self) -> bool:
        """Whether the course is defined, which needs steerageway."""
        return self.started and not math.isnan(self._running.estimate().item(COG))

    @property
    def started(self) -> bool:
        """Whether the first fixes have determined the velocity."""
        return self._running.state.item(KNOWN) == 1.0

    @property
    def position(self) -> tuple[float, float]:
        """Latitude and longitude, rad; NaN before the first fix and after `update_north_east`."""
        first, second, *_ = self.output()
        return (first, second) if self._geodetic else (math.nan, math.nan)

    @property
    def position_north_east(self) -> tuple[float, float]:
        """North and east, m, after `update_north_east`; NaN before the first fix and after `update`."""
        first, second, *_ = self.output()
        return (math.nan, math.nan) if self._geodetic else (first, second)

    def output(self) -> list[float]:
        """Position (2), SOG, COG, course rate, 1σ of these three and of position, in the time that one property takes.

        The σ of position is without the receiver's slow error, which positions do not show: see `core.slow_error`.
        """
        return output_of(self._running.state, self._running.estimate(), self._geodetic)

    @property
    def state(self) -> Floats:
        """[x^n y^n U χ ω_χ …] (n,) in the plane of the fixes, a copy; (5,) for several modes or structures."""
        return self._running.moments()[0]

    @property
    def covariance(self) -> Floats:
        """(n, n) covariance of `state`."""
        return self._running.moments()[1]

    @property
    def position_covariance(self) -> Floats:
        """(2, 2) covariance of the position north and east, m²."""
        return self._running.position_covariance()

    @property
    def gyro_bias(self) -> float:
        """Estimated bias of the yaw gyro, rad/s; NaN if profile and aids give no such state."""
        return self._running.gyro_bias()

    def filter(self, fixes: Fixes, rate: float | None = None) -> Motion:
        """Causal estimate of the records of one or many vessels; one row per fix, or `rate` rows per second (Hz)."""
        return self._whole(fixes, rate, False)

    def smooth(self, fixes: Fixes, rate: float | None = None) -> Motion:
        """Fixed-interval estimate: every row uses the whole record."""
        return self._whole(fixes, rate, True)

    def _whole(self, fixes: Fixes, rate: float | None, smooth: bool) -> Motion:
        if self._infers:
            return estimate(fixes, aid=self.aid, rate=rate, smooth=smooth)
        return motion_of(fixes, self.profile, self.aid, rate, smooth)


InferredFilter = FiveStateFilter
"""An earlier name of the filter of an inferred profile."""
