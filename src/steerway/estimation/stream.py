"""FiveStateFilter: a profile as a filter, fix by fix, by the arithmetic of `estimate`.

Its whole state is one array, so that a snapshot is one copy. Rows between and ahead of fixes are predicted with another
filter that is given the snapshot. A profile of one mode without extras runs by the paper's Table 1
(`filter.five_state`), all others by the general filter (`filter.row`).
"""

import math
from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import elapsed, not_negative
from steerway.core.errors import InputError
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import NO_COURSE, OK, PREDICTED, REJECTED, STARTING, Fixes, Motion
from steerway.estimation.filter import five_state
from steerway.estimation.filter.model import FUSED, Bank, Model, bank_in, bank_size, packed
from steerway.estimation.fixed_lag import FixedLag
from steerway.estimation.log.accuracy import variance_scale
from steerway.estimation.log.copies import FEW_STEPS, HELD
from steerway.estimation.log.course import (
    COG,
    EAST,
    NORTH,
    POSITION_STD,
    RATE,
    SOG,
    average,
    least_course_speed,
)
from steerway.estimation.log.place import MOMENTS, mixed, place_moments, rotated
from steerway.estimation.log.record import LONG
from steerway.estimation.log.run import motion_of
from steerway.estimation.log_estimate import estimate
from steerway.estimation.moments import motion_moments
from steerway.estimation.stream_row import (
    AZIMUTH,
    COARSE,
    ELAPSED,
    FADED,
    HEADER,
    KNOWN,
    LAST_SOG,
    LATITUDE,
    LOG_DENSITY,
    LONGITUDE,
    NIS,
    SINCE,
    USUAL,
    USUAL_COUNT,
    WRONG,
    Alike,
    doubt_slide,
    note_fix,
    note_interval,
    place_of,
    predict_plain,
    read,
    read_plain,
    settle,
    take_plain,
    true_course,
    walk,
)
from steerway.estimation.vessel.aids import AIDS, NO_AIDS, expect_aids
from steerway.estimation.vessel.flat import WeighedModel
from steerway.estimation.vessel.inferred import InferredProfile, prior_profile, profile_of
from steerway.estimation.vessel.profile import Profile

FADE = 10.0
"""s in which the weight goes over from one set of structures to the next: a few fixes of a usual receiver. Chosen."""
LEAST_LOG_WEIGHT = -40.0
"""No structure whose weight is learned is ever excluded; a filter that is lost has lucky runs of fixes, though. Chosen:
e⁻⁴⁰ is 4·10⁻¹⁸, below the rounding of the sum of weights."""
_NORTH_POLE, _WHOLE_TURN = 0.5 * math.pi + 1e-9, 2.0 * math.pi + 1e-9
"""rad: latitudes and longitudes that are possible, but for rounding."""


class Set(NamedTuple):
    """Structures that run together: those fading out first. `learns`: weights follow the likelihood, as of a prior."""

    structures: tuple[Model, ...]
    weights: tuple[float, ...]
    fading: int
    fading_weights: tuple[float, ...]
    learns: bool


def set_of(structures, learns: bool = False) -> Set:
    """The set of weighed structures."""
    return Set(tuple(each.model for each in structures), tuple(each.weight for each in structures), 0, (), learns)


class FiveStateFilter:
    """Speed over ground, course over ground and course rate from positions, fix by fix or over whole records.

    S. Fossen and T. I. Fossen, Sensors 21, 2021, 7910, with what real fixes need.

    Streaming: `predict(dt)` between fixes at any rate, `update(latitude, longitude)` at each fix (or
    `update_north_east` in a plane of one's own), then read the properties. Whole record: `filter(fixes)`,
    `smooth(fixes)`. Two filters share nothing.

    Args:
        profile: tuning, a profile of either kind, the name of a built-in one or a .toml file. None where nothing is
            known: vessels of every declared kind with receivers of 0.025 to 6.4 m run together and are weighed by how
            well they predict the fixes; a whole record is estimated as `steerway.estimate` does.
        aid: which of "sog", "cog", "heading", "water_speed", "yaw_rate" to take beside positions, where structures of
            the profile have a part for it.
        learns: whether the weights follow the likelihood of the fixes, for structures of which none is known to hold;
            they always do without a profile.
        lag: s for which `lagged` waits for later fixes, 0 for none.

    Raises InputError for an unknown profile or aid, and for a lag that is negative.
    """

    def __init__(
        self,
        profile: Profile | InferredProfile | str | None = None,
        aid: tuple[str, ...] = (),
        learns: bool = False,
        lag: float = 0.0,
    ):
        expect_aids(aid)
        self._waiting = FixedLag(lag) if not_negative("lag", lag) > 0.0 else None
        self.aid, self._infers = tuple(aid), profile is None
        self.profile = prior_profile(self.aid) if profile is None else profile_of(profile)
        self._geodetic = True
        self._arrange(set_of(self.profile.models(self.aid), learns or self._infers), None)

    def _arrange(self, running: Set, header: Floats | None) -> None:
        """Make room for a set of structures."""
        self._set = running
        n = len(running.structures)
        groups = [(sizes, list(models)) for sizes, models in groupby(running.structures, _sizes)]
        space = [len(models) * bank_size(sizes.modes, sizes.states) for sizes, models in groups]
        self._state = np.zeros(HEADER + n + sum(space))
        if header is not None:
            self._state[:HEADER] = header
        self._weights, memory = self._state[HEADER : HEADER + n], self._state[HEADER + n :]
        self._weights[:] = running.weights
        self._outs = np.full((n, FUSED + 3), np.nan)
        self._banks, self._groups = [], []
        for (sizes, models), size in zip(groups, space, strict=True):
            banks, memory = memory[:size].reshape(len(models), -1), memory[size:]
            outs = self._outs[len(self._banks) : len(self._banks) + len(models)]
            plain = all(five_state.is_plain(model, NO_AIDS) for model in models) and not self.aid and not running.learns
            plain = plain and self._waiting is None
            self._groups.append(Alike(banks, np.stack([packed(model) for model in models]), outs, plain))
            self._banks += [bank_in(bank, sizes.modes, sizes.states) for bank in banks]
        only = self._groups[0]
        self._plain = only.models[0] if n == 1 and only.is_plain else None
        self._estimate = np.full(POSITION_STD + 1, np.nan)
        weighed = [WeighedModel(*each) for each in zip(running.weights, running.structures, strict=True)]
        self._least_speed = least_course_speed(weighed, self.profile.steerageway)
        self._is_current = False

    def __getstate__(self) -> dict:
        views = "_state", "_weights", "_outs", "_banks", "_groups", "_plain", "_estimate"
        return {name: value for name, value in self.__dict__.items() if name not in views} | {"own": self.snapshot()}

    def __setstate__(self, state: dict) -> None:
        snapshot = state.pop("own")
        self.__dict__.update(state)
        self._arrange(snapshot[0], None)  # views, which copies and pickles would make arrays of their own
        self.restore(snapshot)

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
        self._arrange(self._set, None)
        if self._waiting is not None:
            self._waiting.drop_after(-math.inf)

    def snapshot(self) -> tuple[Set, Floats]:
        """The whole state, for `restore`, of this filter or another."""
        return self._set, self._state.copy()

    def restore(self, snapshot: tuple[Set, Floats]) -> None:
        """Return to the state of a `snapshot`."""
        if snapshot[0] is not self._set:
            self._arrange(snapshot[0], None)
        self._state[:] = snapshot[1]
        for each in self._groups:
            read(each.banks, each.models, each.outs)
        self._is_current = False
        if self._waiting is not None:
            self._waiting.drop_after(self._state.item(ELAPSED))

    def change_receiver(self) -> None:
        """Fixes come from another receiver from now on: the usual accuracy of the last one does not apply to it."""
        self._state[USUAL] = self._state[USUAL_COUNT] = 0.0

    def predict(self, dt: float) -> None:
        """Advance by dt seconds, by none where a clock was set back. Raises InputError where dt is not finite."""
        if not 0.0 <= dt < math.inf:
            dt = elapsed("dt", dt)
        if self._plain is not None:
            self._is_current = False
            predict_plain(self._state, self._plain, dt)
            return
        self._state[SINCE] += dt
        self._advance(dt, math.nan, math.nan, 1.0, NO_AIDS)

    def update(self, latitude: float, longitude: float, position_std: float | None = None) -> float:
        """Take a fix (rad). Returns its NIS, NaN for the first.

        `position_std` is the accuracy its receiver reports, as in `Fixes`: see `log.accuracy`.

        Raises InputError, a ValueError, for a latitude beyond ±π/2 or a longitude beyond ±2π: degrees.
        """
        if abs(latitude) > _NORTH_POLE or abs(longitude) > _WHOLE_TURN:
            raise InputError(
                f"update takes radians: latitude is {latitude:g}, longitude {longitude:g}, expected at most "
                f"±π/2 and ±2π (math.radians of degrees)"
            )
        self._geodetic = True
        return self._take(*walk(self._state, latitude, longitude), position_std)

    def update_north_east(self, north: float, east: float, position_std: float | None = None) -> float:
        """Take a fix in a fixed plane (m), in place of `update`. Returns its NIS, as there."""
        self._geodetic = False
        return self._take(north, east, position_std)

    def _take(self, first, second, position_std) -> float:
        reported = math.nan if position_std is None else position_std
        if self._plain is not None:
            self._is_current = True
            return take_plain(self._state, self._plain, first, second, reported, self._least_speed, self._estimate)
        excess = variance_scale(self._state[USUAL : USUAL_COUNT + 1], reported)
        nis, _ = self._fix(0.0, first, second, excess, NO_AIDS)
        return nis

    def _fix(self, dt, first, second, excess, aids) -> tuple[float, float]:
        """Advance by dt and take a fix of the plane. Returns its NIS and the probability that it is an outlier."""
        state = self._state
        if state[SINCE] > LONG:
            state[KNOWN] = 0.0
        note_interval(state, state[SINCE], state[ELAPSED] + dt)
        state[SINCE] = 0.0
        self._advance(dt, first, second, excess, aids)
        self._settle()
        note_fix(self._state, self._estimate)
        return self._weighed(NIS), self._weighed(WRONG)

    def _weighed(self, column) -> float:
        return float(self._weights @ self._outs[:, column])

    def aid_by(self, *values: float, **named: float) -> None:
        """Take measurements of other instruments (SI, true angles in rad; NaN or nothing for unknown).

        By name, or in the order of `AIDS`: sog, cog, heading, water_speed, yaw_rate. Only those of `aid` count.
        """
        given = dict(zip(AIDS, values, strict=False)) | named
        measured = [given.pop(name, math.nan) for name in AIDS]
        if given or len(values) > len(AIDS):
            raise TypeError(f"aids are {', '.join(AIDS)}; {', '.join(given) or len(values)} given")
        self._advance(0.0, math.nan, math.nan, 1.0, self._aids(measured))

    def _aids(self, aids) -> Floats:
        """(1 or 0, aids): those of `aid`."""
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
        """One row of `filter`, streaming: advance by dt, then take the measurements of that time.

        Args:
            latitude, longitude: of a fix (rad), NaN for none.
            aids: in the order of `AIDS`, NaN for unknown; None for none. Only those of `aid` count.
            position_std: reported accuracy of the fix, NaN for none.

        Returns what `output` returns, the NIS (NaN without a fix) and the status, an index into `records.STATUSES`.
        """
        state, dt = self._state, elapsed("dt", dt)
        self._geodetic = True
        table = self._aids(aids)
        fixed = math.isfinite(latitude) and math.isfinite(longitude)
        state[SINCE] += dt
        if fixed and self.profile.recognises and self._is_copy(latitude, longitude):
            fixed = False
        nis = wrong = math.nan
        if fixed:
            excess = variance_scale(state[USUAL : USUAL_COUNT + 1], position_std)
            nis, wrong = self._fix(dt, *walk(state, latitude, longitude), excess, table)
        else:
            self._advance(dt, math.nan, math.nan, 1.0, table)
            self._settle()
        return self.output(), nis, self._status(fixed and not math.isnan(nis), wrong)

    def _status(self, fixed, wrong) -> int:
        if not self.started:
            return STARTING
        if wrong > 0.5:
            return REJECTED
        if not self.underway:
            return NO_COURSE
        return OK if fixed else PREDICTED

    def _is_copy(self, latitude, longitude):
        """Whether a fix is the one before once more, though the boat has moved on by steps that fixes resolve."""
        state = self._state
        if latitude != state[LATITUDE] or longitude != state[LONGITUDE] or not 0.0 < state[SINCE] <= HELD:
            return False
        return state[LAST_SOG] * state[SINCE] > FEW_STEPS * state[COARSE] > 0.0

    def _advance(self, dt, first, second, excess, aids):
        self._is_current = False
        if dt > LONGEST_GAP:
            self._state[KNOWN] = 0.0
            for bank in self._banks:
                bank.run["started"] = 0
            dt = 0.0
        if self._set.fading:
            self._fade(dt)
        for each in self._groups:
            each.step(dt, first, second, excess, aids)
        self._state[ELAPSED] += dt  # another array where the older structures have just gone
        if self._set.learns and math.isfinite(first):
            self._learn()
        if self._waiting is not None and (math.isfinite(first) or len(aids)):
            table = aids if len(aids) or not self.aid else np.full((1, len(AIDS)), math.nan)
            self._waiting.add(self._state, self._set.structures, self._banks, (first, second, excess, table))

    def wait(self, lag: float) -> None:
        """Begin anew, with another `lag` (s)."""
        self._waiting = FixedLag(lag) if not_negative("lag", lag) > 0.0 else None
        self.reset()

    def lagged(self, rest: bool = False) -> list[tuple[float, list[float]]]:
        """(age in s, `output`) of the fixes that have become `lag` s old since it was last asked, oldest first.

        Each is smoothed by all later ones. rest: those too that are not so old yet, as at the end of a log. None
        without a lag, and of fixes before the speed was known.
        """
        if self._waiting is None:
            return []
        now = self._state.item(ELAPSED)
        ready = self._waiting.due(math.inf if rest else now, self._least_speed)
        return [(now - each.time, self._outward(each.header, each.estimate)) for each in ready]

    def _learn(self):
        logs = np.log(self._weights) + self._outs[:, LOG_DENSITY]
        logs = np.maximum(logs - logs.max(), LEAST_LOG_WEIGHT)
        weights = np.exp(logs)
        self._weights[:] = weights / weights.sum()

    def _fade(self, dt):
        """Let the weight go over to the newer structures."""
        running, state = self._set, self._state
        state[FADED] += dt
        share = min(state[FADED] / FADE, 1.0)
        if share == 1.0:
            left, kept = self._banks[running.fading :], running.structures[running.fading :]
            newer = running.weights[running.fading :]
            self._arrange(Set(kept, newer, 0, (), False), state[:HEADER].copy())
            for bank, old in zip(self._banks, left, strict=True):
                for part, other in zip(bank, old, strict=True):
                    part[...] = other
            return
        self._weights[: running.fading] = (1.0 - share) * np.array(running.fading_weights)
        self._weights[running.fading :] = share * np.array(running.weights[running.fading :])

    def take_up(self, running: Set, banks: Sequence[Bank]) -> None:
        """Go over to other structures without a jump; their banks know the fixes so far in the plane of this filter."""
        older, old, weights = self._set, self._banks, self._weights.copy()
        n = len(older.structures)
        joined = Set(older.structures + running.structures, (0.0,) * n + running.weights, n, tuple(weights), False)
        self._arrange(joined, self._state[:HEADER].copy())
        for bank, from_ in zip(self._banks, [*old, *banks], strict=True):
            for part, other in zip(bank, from_, strict=True):
                part[...] = other
        self._weights[:n], self._weights[n:] = weights, 0.0
        self._state[FADED] = 0.0

    def _read(self) -> Floats:
        """The estimate now (9,), in the plane."""
        if not self._is_current:
            self._combine()
            doubt_slide(self._state, self._estimate)
            self._is_current = True
        return self._estimate

    def _combine(self) -> None:
        if self._plain is not None:
            read_plain(self._state, self._plain, self._least_speed, self._estimate)
        else:
            average(self._outs, self._weights, self._least_speed, self._estimate)

    def _settle(self) -> None:
        """Note the speed, whether it is known from now on, and whether the receiver may slide in."""
        self._combine()
        settle(self._state, self._estimate)
        self._is_current = True

    @property
    def sog(self) -> float:
        """Speed over ground, m/s; NaN while it is not known."""
        return self._read().item(SOG) if self.started else math.nan

    @property
    def cog(self) -> float:
        """Course over ground, rad in [−π, π); NaN while it is not defined."""
        return true_course(self._state, self._read()) if self.started else math.nan

    @property
    def course_rate(self) -> float:
        """Rate of the course, rad/s, + to starboard; NaN while the course is not defined."""
        return self._read().item(RATE) if self.started else math.nan

    @property
    def underway(self) -> bool:
        """Whether the vessel has steerageway: whether course is defined."""
        return self.started and not math.isnan(self._read().item(COG))

    @property
    def started(self) -> bool:
        """Whether the first fixes have determined the velocity."""
        return self._state.item(KNOWN) == 1.0

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
        """All at the price of one property: position, SOG, COG, course rate, 1σ of these three and of position.

        The last is relative to the receiver's slow error, which positions cannot show: see `core.slow_error`.
        """
        return self._outward(self._state, self._read())

    def _outward(self, state, estimate) -> list[float]:
        """An estimate (9,) in the plane, of which `state` is the place and whether the speed is known."""
        place = estimate.item(NORTH), estimate.item(EAST)
        if self._geodetic:
            place = place_of(state, estimate)
        if state[KNOWN] != 1.0:
            return [*place, *[math.nan] * 6, estimate.item(POSITION_STD)]
        return [*place, estimate.item(SOG), true_course(state, estimate), *estimate[RATE:].tolist()]

    @property
    def state(self) -> Floats:
        """(n,) copy: [x^n y^n U χ ω_χ …] in the plane of the fixes; (5,) of several modes or structures together."""
        return self._moments()[0]

    @property
    def covariance(self) -> Floats:
        """(n, n) covariance of `state`."""
        return self._moments()[1]

    def _moments(self) -> tuple[Floats, Floats]:
        return motion_moments(self._set.structures, self._banks, self._weights)

    @property
    def position_covariance(self) -> Floats:
        """(2, 2) covariance of the position north and east, m²."""
        moments = np.zeros((len(self._banks), MOMENTS))
        for bank, out in zip(self._banks, moments, strict=True):
            place_moments(bank, out)
        nn, ne, ee = rotated(mixed(moments, self._weights), self._state[AZIMUTH])
        return np.array([[nn, ne], [ne, ee]])

    @property
    def gyro_bias(self) -> float:
        """Estimated bias of the yaw gyro, rad/s; NaN where the profile or the aids have no such state."""
        which = AIDS.index("yaw_rate")
        places = [int(each.aids["companion"][which]) for each in self._set.structures]
        if not all(places):
            return math.nan
        each = zip(self._weights, self._banks, places, strict=True)
        return float(sum(weight * bank.probability @ bank.x[:, place] for weight, bank, place in each))

    def filter(self, fixes: Fixes, rate: float | None = None) -> Motion:
        """Causal estimate of one or many vessels' records; one row a fix, or `rate` rows a second (Hz)."""
        return self._whole(fixes, rate, False)

    def smooth(self, fixes: Fixes, rate: float | None = None) -> Motion:
        """Fixed-interval estimate: every row uses the whole record."""
        return self._whole(fixes, rate, True)

    def _whole(self, fixes, rate, smooth):
        if self._infers:
            return estimate(fixes, aid=self.aid, rate=rate, smooth=smooth)
        return motion_of(fixes, self.profile, self.aid, rate, smooth)


InferredFilter = FiveStateFilter
"""The name that filters of inferred profiles had."""


def _sizes(model):
    return model.sizes
