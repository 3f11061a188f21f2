"""Tuning by maximum likelihood on the innovations of a log.

Two steps, because the motion and a slowly erring receiver explain the same innovations when fitted together:

1. Motion and white noise on fixes at least a second apart. A receiver's fixes a fraction of a second apart err alike;
   taken as independent they would make every wobble of theirs a turn of the vessel.
2. White and slowly varying error of the receiver on all fixes, with the motion held.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from steerway.earth import displacement
from steerway.errors import InputError
from steerway.estimation.likelihood import cost
from steerway.estimation.profiles import GATE, Profile
from steerway.estimation.replay import run_rows
from steerway.records import Fixes

_SETTLING_FIXES = 5
_MOTION_SPACING = 1.0
_FEWEST_FIXES = 60

_BOUNDS = {
    "position_std": (0.003, 30.0),
    "speed_noise": (1e-6, 10.0),
    "course_rate_noise": (1e-9, 10.0),
    "course_rate_decay": (0.01, 2.0),
    "error_std": (0.003, 10.0),
    "error_time": (1.0, 2000.0),
}
_EXPECTED = {  # median and standard deviation of the logarithm: wide, so that only what a log cannot tell is held
    "position_std": (0.5, 2.0),
    "speed_noise": (1e-2, 4.0),
    "course_rate_noise": (1e-3, 4.0),
    "course_rate_decay": (0.2, 2.0),
    "error_std": (1.0, 2.0),
    "error_time": (100.0, 2.0),
}
_MOTION = ("position_std", "speed_noise", "course_rate_noise", "course_rate_decay")
_RECEIVER = ("position_std", "error_std", "error_time")
_MOTION_STARTS = [
    {"position_std": 0.1, "speed_noise": speed, "course_rate_noise": rate, "course_rate_decay": decay}
    for speed in (1e-3, 3e-2)
    for rate, decay in ((1e-4, 0.05), (1e-3, 0.3), (3e-2, 2.0))
]


@dataclass(frozen=True)
class Tuned:
    """A profile and how consistent the log's innovations are with it."""

    profile: Profile
    fixes: int
    moving: int
    rejected: int
    nis_mean: float  # over accepted fixes under way; 2 when the filter's own idea of its errors is right
    nis_band: tuple[float, float]  # 95 % band of that mean if it is
    log_likelihood: float

    def as_dict(self) -> dict:
        """The numbers, flat; the profile's by their names in a profile."""
        numbers = {name: getattr(self.profile, name) for name in (*_MOTION, "error_std", "error_time")}
        own = {name: getattr(self, name) for name in ("fixes", "moving", "rejected", "nis_mean", "log_likelihood")}
        return numbers | own | {"nis_band": list(self.nis_band)}

    def sentences(self) -> list[tuple[str, str]]:
        """The fit as (what, value) pairs for people."""
        p = self.profile
        low, high = self.nis_band
        slow = f"{p.error_std:.3g} m over {p.error_time:.3g} s" if p.error_std else "none found"
        if low <= self.nis_mean <= high:
            verdict = "consistent"
        else:
            verdict = "errors smaller than claimed" if self.nis_mean < low else "errors larger than claimed"
        return [
            ("fixes", f"{self.fixes}, {self.moving} under way, {self.rejected} rejected"),
            ("white noise of a fix", f"{p.position_std:.3g} m"),
            ("slow error of the receiver", slow),
            ("speed noise S_U", f"{p.speed_noise:.3g} m²/s³"),
            ("course-rate noise S_ω", f"{p.course_rate_noise:.3g} rad²/s³"),
            ("course-rate decay α2", f"{p.course_rate_decay:.3g} 1/s"),
            ("mean NIS", f"{self.nis_mean:.2f}, 95 % band {low:.2f} to {high:.2f}: {verdict}"),
        ]


def tune(fixes: Fixes, name: str = "tuned", progress: Callable[[float], None] | None = None) -> Tuned:
    """Fit a profile to the longest track of `fixes`.

    Args:
        fixes: at least a minute of motion.
        name: of the profile.
        progress: called with the share of the work done, 0 to 1.

    Raises InputError when there is too little motion to tell anything.
    """
    fixes = longest_track(fixes)
    moving = _moving(fixes.time, fixes.latitude, fixes.longitude)
    moving[:_SETTLING_FIXES] = False
    if moving.sum() < _FEWEST_FIXES:
        raise InputError(
            f"{moving.sum()} of {len(fixes)} fixes are under way (faster than {_LEAST_SPEED} m/s), "
            f"expected at least {_FEWEST_FIXES} to tune by"
        )
    report = _Progress(progress)

    apart = _thinned(fixes.time, _MOTION_SPACING)
    motion_cost = partial(cost, fixes=fixes.rows(apart), counted=moving[apart])
    base = Profile(name=name, position_std=1.0, speed_noise=1.0, course_rate_noise=1.0)
    rough = [_minimise(motion_cost, base, _MOTION, start, 80, report) for start in _MOTION_STARTS]
    promising = sorted(rough, key=lambda found: found[1])[:2]
    fine = [_minimise(motion_cost, base, _MOTION, each.model_dump(), 250, report) for each, _ in promising]
    motion, _ = min(fine, key=lambda found: found[1])

    full_cost = partial(cost, fixes=fixes, counted=moving)
    # White noise at the full rate that tells as much a second as what was found at the thinned one.
    white_std = motion.position_std * math.sqrt(len(fixes) / len(apart))
    white = motion.model_copy(update={"position_std": white_std})
    candidates = [(white, full_cost(white))]
    for error_time in (2.0, 100.0):
        start = {"position_std": 0.5 * motion.position_std, "error_std": motion.position_std, "error_time": error_time}
        candidates.append(_minimise(full_cost, motion, _RECEIVER, start, 300, report))
    profile, value = min(candidates, key=lambda found: found[1])
    report.done()
    return _tuned(_rounded(profile), value, fixes, moving)


_LEAST_SPEED = 0.5


def longest_track(fixes: Fixes) -> Fixes:
    """The fixes of the vessel that has most of them."""
    fixes = fixes.rows(fixes.has_position).in_order()
    return max((track for _, track in fixes.tracks()), key=len)


def _moving(time, latitude, longitude, half_window=5.0):
    """(n,) bool: displacement over ten seconds says the vessel is under way."""
    first = np.searchsorted(time, time - half_window)
    last = np.minimum(np.searchsorted(time, time + half_window), len(time) - 1)
    speed = np.zeros(len(time))
    for k in range(len(time)):
        i, j = first[k], last[k]
        if time[j] > time[i]:
            north, east = displacement(latitude[j], longitude[j], latitude[i], longitude[i])
            speed[k] = math.hypot(north, east) / (time[j] - time[i])
    return speed > _LEAST_SPEED


def _thinned(time, spacing):
    """Indices of rows at least `spacing` apart (give or take receiver jitter)."""
    chosen, last = [], -np.inf
    for k, moment in enumerate(time):
        if moment - last >= 0.95 * spacing:
            chosen.append(k)
            last = moment
    return np.array(chosen)


def _minimise(objective, base: Profile, names, start, evaluations, report):
    """Nelder–Mead in the logarithms of `names`; returns the best profile and its cost with the prior."""
    from scipy.optimize import minimize

    low, high = (np.log([_BOUNDS[name][k] for name in names]) for k in range(2))
    centre = np.log([_EXPECTED[name][0] for name in names])
    spread = np.array([_EXPECTED[name][1] for name in names])

    def profile_of(logs):
        values = np.exp(np.clip(logs, low, high))
        return base.model_copy(update=dict(zip(names, values.tolist(), strict=True)))

    def penalised(logs):
        report.step()
        return objective(profile_of(logs)) + 0.5 * float((((np.clip(logs, low, high) - centre) / spread) ** 2).sum())

    origin = np.log([start[name] for name in names])
    simplex = np.vstack([origin, origin + np.eye(len(names))])
    options = {"maxfev": evaluations, "xatol": 0.01, "fatol": 0.02, "initial_simplex": simplex}
    found = minimize(penalised, origin, method="Nelder-Mead", options=options)
    return profile_of(found.x), float(found.fun)


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


def _rounded(profile: Profile) -> Profile:
    """Four digits: more would claim more than a log tells."""
    update = {name: float(f"{getattr(profile, name):.4g}") for name in {*_MOTION, *_RECEIVER}}
    return profile.model_copy(update=update)


def _tuned(profile, value, fixes: Fixes, moving) -> Tuned:
    nis = run_rows(profile.model(), (), fixes).nis
    known = moving & np.isfinite(nis)
    good = known & (nis <= GATE)
    n = int(good.sum())
    half = 1.96 * 2.0 / math.sqrt(max(n, 1))
    return Tuned(
        profile=profile,
        fixes=len(fixes),
        moving=int(moving.sum()),
        rejected=int((known & ~good).sum()),
        nis_mean=float(nis[good].mean()) if n else math.nan,
        nis_band=(2.0 - half, 2.0 + half),
        log_likelihood=-value,
    )
