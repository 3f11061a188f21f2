"""FiveStateFilter: the filter as an object, fix by fix or over a whole record."""

import math
from collections.abc import Sequence

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import elapsed
from steerway.core.compiled import kernel, lean_kernel
from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.estimation.course.motion.layout import (
    COURSE,
    EMPTY,
    PHASE,
    RATE,
    SPEED,
    STARTING,
    UNDER_WAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
    empty_bank,
)
from steerway.estimation.course.output import OUTPUTS, write_output
from steerway.estimation.course.replay import TrackOutput, replay, run_track
from steerway.estimation.course.tracking import (
    advance,
    conclude,
    recentre,
    settle,
    take_aids,
    take_position,
)
from steerway.estimation.course.update.aids import AIDS, NO_AIDS, companion_of, expect_aids
from steerway.estimation.course.update.reported_accuracy import variance_scale, variance_scales_of
from steerway.estimation.profiles import Profile

_NOW, _ONE_ROW = np.zeros(1), np.array([0, 1])
_NORTH_POLE, _WHOLE_TURN = 0.5 * math.pi + 1e-9, 2.0 * math.pi + 1e-9
"""rad: latitudes and longitudes that are possible, but for rounding."""
_NO_SCALES = np.empty(0)


@lean_kernel
def _advance(bank, dt, parameters):
    advance(bank, dt, parameters, bank[:0])
    conclude(bank)


@lean_kernel
def _update(bank, usual, first, second, reported, geodetic, parameters):
    scale = variance_scale(usual, reported)
    _, nis, _ = take_position(bank, first, second, geodetic, scale, parameters)
    settle(bank, parameters)
    if geodetic:
        recentre(bank)
    return nis


@lean_kernel
def _aid(bank, aids, parameters):
    take_aids(bank, aids, parameters)
    settle(bank, parameters)


@kernel
def _output(block, geodetic):
    out = np.empty(OUTPUTS)
    write_output(block, geodetic, out)
    return out


class FiveStateFilter:
    """Speed over ground, course over ground and course rate from positions.

    S. Fossen and T. I. Fossen, Sensors 21, 2021, 7910, with what real fixes need.

    Streaming: `predict(dt)` between fixes at any rate, `update(latitude, longitude)` at each fix (or
    `update_north_east` in a plane of one's own), then read the properties. Whole record: `filter(fixes)`,
    `smooth(fixes)`. Two filters share nothing.

    Args:
        profile: tuning, a `Profile` or the name of a built-in one.
        aid: which of "sog", "cog", "heading", "water_speed", "yaw_rate" to take beside positions.

    Raises InputError for an unknown profile or aid.
    """

    def __init__(self, profile: Profile | str = "small-usv", aid: tuple[str, ...] = ()):
        expect_aids(aid)
        self.profile = Profile.named(profile) if isinstance(profile, str) else profile
        self.aid = tuple(aid)
        self._parameters = self.profile.parameters(self.aid)
        self._bank = empty_bank(self._parameters)
        self._combined = self._bank[0]
        self._states = self._bank.shape[2]
        self._usual = np.zeros(2)
        self._geodetic = True

    def __getstate__(self) -> dict:
        own = {"_bank": self._bank.copy(), "_usual": self._usual.copy()}
        return {name: value for name, value in self.__dict__.items() if name != "_combined"} | own

    def __setstate__(self, state: dict) -> None:
        self.__dict__.update(state)
        self._combined = self._bank[0]  # a view, which copies and pickles would make an array of its own

    def __repr__(self) -> str:
        aided = f", aid={self.aid}" if self.aid else ""
        return f"FiveStateFilter({self.profile.name!r}{aided}): {self._now()}"

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
        self._bank[:] = 0.0
        self._usual[:] = 0.0

    def predict(self, dt: float) -> None:
        """Advance by dt seconds, by none where a clock was set back. Raises InputError where dt is not finite."""
        _advance(self._bank, elapsed("dt", dt), self._parameters)

    def update(self, latitude: float, longitude: float, position_std: float | None = None) -> float:
        """Take a fix (rad). Returns its NIS: above 13.8 it was rejected, NaN for the first.

        `position_std` is the accuracy its receiver reports, as in `Fixes`: see `course.update.reported_accuracy`.

        Raises InputError, a ValueError, for a latitude beyond ±π/2 or a longitude beyond ±2π: degrees.
        """
        if abs(latitude) > _NORTH_POLE or abs(longitude) > _WHOLE_TURN:
            raise InputError(
                f"update takes radians: latitude is {latitude:g}, longitude {longitude:g}, expected at most "
                f"±π/2 and ±2π (math.radians of degrees)"
            )
        self._geodetic = True
        return self._take(latitude, longitude, position_std)

    def update_north_east(self, north: float, east: float, position_std: float | None = None) -> float:
        """Take a fix in a fixed plane (m), in place of `update`. Returns its NIS, as there."""
        self._geodetic = False
        return self._take(north, east, position_std)

    def _take(self, first, second, position_std) -> float:
        reported = math.nan if position_std is None else position_std
        return _update(self._bank, self._usual, first, second, reported, self._geodetic, self._parameters)

    def aid_by(self, *values: float, **named: float) -> None:
        """Take measurements of other instruments (SI, true angles in rad; NaN or nothing for unknown).

        By name, or in the order of `AIDS`: sog, cog, heading, water_speed, yaw_rate.
        """
        given = dict(zip(AIDS, values, strict=False)) | named
        measured = np.array([given.pop(name, math.nan) for name in AIDS])
        if given or len(values) > len(AIDS):
            raise TypeError(f"aids are {', '.join(AIDS)}; {', '.join(given) or len(values)} given")
        _aid(self._bank, measured, self._parameters)

    def row(
        self,
        dt: float,
        latitude: float = math.nan,
        longitude: float = math.nan,
        aids: Sequence[float] | Floats | None = None,
        position_std: float = math.nan,
    ) -> tuple[list[float], float, int]:
        """One row of `filter`, streaming: advance by dt, then take the measurements of that time.

        Args:
            latitude, longitude: of a fix (rad), NaN for none.
            aids: in the order of `AIDS`, NaN for unknown; None for none. Only those of `aid` count.
            position_std: reported accuracy of the fix, NaN for none.

        Returns what `output` returns, the NIS (NaN without a fix) and the status, an index into `records.STATUSES`.
        """
        self._geodetic = True
        self.predict(dt)
        table = NO_AIDS
        if self.aid:
            given = np.full(len(AIDS), np.nan) if aids is None else np.array(aids, dtype=np.float64)
            table = np.where([name in self.aid for name in AIDS], given, np.nan).reshape(1, -1)
        fixed = math.isfinite(latitude) and math.isfinite(longitude) and math.isfinite(position_std)
        scale = variance_scales_of(self._usual, np.array([position_std])) if fixed else _NO_SCALES
        record = (_NOW, np.array([latitude]), np.array([longitude]), scale, table, True)
        found = TrackOutput(1)
        run_track(_ONE_ROW, record, self._parameters, self._bank, found.arrays())
        return found.estimate[0].tolist(), float(found.nis[0]), int(found.status[0])

    def change_receiver(self) -> None:
        """Fixes come from another receiver from now on: the usual accuracy of the last one does not apply to it."""
        self._usual[:] = 0.0

    def snapshot(self) -> np.ndarray:
        """The whole filter state, for `restore`."""
        return np.concatenate([self._bank.ravel(), self._usual])

    def restore(self, snapshot: np.ndarray) -> None:
        """Return to the state of a `snapshot`."""
        self._bank.ravel()[:] = snapshot[:-2]
        self._usual[:] = snapshot[-2:]

    @property
    def sog(self) -> float:
        """Speed over ground, m/s; NaN before the second fix."""
        if self.underway:
            return self._state_of(SPEED)
        if self._phase == EMPTY:
            return math.nan
        return math.hypot(self._state_of(VELOCITY_NORTH), self._state_of(VELOCITY_EAST))

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
        return self._phase == UNDER_WAY

    @property
    def started(self) -> bool:
        """Whether the first fixes have determined the velocity."""
        return self._phase > STARTING

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
        """All at the price of one property: position, SOG, COG, course rate, 1σ of these three and of position."""
        return _output(self._combined, self._geodetic).tolist()

    @property
    def state(self) -> np.ndarray:
        """(n,) copy: [x^n y^n U χ ω_χ …], or [x^n y^n v_N v_E ω_χ …] while course is not defined."""
        return self._combined[self._states].copy()

    @property
    def covariance(self) -> np.ndarray:
        """(n, n) covariance of `state`."""
        upper = np.triu(self._combined[: self._states])
        return upper + np.triu(upper, 1).T

    @property
    def gyro_bias(self) -> float:
        """Estimated bias of the yaw gyro, rad/s; NaN where the profile or the aids have no such state."""
        index = companion_of(self._parameters[0], "yaw_rate")
        return self._state_of(index) if index else math.nan

    def _state_of(self, index) -> float:
        return self._combined.item(self._states, index)

    @property
    def _phase(self) -> float:
        return self._combined.item(self._states + 1, PHASE)

    def filter(self, fixes: Fixes, rate: float | None = None) -> Motion:
        """Causal estimate of one or many vessels' records; one row a fix, or `rate` rows a second (Hz)."""
        return replay(self._parameters, self.aid, fixes, rate)

    def smooth(self, fixes: Fixes, rate: float | None = None) -> Motion:
        """Fixed-interval estimate: every row uses the whole record."""
        return replay(self._parameters, self.aid, fixes, rate, smoothed=True)
