"""Select the profile of a log: vessel class, motion and receiver noise, from the fixes themselves.

The built-in motions are tried on fixes at least a second apart (see `stages` for why), the one of highest likelihood is
fitted from there, also with two modes, and then the receiver noise is fitted to all fixes. Where the receiver errs
slowly, motion and receiver are fitted once more and together, since the first fit attributes the receiver's error to
the motion. What a log does not determine stays near its prior. A log without motion determines little more than the
receiver, and nothing is fitted to it.

Aids are used for the fit of the motion, and their noise is fitted with it. They are not used for that of the receiver:
delayed aids, as most that are filtered, would bias the estimate of receiver noise. Nor is a slow error fitted together
with a motion that aids determine.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from steerway.core.records import Fixes
from steerway.estimation.course.replay import measured_rows, variance_scales
from steerway.estimation.profiles import BUILT_IN, Profile
from steerway.estimation.selection.excerpts import informative, moving
from steerway.estimation.selection.likelihood import cost
from steerway.estimation.selection.parameters import ACCELERATION, INSTRUMENTS, MOTION, OSCILLATION, TURNS
from steerway.estimation.selection.rounding import rounding_std
from steerway.estimation.selection.search import Fit
from steerway.estimation.selection.stages import (
    SPACING,
    Evidence,
    best_model,
    fit_slow_error,
    fitted,
    inflate_noise,
    oscillation_starts,
    receiver,
    together,
    two_mode_starts,
)

_STRETCHES, _STRETCH = 5, 1000
"""Rows looked at, of a longer log: for a selection in a second or two."""
_LEAST_SHARE = 0.1
_FEWEST_FIXES = 60
"""Share and number of rows under way below which nothing is fitted."""
_WHITE = (0.005, 0.02, 0.05, 0.15, 0.5, 1.5, 5.0, 15.0)
_SLOW = ((0.15, 4.0), (0.5, 20.0), (1.5, 100.0))
_AIDS_SPACING = 0.2
"""s between the rows of aids that are used: with more the fit hardly changes."""
_STEPS, _FEW_STEPS = 20, 8
"""Of a search: most have converged, and more would cost a second."""
_FASTER = (1.0, 10.0, 100.0, 1000.0)
"""Factors on the noise of turns at the start of an aided search for two modes."""
_MANY = 0.1
"""Share of fixes with larger reported errors above which these are left out; a few count as outliers, and cost less
than gaps."""


def select_profile(fixes: Fixes, aid: tuple[str, ...] = ()) -> Profile:
    """The profile of highest likelihood of `fixes` and aids, starting from the built-in ones.

    Reports of many vessels (AIS) have a profile of their own.
    """
    if fixes.mmsi is not None:
        return BUILT_IN["ais"]
    aid = tuple(name for name in aid if name in INSTRUMENTS and np.isfinite(getattr(fixes, name)).any())
    fixes = _usual_fixes(measured_rows(fixes, aid))
    whole = Evidence(fixes, informative(fixes), aid)
    positions = whole.of_positions()
    log = positions.excerpt(_STRETCHES, _STRETCH)
    if moving(log.fixes).sum() < max(_FEWEST_FIXES, _LEAST_SHARE * len(log)):
        return _at_rest(log.fixes)
    apart = whole.apart(SPACING, _AIDS_SPACING if aid else SPACING)
    thin = apart.excerpt(_STRETCHES, _STRETCH)
    candidates = _motion_candidates(thin)
    motion = best_model(candidates, thin)
    crowding = len(positions) / apart.fixes.has_position.sum()
    receive = partial(receiver, log, crowding=crowding, steps=_FEW_STEPS, slow_errors=1)
    received = receive(motion.profile)
    if aid:
        return _named(received.profile)
    if not received.profile.error_std:
        slow = fit_slow_error(thin, motion.profile, motion.search.names, steps=_STEPS)
        best = best_model([motion, slow, _with_oscillation(thin, candidates[0])], thin)
        if best is not motion:
            received = slow if best is slow else receive(best.profile)
    profile = _fit_together(positions, log, motion, received) if received.profile.error_std else received.profile
    return _named(inflate_noise(log, profile))


def _fit_together(whole: Evidence, log: Evidence, motion: Fit, received: Fit) -> Profile:
    """Motion and slow error fitted together: on the whole log, as densely as the number of fixes allows."""
    spacing = min(SPACING, whole.counted.mean() * np.ptp(whole.fixes.time) / (_STRETCHES * _STRETCH))
    dense = whole.apart(spacing)
    both = dense.excerpt(_STRETCHES, _STRETCH)
    best = best_model([received, together(both, motion, received)], both)
    is_thinned = best is not received and len(dense) < len(whole)
    return fitted(log, best.profile, ("position_std",), steps=_FEW_STEPS).profile if is_thinned else best.profile


def _usual_fixes(fixes: Fixes) -> Fixes:
    """The fixes of the receiver's usual accuracy: those reported worse are left out where they are many."""
    worse = variance_scales(fixes) > 1.0
    many = len(worse) > 0 and worse.mean() > _MANY
    return replace(fixes.rows(~worse) if many else fixes, position_std=None)


def _classes():
    return [each for each in BUILT_IN.values() if each.name != "ais"]


def _motion_candidates(log: Evidence) -> list[Fit]:
    """A fit of one mode and one of two, with white noise, from the class of highest likelihood."""
    update = {"error_std": 0.0}
    candidates = [each.model_copy(update=update | {"position_std": white}) for each in _classes() for white in _WHITE]
    start = min(candidates, key=log.cost)
    names = (*MOTION, *(ACCELERATION if start.acceleration_std else ()), *log.instruments)
    one = fitted(log, start, names, steps=_STEPS)
    two = fitted(log, min(_two_mode_starts(one.profile, bool(log.aid)), key=log.cost), (*names, *TURNS), steps=_STEPS)
    return [one, two]


def _with_oscillation(log: Evidence, one: Fit) -> Fit:
    """The fit of one mode with wave-induced yaw.

    Only where the receiver has no slow error: the two are alike.
    """
    start = min(oscillation_starts(one.profile), key=log.cost)
    return fitted(log, start, (*one.search.names, *OSCILLATION), steps=_STEPS)


def _two_mode_starts(one: Profile, aided: bool) -> list[Profile]:
    """Where the search for two modes starts.

    A few turns are outliers of one mode to an aid, so that the noise of a turn starts from larger values too.
    """
    return [
        start.model_copy(update={"turn_course_rate_noise": times * start.turn_course_rate_noise})
        for start in two_mode_starts(one)
        for times in (_FASTER if aided else _FASTER[:1])
    ]


def _at_rest(sample: Fixes) -> Profile:
    """The class and receiver of highest likelihood in the table."""
    least = rounding_std(sample)
    candidates = [
        each.model_copy(update={"position_std": max(white, least), "error_std": slow, "error_time": time})
        for each in _classes()
        for white, slow, time in [*((white, 0.0, 60.0) for white in _WHITE), *((0.05, *each) for each in _SLOW)]
    ]
    return _named(min(candidates, key=lambda each: cost(each, sample)))


def _named(profile: Profile) -> Profile:
    p = profile
    turns = f" that turns every {p.straight_time:.2g} s" if p.turn_time else ""
    yaws = f" that swings every {p.yawing_period:.2g} s" if p.yawing_period else ""
    wander = f" and {p.error_std:.2g} m over {p.error_time:.2g} s" if p.error_std else ""
    name = f"{p.name}{turns}{yaws}, fixes with {p.position_std:.2g} m{wander} of noise"
    return p.model_copy(update={"name": name})
