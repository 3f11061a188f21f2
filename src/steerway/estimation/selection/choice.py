"""The profile that suits a log: vessel class and receiver quality, found from the fixes themselves.

The built-in motions are tried on fixes at least a second apart (see `stages` for why), the likeliest is fitted from
there, also as a vessel that holds her course and turns by turns, and then the receiver whose noise makes all fixes
likeliest is added. Where that errs slowly, motion and receiver are fitted once more and together, since what the motion
was found on took the receiver's wander for the vessel's. What a log cannot tell stays near what is usual. A log without
way tells little more than the receiver, and nothing is fitted to it.

Instruments that are to aid the estimate have their say in how the vessel moves, and how well they measure is found
with it. They have none in what the receiver errs by: those that are late, as most that filter, would lay it to the
positions. Nor do positions that wander need to be reconciled with a motion that instruments tell.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from steerway.core.records import Fixes
from steerway.estimation.course.replay import doubts, spoken_rows
from steerway.estimation.profiles import BUILT_IN, Profile
from steerway.estimation.selection.excerpts import moving, telling
from steerway.estimation.selection.likelihood import cost
from steerway.estimation.selection.parameters import INSTRUMENTS, LASTING, MOTION, TURNS, YAWING
from steerway.estimation.selection.rounding import rounding_std
from steerway.estimation.selection.search import Fit
from steerway.estimation.selection.stages import (
    SPACING,
    Log,
    alternating,
    cautious,
    found,
    receiver,
    together,
    wandering,
    worthier,
    yawing,
)

_STRETCHES, _STRETCH = 5, 1000
_LEAST_SHARE = 0.1
_FEWEST_FIXES = 60
_WHITE = (0.005, 0.02, 0.05, 0.15, 0.5, 1.5, 5.0, 15.0)
_SLOW = ((0.15, 4.0), (0.5, 20.0), (1.5, 100.0))
_AIDS_SPACING = 0.2
"""s between the rows that aids are heard in: oftener they tell hardly more."""
_STEPS, _FEW_STEPS = 20, 8
_FASTER = (1.0, 10.0, 100.0, 1000.0)
"""By how much more an aided search for two manners may disturb the turns to begin with."""
_MANY = 0.1
"""Share of fixes in doubt from which they would pass for the rule; a few count as outliers, and gaps cost more."""


def suited(fixes: Fixes, aid: tuple[str, ...] = ()) -> Profile:
    """The profile under which `fixes`, and what aids say, are most likely, starting from the built-in ones.

    Reports of many vessels (AIS) have a profile of their own.
    """
    if fixes.mmsi is not None:
        return BUILT_IN["ais"]
    aid = tuple(name for name in aid if name in INSTRUMENTS and np.isfinite(getattr(fixes, name)).any())
    fixes = _undoubted(spoken_rows(fixes, aid))
    voyage = Log(fixes, telling(fixes), aid)
    positions = voyage.of_positions()
    log = positions.excerpt(_STRETCHES, _STRETCH)
    if moving(log.fixes).sum() < max(_FEWEST_FIXES, _LEAST_SHARE * len(log)):
        return _at_rest(log.fixes)
    apart = voyage.apart(SPACING, _AIDS_SPACING if aid else SPACING)
    thin = apart.excerpt(_STRETCHES, _STRETCH)
    manners = _manners(thin)
    motion = worthier(manners, thin)
    crowding = len(positions) / apart.fixes.has_position.sum()
    receive = partial(receiver, log, crowding=crowding, steps=_FEW_STEPS, slow_errors=1)
    received = receive(motion.profile)
    if aid:
        return _named(received.profile)
    if not received.profile.error_std:
        astray = wandering(thin, motion.profile, motion.search.names, steps=_STEPS)
        best = worthier([motion, astray, _steered(thin, manners[0])], thin)
        if best is not motion:
            received = astray if best is astray else receive(best.profile)
    profile = _reconciled(positions, log, motion, received) if received.profile.error_std else received.profile
    return _named(cautious(log, profile))


def _reconciled(voyage: Log, log: Log, motion: Fit, received: Fit) -> Profile:
    """Motion and slow error fitted together: on the whole voyage, as densely as the number of fixes allows."""
    spacing = min(SPACING, voyage.counted.mean() * np.ptp(voyage.fixes.time) / (_STRETCHES * _STRETCH))
    dense = voyage.apart(spacing)
    both = dense.excerpt(_STRETCHES, _STRETCH)
    best = worthier([received, together(both, motion, received)], both)
    is_thinned = best is not received and len(dense) < len(voyage)
    return found(log, best.profile, ("position_std",), steps=_FEW_STEPS).profile if is_thinned else best.profile


def _undoubted(fixes: Fixes) -> Fixes:
    """The fixes that show the receiver as it is as a rule: not those it doubts itself, where these are many."""
    doubted = doubts(fixes) > 1.0
    many = len(doubted) > 0 and doubted.mean() > _MANY
    return replace(fixes.rows(~doubted) if many else fixes, position_std=None)


def _classes():
    return [each for each in BUILT_IN.values() if each.name != "ais"]


def _manners(log: Log) -> list[Fit]:
    """A vessel of one manner of moving and one of two, and white noise, from the likeliest class."""
    update = {"error_std": 0.0}
    candidates = [each.model_copy(update=update | {"position_std": white}) for each in _classes() for white in _WHITE]
    start = min(candidates, key=log.cost)
    names = (*MOTION, *(LASTING if start.acceleration_std else ()), *log.instruments)
    one = found(log, start, names, steps=_STEPS)
    two = found(log, min(_paces(one.profile, bool(log.aid)), key=log.cost), (*names, *TURNS), steps=_STEPS)
    return [one, two]


def _steered(log: Log, one: Fit) -> Fit:
    """The vessel of one manner of moving as one that is steered back to a course she holds.

    To be looked for only where the receiver does not err slowly: its wander would pass for hers.
    """
    start = min(yawing(one.profile), key=log.cost)
    return found(log, start, (*one.search.names, *YAWING), steps=_STEPS)


def _paces(one: Profile, aided: bool) -> list[Profile]:
    """Where the search for two manners begins.

    To an instrument the turns of a log, if they are few, are outliers from the one manner: it says little of them.
    """
    return [
        pace.model_copy(update={"turn_course_rate_noise": times * pace.turn_course_rate_noise})
        for pace in alternating(one)
        for times in (_FASTER if aided else _FASTER[:1])
    ]


def _at_rest(sample: Fixes) -> Profile:
    """A class and a receiver, as likely as any of the table."""
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
