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

from steerway.errors import InputError
from steerway.estimation.fitting import LEAST_SPEED, MOTION, minimise, moving, thinned
from steerway.estimation.likelihood import cost
from steerway.estimation.profiles import GATE, Profile
from steerway.estimation.replay import run_rows
from steerway.records import Fixes

_SETTLING_FIXES = 5
_MOTION_SPACING = 1.0
_FEWEST_FIXES = 60
_WORTH_A_PARAMETER = 4.0
"""−log likelihood by which acceleration has to be better than none."""

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
        numbers = {
            name: getattr(self.profile, name) for name in (*MOTION, "acceleration_std", "error_std", "error_time")
        }
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
        lasting = (
            f"{p.acceleration_std:.3g} m/s² over {p.acceleration_time:.3g} s" if p.acceleration_std else "none found"
        )
        return [
            ("fixes", f"{self.fixes}, {self.moving} under way, {self.rejected} rejected"),
            ("white noise of a fix", f"{p.position_std:.3g} m"),
            ("slow error of the receiver", slow),
            ("speed noise S_U", f"{p.speed_noise:.3g} m²/s³"),
            ("acceleration that lasts", lasting),
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
    under_way = moving(fixes)
    under_way[:_SETTLING_FIXES] = False
    if under_way.sum() < _FEWEST_FIXES:
        raise InputError(
            f"{under_way.sum()} of {len(fixes)} fixes are under way (faster than {LEAST_SPEED} m/s), "
            f"expected at least {_FEWEST_FIXES} to tune by"
        )
    report = _Progress(progress)

    apart = thinned(fixes.time, _MOTION_SPACING)
    motion_cost = partial(cost, fixes=fixes.rows(apart), counted=under_way[apart])
    base = Profile(name=name, position_std=1.0, speed_noise=1.0, course_rate_noise=1.0)
    rough = [minimise(motion_cost, base, MOTION, start, 80, report.step) for start in _MOTION_STARTS]
    promising = sorted(rough, key=lambda found: found[1])[:2]
    fine = [minimise(motion_cost, base, MOTION, each.model_dump(), 250, report.step) for each, _ in promising]
    motion, value = min(fine, key=lambda found: found[1])
    start = motion.model_dump() | {"speed_noise": motion.speed_noise / 30.0, "acceleration_std": 0.2}
    lasting, its_value = minimise(motion_cost, motion, (*MOTION, "acceleration_std"), start, 250, report.step)
    if its_value < value - _WORTH_A_PARAMETER:
        motion = lasting

    full_cost = partial(cost, fixes=fixes, counted=under_way)
    # White noise at the full rate that tells as much a second as what was found at the thinned one.
    white_std = motion.position_std * math.sqrt(len(fixes) / len(apart))
    white = motion.model_copy(update={"position_std": white_std})
    candidates = [(white, full_cost(white))]
    for error_time in (2.0, 100.0):
        start = {"position_std": 0.5 * motion.position_std, "error_std": motion.position_std, "error_time": error_time}
        candidates.append(minimise(full_cost, motion, _RECEIVER, start, 300, report.step))
    profile, value = min(candidates, key=lambda found: found[1])
    report.done()
    return _tuned(_rounded(profile), value, fixes, under_way)


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


def _rounded(profile: Profile) -> Profile:
    """Four digits: more would claim more than a log tells."""
    update = {name: float(f"{getattr(profile, name):.4g}") for name in {*MOTION, "acceleration_std", *_RECEIVER}}
    return profile.model_copy(update=update)


def _tuned(profile, value, fixes: Fixes, under_way) -> Tuned:
    nis = run_rows(profile.model(), (), fixes).nis
    known = under_way & np.isfinite(nis)
    good = known & (nis <= GATE)
    n = int(good.sum())
    half = 1.96 * 2.0 / math.sqrt(max(n, 1))
    return Tuned(
        profile=profile,
        fixes=len(fixes),
        moving=int(under_way.sum()),
        rejected=int((known & ~good).sum()),
        nis_mean=float(nis[good].mean()) if n else math.nan,
        nis_band=(2.0 - half, 2.0 + half),
        log_likelihood=-value,
    )
