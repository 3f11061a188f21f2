"""The steps of a fit, each from where the last one ended: manners of moving, the receiver's error, all together.

The motion is fitted first, to fixes at least a second apart and white noise: a receiver's fixes a fraction of a second
apart err alike, and taken as independent they would make every wobble of theirs a turn of the vessel. Then the
receiver, white and slow error, to all fixes with the motion held. Fitted together from anywhere the two explain each
other away; from where these two steps end they do not, and what was held too high or too low finds its place.

A manner, an acceleration or a slow error is kept if it is worth its parameters.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from steerway.core.records import Fixes
from steerway.estimation.profiles import GATE, Profile
from steerway.estimation.selection.excerpts import spaced, stretches
from steerway.estimation.selection.likelihood import OPEN_GATE, surprises
from steerway.estimation.selection.parameters import (
    BOUNDS,
    DRIFT,
    EXPECTED,
    INSTRUMENTS,
    LASTING,
    MOTION,
    SLOW_ERROR,
    TURNS,
    YAWING,
)
from steerway.estimation.selection.rounding import rounding_std
from steerway.estimation.selection.search import Fit, Search, minimise

SPACING = 1.0
"""s between the fixes that tell of the motion."""
_WORTH_A_PARAMETER = 2.0
"""−log likelihood by which each further parameter has to better a fit."""
_CAUTION, _WORTH_CAUTION = tuple(1.05**k for k in range(1, 15)), 10.0
"""Factors on standard deviations, and the −log likelihood that more noise has to gain."""
_FIRST_STEPS = 5
_SEA = 0.9
"""1/s: a course rate that decays faster is no turn."""
_SHARES = (0.5, 1.0, 3.0)
_ERROR_TIMES = (1.5, 5.0, 20.0, 100.0, 400.0)
"""Where the search for a slow error begins: how large, of the white noise, and over how long (s)."""
_WANDER = 2.0, 50.0
"""… and where no search has found any."""
_ALTERNATIONS = ((40.0, 10.0, 100.0), (400.0, 100.0, 100.0), (100.0, 30.0, 1000.0))
"""Where the search for two manners begins: how long a course is held, how long a turn lasts (s), and how much less the
course rate is disturbed on a held course than in one manner for both."""

_PERIODS, _HOLDING_TIMES, _STEADIER = (5.0, 8.0, 12.0, 20.0, 35.0), (8.0, 30.0), (1.0, 0.2)
"""Where the search for yawing begins: its period (s), for how long a course is held (s), and how much less the course
rate is disturbed than if it came from nowhere."""


@dataclass(frozen=True)
class Log:
    """Rows to be explained, which of them count, (n,) bool, by what beside positions, and the gate that they pass."""

    fixes: Fixes
    counted: np.ndarray
    aid: tuple[str, ...] = ()
    gate: float = OPEN_GATE

    def __len__(self) -> int:
        return len(self.fixes)

    def of_positions(self) -> Self:
        """Rows with a position, and what they say of it."""
        placed = self.fixes.has_position
        return replace(self, fixes=self.fixes.rows(placed), counted=self.counted[placed], aid=())

    def apart(self, spacing: float, aids_spacing: float = math.inf) -> Self:
        """Only positions at least so many seconds apart; see `spaced`."""
        fixes = spaced(self.fixes, spacing, min(aids_spacing, spacing))
        counted = self.counted[np.searchsorted(self.fixes.time, fixes.time)]
        return replace(self, fixes=fixes, counted=counted)

    def excerpt(self, count: int, length: int) -> Self:
        """At most `count` stretches of so many rows, each a track; the whole log if it is hardly longer."""
        rows = stretches(self.counted, count, length)
        fixes, counted = self.fixes.rows(rows.ravel()), self.counted[rows.ravel()]
        each = {"mmsi": np.repeat(np.arange(count), length)} if len(rows) > 1 else {}
        return replace(self, fixes=replace(fixes, **each), counted=counted)

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Least and largest value of every parameter: no white noise is less than what positions are rounded to."""
        least, largest = BOUNDS["position_std"]
        return BOUNDS | {"position_std": (max(least, rounding_std(self.fixes)), largest)}

    def surprises(self, profile: Profile) -> np.ndarray:
        """(n,) −log likelihood of every row."""
        return surprises(profile, self.fixes, self.counted, self.aid, self.gate)

    @property
    def instruments(self) -> tuple[str, ...]:
        """What of a profile says how well the instruments measure."""
        return tuple(name for each in self.aid for name in INSTRUMENTS[each])

    def cost(self, profile: Profile) -> float:
        """−log likelihood of all."""
        return float(self.surprises(profile).sum())


def found(log: Log, start: Profile, names, step=None, steps=40, expected=EXPECTED) -> Fit:
    """The likeliest values of `names`, from those of a profile."""
    search = Search(log.surprises, start, tuple(names), expected, log.bounds, step or (lambda: None))
    return minimise(search, start, steps)


def cautious(log: Log, profile: Profile) -> Profile:
    """As much more noise of every kind as makes a log likeliest to a filter that refuses fixes.

    Where outliers are not rare, a filter that is as sure of itself as most fixes allow refuses too many. More noise of
    motion and receiver alike leaves its gains as they are.
    """
    filtering = replace(log, gate=GATE)
    best = min((_noisier(profile, factor) for factor in _CAUTION), key=filtering.cost)
    return best if filtering.cost(profile) - filtering.cost(best) > _WORTH_CAUTION else profile


def _noisier(profile, factor) -> Profile:
    densities = ("speed_noise", "course_rate_noise", "turn_speed_noise", "turn_course_rate_noise")
    powers = dict.fromkeys(densities, 2) | dict.fromkeys(
        ("position_std", "error_std", "drift_std", "acceleration_std"), 1
    )
    return profile.model_copy(update={name: getattr(profile, name) * factor**k for name, k in powers.items()})


def worthier(fits, log: Log) -> Fit:
    """The fit that explains a log best, where every parameter has to earn its place.

    Turns are something that lasts: two manners that differ in how fast the course rate changes at random are a sea, not
    a helm, and are left out where there is anything else.
    """
    sensible = [fit for fit in fits if not fit.profile.turn_time or fit.profile.turn_course_rate_decay < _SEA]
    return min(sensible or fits, key=lambda fit: log.cost(fit.profile) + _WORTH_A_PARAMETER * len(fit.search.names))


def motion(log: Log, starts, step=None) -> Fit:
    """Manners of moving, and white noise, from the best two of `starts`."""
    find = partial(found, log, step=step)
    best = sorted(starts, key=log.cost)[:2]
    one = min((find(each, MOTION) for each in best), key=lambda fit: fit.cost)
    lasting = one.profile.model_copy(update={"speed_noise": one.profile.speed_noise / 30.0, "acceleration_std": 0.2})
    fits = [one, find(lasting, MOTION + LASTING)]
    # With turns told apart she may need no acceleration after all.
    bases = fits if worthier(fits, log) is fits[1] else fits[:1]
    for base in bases:
        paces = sorted(alternating(base.profile), key=log.cost)[:2]
        fits = [*fits, *(find(each, base.search.names + TURNS) for each in paces)]
    return worthier(fits, log)


def alternating(one: Profile) -> list[Profile]:
    """Two manners of moving on either side of one that was to serve for both, alternating at several paces."""
    return [
        one.model_copy(
            update={
                "straight_time": straight,
                "turn_time": turn,
                "speed_noise": one.speed_noise / 2.0,
                "turn_speed_noise": one.speed_noise * 2.0,
                "course_rate_noise": one.course_rate_noise / steadier,
                "turn_course_rate_noise": one.course_rate_noise * 3.0,
                "turn_course_rate_decay": one.course_rate_decay,
            }
        )
        for straight, turn, steadier in _ALTERNATIONS
    ]


def yawing(one: Profile) -> list[Profile]:
    """The same vessel steered back to a course she holds, with several periods."""
    return [
        one.model_copy(
            update={"yawing_period": period, "yawing_time": time, "course_rate_noise": one.course_rate_noise * share}
        )
        for period in _PERIODS
        for time in _HOLDING_TIMES
        for share in _STEADIER
    ]


def spread_over(motion: Profile, crowding: float) -> Profile:
    """White noise at a rate `crowding` times that of the fixes it was found on, which tells as much a second."""
    return motion.model_copy(update={"position_std": motion.position_std * math.sqrt(crowding)})


def receiver(log: Log, held: Profile, crowding: float, step=None, steps=40, slow_errors=2) -> Fit:
    """The receiver's errors under a motion that was found at a rate of fixes `crowding` times less.

    At most so many slow errors; each joins what is there already, in the likeliest of several sizes and times.
    """
    find = partial(found, log, step=step, steps=steps)
    white = find(held, ("position_std",))
    spread = spread_over(held, crowding)
    fits = [white, find(spread, ("position_std",), steps=0)]
    joined, names = white, white.search.names
    for std, time in (SLOW_ERROR, DRIFT)[:slow_errors]:
        size, names = joined.profile.position_std, (*names, std, time)
        starts = [
            joined.profile.model_copy(update={std: share * size, time: seconds})
            for share in _SHARES
            for seconds in _ERROR_TIMES
        ]
        best = sorted(starts, key=log.cost)[:2]
        joined = min((find(each, names) for each in best), key=lambda fit: fit.cost)
        fits.append(joined)
    return worthier(fits, log)


def together(log: Log, moving: Fit, received: Fit, step=None) -> Fit:
    """All that was found, once more and at once; with the receiver known, two manners or yawing may show."""
    names = tuple(dict.fromkeys((*moving.search.names, *received.search.names)))
    if received.profile.error_std:
        fits = [_best(log, [received.profile, _calmer(received.profile)], names, step)]
    else:
        fits = [found(log, received.profile, names, step), wandering(log, received.profile, names, step)]
    best = worthier(fits, log)
    if not moving.profile.turn_time:
        further = [(alternating, TURNS)]
        if not best.profile.error_std:  # whose wander resembles her swings
            further.append((yawing, YAWING))
        for starts, more in further:
            start = min(starts(best.profile), key=log.cost)
            fits.append(found(log, start, (*best.search.names, *more), step))
    return worthier(fits, log)


def wandering(log: Log, white: Profile, names, step=None, steps=40) -> Fit:
    """What was found with a receiver that does not wander, as that of one that does and a calmer vessel.

    Beside the motion that took its wander for the vessel's no search finds a slow error.
    """
    size, time = _WANDER
    start = white.model_copy(update={"error_std": size * white.position_std, "error_time": time})
    return found(log, _calmer(start), (*names, *SLOW_ERROR), step, steps)


def _best(log, starts, names, step) -> Fit:
    """The fit from the start that has come down furthest after a few steps."""
    begun = [found(log, each, names, step, steps=_FIRST_STEPS) for each in starts]
    return found(log, min(begun, key=lambda fit: fit.cost).profile, names, step)


def _calmer(profile: Profile) -> Profile:
    """More of what was seen laid to the receiver, and less to the vessel."""
    shares = {name: 0.03 for name in type(profile).model_fields if name.endswith(("speed_noise", "course_rate_noise"))}
    shares |= {"error_std": 2.0, "error_time": 4.0}
    return profile.model_copy(update={name: share * getattr(profile, name) for name, share in shares.items()})
