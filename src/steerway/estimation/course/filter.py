"""FiveStateFilter: the filter as an object, fix by fix or over a whole record."""

import math

import numpy as np

from steerway.core.compiled import kernel, lean_kernel
from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.estimation.course.accuracy import doubt, doubts_of
from steerway.estimation.course.model import (
    COURSE,
    EMPTY,
    GYRO_STATE,
    MODE,
    RATE,
    SPEED,
    STARTING,
    UNDERWAY,
    empty_memory,
    whole,
)
from steerway.estimation.course.replay import Run, outputs, replay
from steerway.estimation.course.tracking import (
    SPOKEN,
    advance,
    conclude,
    recentre,
    settle,
    speak,
    take_aids,
    take_position,
    track,
)
from steerway.estimation.profiles import AIDS, Profile

_NOW = np.zeros(1)
_NO_DOUBTS = np.empty(0)
_NO_AIDS = np.empty((0, len(AIDS)))
_NONE_KEPT = np.empty((0, 1, 1))


@lean_kernel
def _advance(memory, dt, model):
    advance(memory, dt, model)
    conclude(memory)


@lean_kernel
def _take(memory, first, second, geodetic, doubted, model):
    _, nis, _ = take_position(memory, first, second, geodetic, doubted, model)
    settle(memory, model)
    if geodetic:
        recentre(memory)
    return nis


@lean_kernel
def _update(memory, first, second, geodetic, model):
    return _take(memory, first, second, geodetic, 1.0, model)


@lean_kernel
def _update_said(memory, usual, first, second, said, geodetic, model):
    return _take(memory, first, second, geodetic, doubt(usual, said), model)


@lean_kernel
def _aid(memory, aids, model):
    take_aids(memory, aids, model)
    settle(memory, model)


@kernel
def _say(memory, geodetic):
    said = np.empty(SPOKEN)
    speak(memory, geodetic, said)
    return said


class FiveStateFilter:
    """Speed over ground, course over ground and course rate from positions (P0 §3), with what real fixes need.

    Streaming: `predict(dt)` between fixes at any rate, `update(latitude, longitude)` at each fix (or
    `update_north_east` in a plane of one's own), then read the properties. Whole record: `filter(fixes)`,
    `smooth(fixes)`. Two filters share nothing.

    Args:
        profile: tuning, a `Profile` or the name of a built-in one.
        aid: which of "sog", "cog", "heading", "water_speed", "yaw_rate" to take beside positions.

    Raises InputError for an unknown profile or aid.
    """

    def __init__(self, profile: Profile | str = "small-usv", aid: tuple[str, ...] = ()):
        unknown = [name for name in aid if name not in AIDS]
        if unknown:
            raise InputError(f"aid {unknown[0]!r} is unknown, expected some of {', '.join(AIDS)}")
        self.profile = Profile.named(profile) if isinstance(profile, str) else profile
        self.aid = tuple(aid)
        self._model = self.profile.model(self.aid)
        self._memory = empty_memory(self._model)
        self._main = whole(self._memory)
        self._states = self._main.shape[1]
        self._usual = np.zeros(2)
        self._geodetic = True

    def reset(self) -> None:
        """Forget everything."""
        self._memory[:] = 0.0
        self._usual[:] = 0.0

    def predict(self, dt: float) -> None:
        """Advance by dt ≥ 0 seconds."""
        _advance(self._memory, dt, self._model)

    def update(self, latitude: float, longitude: float, position_std: float | None = None) -> float:
        """Take a fix (rad). Returns its NIS: above 13.8 it was rejected, NaN for the first.

        `position_std` is what the receiver says of it, as in `Fixes`: see `steerway.estimation.course.accuracy`.
        """
        self._geodetic = True
        if position_std is None:
            return _update(self._memory, latitude, longitude, True, self._model)
        return _update_said(self._memory, self._usual, latitude, longitude, position_std, True, self._model)

    def update_north_east(self, north: float, east: float, position_std: float | None = None) -> float:
        """Take a fix in a fixed plane (m), in place of `update`. Returns its NIS, as there."""
        self._geodetic = False
        if position_std is None:
            return _update(self._memory, north, east, False, self._model)
        return _update_said(self._memory, self._usual, north, east, position_std, False, self._model)

    def aid_by(self, sog=math.nan, cog=math.nan, heading=math.nan, water_speed=math.nan, yaw_rate=math.nan) -> None:
        """Take what other instruments say now (SI, true angles in rad, NaN or nothing for unknown)."""
        _aid(self._memory, np.array([sog, cog, heading, water_speed, yaw_rate]), self._model)

    def row(
        self, dt: float, latitude=math.nan, longitude=math.nan, aids=None, position_std=math.nan
    ) -> tuple[list[float], float, int]:
        """One row of `filter`, streaming: advance by dt, then take what was said at that moment.

        Args:
            latitude, longitude: of a fix (rad), NaN for none.
            aids: (5,) in the order of `AIDS`, NaN where nothing was said; None for nothing. Only those of `aid` count.
            position_std: what the receiver says of the fix, NaN for nothing.

        Returns what `said` returns, the NIS (NaN without a fix) and the status, an index into `records.STATUSES`.
        """
        self._geodetic = True
        self.predict(dt)
        run = Run(1)
        table = _NO_AIDS
        if self.aid:
            given = np.full(len(AIDS), np.nan) if aids is None else np.array(aids, dtype=np.float64)
            table = np.where([name in self.aid for name in AIDS], given, np.nan).reshape(1, -1)
        fixed = math.isfinite(latitude) and math.isfinite(longitude) and math.isfinite(position_std)
        doubted = doubts_of(self._usual, np.array([position_std])) if fixed else _NO_DOUBTS
        place = np.array([latitude]), np.array([longitude])
        track(_NOW, *place, doubted, table, True, self._model, self._memory, *outputs(run), _NONE_KEPT)
        return run.spoken[0].tolist(), float(run.nis[0]), int(run.status[0])

    def meet_receiver(self) -> None:
        """Fixes come from another receiver from now on: what the last one said of its accuracy is no measure for it."""
        self._usual[:] = 0.0

    def snapshot(self) -> np.ndarray:
        """All it remembers, for `restore`."""
        return np.concatenate([self._memory.ravel(), self._usual])

    def restore(self, snapshot: np.ndarray) -> None:
        """Be again as when `snapshot` was taken."""
        self._memory.ravel()[:] = snapshot[:-2]
        self._usual[:] = snapshot[-2:]

    @property
    def sog(self) -> float:
        """Speed over ground, m/s; NaN before the second fix."""
        if self.underway:
            return self._state_of(SPEED)
        return math.hypot(self._state_of(2), self._state_of(3)) if self._mode != EMPTY else math.nan

    @property
    def cog(self) -> float:
        """Course over ground, rad in [−π, π); NaN while it is not defined."""
        return self._state_of(COURSE) if self.underway else math.nan

    @property
    def course_rate(self) -> float:
        """Rate of the course, rad/s, + to starboard; NaN while it is not defined."""
        return self._state_of(RATE) if self.underway else math.nan

    @property
    def underway(self) -> bool:
        """Whether the vessel has steerageway: whether course is defined."""
        return self._mode == UNDERWAY

    @property
    def started(self) -> bool:
        """Whether the first fixes have told the velocity."""
        return self._mode > STARTING

    @property
    def position(self) -> tuple[float, float]:
        """Latitude and longitude (rad), or north and east (m) after `update_north_east`; NaN before the first fix."""
        north, east, *_ = self.said()
        return north, east

    def said(self) -> list[float]:
        """All at the price of one property: position, SOG, COG, course rate, 1σ of these three and of position."""
        said = np.empty(SPOKEN)
        speak(self._memory, self._geodetic, said)
        return said.tolist()

    @property
    def state(self) -> np.ndarray:
        """(n,) copy: [x^n y^n U χ ω_χ …], or [x^n y^n v_N v_E ω_χ …] while course is not defined."""
        return self._main[self._states].copy()

    @property
    def covariance(self) -> np.ndarray:
        """(n, n) covariance of `state`."""
        upper = np.triu(self._main[: self._states])
        return upper + np.triu(upper, 1).T

    @property
    def gyro_bias(self) -> float:
        """Estimated bias of the yaw gyro, rad/s; NaN where the profile or the aids have no such state."""
        index = int(self._model.reshape(-1, self._model.shape[-1])[0, GYRO_STATE])
        return self._state_of(index) if index else math.nan

    def _state_of(self, index) -> float:
        return self._main.item(self._states, index)

    @property
    def _mode(self) -> float:
        return self._main.item(self._states + 1, MODE)

    def filter(self, fixes: Fixes, rate: float | None = None) -> Motion:
        """Causal estimate of one or many vessels' records; one row a fix, or `rate` rows a second (Hz)."""
        return replay(self._model, self.aid, fixes, rate)

    def smooth(self, fixes: Fixes, rate: float | None = None) -> Motion:
        """Fixed-interval estimate: every row knows the whole record."""
        return replay(self._model, self.aid, fixes, rate, smoothed=True)
