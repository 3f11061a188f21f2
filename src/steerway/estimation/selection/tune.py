"""Tuning by maximum likelihood on the innovations of a log, with an interval of every number."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from steerway.core.errors import InputError
from steerway.core.profile_fields import fitting_of
from steerway.core.records import Fixes
from steerway.estimation.course.replay import run_rows
from steerway.estimation.course.update.outliers import FIX_GATE
from steerway.estimation.profiles import Profile
from steerway.estimation.selection import stages
from steerway.estimation.selection.excerpts import LEAST_SPEED, moving
from steerway.estimation.selection.intervals import intervals
from steerway.estimation.selection.parameters import ACCELERATION, DRIFT, MOTION, OSCILLATION, SLOW_ERROR, TURNS

_SETTLING_FIXES = 5
"""Left out at the start, where the likelihood is that of the diffuse prior."""
_FEWEST_FIXES = 60
"""Under way; with fewer no number of the motion is determined."""
_STRETCHES, _STRETCH, _STRETCH_APART = 10, 1200, 1000
"""Rows used of a longer log, in stretches from all over it."""
_STARTS = [
    Profile(position_std=white, speed_noise=speed, course_rate_noise=rate, course_rate_decay=decay)
    for white in (0.005, 0.02, 0.05, 0.15, 0.5, 1.5, 5.0)
    for speed in (1e-5, 1e-3, 3e-2)
    for rate, decay in ((1e-6, 0.05), (1e-4, 0.1), (1e-3, 0.3), (3e-2, 2.0))
]


_NAMES = fitting_of(Profile.model_fields, "words")
_BOUNDS = fitting_of(Profile.model_fields, "bounds")
_AT_BOUND = 0.02
"""Of the logarithm: numbers are searched to about a hundredth."""
_WORDS = {name: words for name, (words, _) in _NAMES.items()}
_UNITS = {name: unit for name, (_, unit) in _NAMES.items()}
_MISSING = (
    "persistent acceleration",
    "wave-induced yaw",
    "turns as a mode of their own",
    "slow error of the receiver",
    "a slower one",
)


@dataclass(frozen=True)
class Tuned:
    """A profile and how consistent the log's innovations are with it."""

    profile: Profile
    fixes: int
    moving: int
    rejected: int
    nis_mean: float  # over accepted fixes under way; 2 when the filter is consistent
    nis_band: tuple[float, float]  # 95 % band of that mean then
    log_likelihood: float

    @property
    def cannot_tell(self) -> tuple[str, ...]:
        """Names of the parameters that this log does not determine: see `Profile.is_determined`."""
        return tuple(name for name in self.profile.intervals if not self.profile.is_determined(name))

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Names of fitted parameters that ended at the least or the largest value that a fit tries."""
        ended = {name: getattr(self.profile, name) for name in self.profile.intervals}
        return tuple(
            name
            for name, value in ended.items()
            if name in _BOUNDS and any(abs(math.log(value / end)) < _AT_BOUND for end in _BOUNDS[name])
        )

    def as_dict(self) -> dict:
        """The numbers, flat, by their names in a profile; `intervals` and `cannot_tell` beside them."""
        fitted = dict.fromkeys((*MOTION, *ACCELERATION, *OSCILLATION, *TURNS, *SLOW_ERROR, *DRIFT))
        numbers = {name: getattr(self.profile, name) for name in fitted}
        own = {name: getattr(self, name) for name in ("fixes", "moving", "rejected", "nis_mean", "log_likelihood")}
        intervals = {name: list(ends) for name, ends in self.profile.intervals.items()}
        determined = {"intervals": intervals, "cannot_tell": list(self.cannot_tell), "at_bounds": list(self.at_bounds)}
        return numbers | own | {"nis_band": list(self.nis_band)} | determined

    def sentences(self) -> list[tuple[str, str]]:
        """The fit as (what, value) pairs of text."""
        p = self.profile
        low, high = self.nis_band
        if low <= self.nis_mean <= high:
            verdict = "consistent"
        else:
            verdict = "errors smaller than claimed" if self.nis_mean < low else "errors larger than claimed"
        groups = [
            (MOTION, True),
            (ACCELERATION, p.acceleration_std),
            (OSCILLATION, p.yawing_period),
            (TURNS, p.turn_time),
        ]
        groups += [(SLOW_ERROR, p.error_std), (DRIFT, p.drift_std)]
        shown = [name for names, there in groups if there for name in names]
        missing = [words for (_, there), words in zip(groups[1:], _MISSING, strict=True) if not there]
        return [
            ("fixes", f"{self.fixes}, {self.moving} under way, {self.rejected} rejected"),
            *((_WORDS[name], self._value(name)) for name in shown),
            *([("not found", ", ".join(missing))] if missing else []),
            *([("not determined", ", ".join(map(_WORDS.get, self.cannot_tell)))] if self.cannot_tell else []),
            *([("at a bound", ", ".join(map(self._bound, self.at_bounds)))] if self.at_bounds else []),
            ("mean NIS", f"{self.nis_mean:.2f}, 95 % band {low:.2f} to {high:.2f}: {verdict}"),
        ]

    def _bound(self, name) -> str:
        low, high = _BOUNDS[name]
        return f"{_WORDS[name]} (tried {low:g} to {high:g} {_UNITS[name]}: the log asks for a value outside)"

    def _value(self, name) -> str:
        value = f"{getattr(self.profile, name):.3g} {_UNITS[name]}"
        if name not in self.profile.intervals:
            return value
        ends = "{:g} to {:g}".format(*self.profile.intervals[name])
        return f"{value}  ({ends})" if self.profile.is_determined(name) else f"{value}  ({ends}: not determined)"


def tune(fixes: Fixes, name: str = "tuned", progress: Callable[[float], None] | None = None) -> Tuned:
    """Fit a profile to the longest track of `fixes`.

    Args:
        fixes: at least a minute of motion.
        name: of the profile.
        progress: called with the share of the work done, 0 to 1.

    Raises InputError when there is too little motion to fit anything.
    """
    fixes = longest_track(fixes)
    whole = stages.Evidence(fixes, _under_way(fixes))
    log = whole.excerpt(_STRETCHES, _STRETCH)
    under_way = log.counted.sum()
    if under_way < _FEWEST_FIXES:
        raise InputError(
            f"{under_way} of {len(log)} fixes are under way (faster than {LEAST_SPEED} m/s), "
            f"expected at least {_FEWEST_FIXES} to tune by"
        )
    report = _Progress(progress)
    apart = whole.apart(stages.SPACING)
    motion = stages.motion(apart.excerpt(_STRETCHES, _STRETCH_APART), _STARTS, report.step)
    receiver = stages.receiver(log, motion.profile, len(whole) / len(apart), report.step)
    fit = stages.together(log, motion, receiver, report.step)
    determined = intervals(fit)
    report.done()
    rounded = {key: float(f"{getattr(fit.profile, key):.4g}") for key in fit.search.names}
    profile = fit.profile.model_copy(update=rounded | {"name": name, "intervals": determined})
    return _tuned(profile, whole)


def _under_way(fixes: Fixes) -> np.ndarray:
    counted = moving(fixes)
    counted[:_SETTLING_FIXES] = False
    return counted


def longest_track(fixes: Fixes) -> Fixes:
    """The fixes of the vessel that has most of them."""
    fixes = fixes.rows(fixes.has_position).in_order()
    return max((track for _, track in fixes.tracks()), key=len)


class _Progress:
    """Share of a search whose length is not known: approaches one, reaches it when done."""

    _TYPICAL = 1200

    def __init__(self, callback):
        self._callback = callback
        self._steps = 0

    def step(self):
        self._steps += 1
        if self._callback and self._steps % 10 == 0:
            self._callback(1.0 - math.exp(-self._steps / self._TYPICAL))

    def done(self):
        if self._callback:
            self._callback(1.0)


def _tuned(profile: Profile, log: stages.Evidence) -> Tuned:
    nis = run_rows(profile.parameters(), (), log.fixes).nis
    known = log.counted & np.isfinite(nis)
    good = known & (nis <= FIX_GATE)
    n = int(good.sum())
    half = 1.96 * 2.0 / math.sqrt(max(n, 1))
    return Tuned(
        profile=profile,
        fixes=len(log),
        moving=int(log.counted.sum()),
        rejected=int((known & ~good).sum()),
        nis_mean=float(nis[good].mean()) if n else math.nan,
        nis_band=(2.0 - half, 2.0 + half),
        log_likelihood=-log.cost(profile),
    )
