"""Stages of a fit, each from where the last one ended: motion, the receiver's error, all together.

The motion is fitted first, to fixes at least a second apart and white noise: a receiver's fixes a fraction of a second
apart err alike, and taken as independent they would make every error of theirs a turn of the vessel. Then the
receiver, white and slow error, to all fixes with the motion held. Fitted together from anywhere the two compete;
from where these two stages end they do not, and what was held too high or too low is corrected.

A second mode, an acceleration or a slow error is kept where its gain in likelihood exceeds the cost of its parameters.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from steerway.core.records import Fixes
from steerway.estimation.course.update.outliers import FIX_GATE
from steerway.estimation.profiles import Profile
from steerway.estimation.selection.excerpts import spaced, stretches
from steerway.estimation.selection.likelihood import OPEN_GATE, row_nll
from steerway.estimation.selection.parameters import (
    ACCELERATION,
    BOUNDS,
    DRIFT,
    INSTRUMENTS,
    MOTION,
    OSCILLATION,
    PRIOR,
    SLOW_ERROR,
    TURNS,
)
from steerway.estimation.selection.rounding import rounding_std
from steerway.estimation.selection.search import Fit, Search, minimise

SPACING = 1.0
"""s between the fixes that the motion is fitted to: errors of a receiver closer together are correlated."""
_PARAMETER_COST = 2.0
"""−log likelihood that each further parameter has to gain: 2 where Akaike's criterion has 1, for rows that are not
quite independent."""
_INFLATION, _INFLATION_GAIN = tuple(1.05**k for k in range(1, 15)), 10.0
"""Factors on standard deviations, up to two, and the −log likelihood that more noise has to gain."""
_FIRST_STEPS = 5
"""Of a search, by which the better start shows."""
_WAVE_DECAY = 0.9
"""1/s: a course rate that decays faster is wave motion, no turn."""
_SHARES = (0.5, 1.0, 3.0)
_ERROR_TIMES = (1.5, 5.0, 20.0, 100.0, 400.0)
"""Where the search for a slow error begins: how large, of the white noise, and over how long (s)."""
_SLOW_START = 2.0, 50.0
"""… and where no search has found any."""
_ALTERNATIONS = ((40.0, 10.0, 100.0), (400.0, 100.0, 100.0), (100.0, 30.0, 1000.0))
"""Where the search for two modes starts: mean duration of a held course and of a turn (s), and the ratio of the noise
of the course rate in one mode to that on a held course."""

_PERIODS, _HOLDING_TIMES, _STEADIER = (5.0, 8.0, 12.0, 20.0, 35.0), (8.0, 30.0), (1.0, 0.2)
"""Where the search for wave-induced yaw starts: its period, the time constant of the mean course (s), and the ratio of
the noise of the course rate to that without it."""


@dataclass(frozen=True)
class Evidence:
    """Rows that a model is fitted to, which of them count, (n,) bool, the aids used, and the gate on the NIS."""

    fixes: Fixes
    counted: np.ndarray
    aid: tuple[str, ...] = ()
    gate: float = OPEN_GATE

    def __len__(self) -> int:
        return len(self.fixes)

    def of_positions(self) -> Self:
        """Rows with a position, without aids."""
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
        """Least and largest value of every parameter: white noise is not less than that of rounding."""
        least, largest = BOUNDS["position_std"]
        return BOUNDS | {"position_std": (max(least, rounding_std(self.fixes)), largest)}

    def row_nll(self, profile: Profile) -> np.ndarray:
        """(n,) −log likelihood of every row."""
        return row_nll(profile, self.fixes, self.counted, self.aid, self.gate)

    @property
    def instruments(self) -> tuple[str, ...]:
        """Keys of a profile with the noise of the aids."""
        return tuple(name for each in self.aid for name in INSTRUMENTS[each])

    def cost(self, profile: Profile) -> float:
        """−log likelihood of all."""
        return float(self.row_nll(profile).sum())


def fitted(log: Evidence, start: Profile, names, step=None, steps=40, expected=PRIOR) -> Fit:
    """Fit the parameters `names`, from the values of a profile."""
    search = Search(log.row_nll, start, tuple(names), expected, log.bounds, step or (lambda: None))
    return minimise(search, start, steps)


def inflate_noise(log: Evidence, profile: Profile) -> Profile:
    """The profile with all noise larger by the factor of highest likelihood for a filter that rejects outliers.

    Where outliers are not rare, a filter consistent with most fixes rejects too many. More noise of motion and
    receiver alike leaves its gains as they are.
    """
    filtering = replace(log, gate=FIX_GATE)
    best = min((_noisier(profile, factor) for factor in _INFLATION), key=filtering.cost)
    return best if filtering.cost(profile) - filtering.cost(best) > _INFLATION_GAIN else profile


def _noisier(profile, factor) -> Profile:
    densities = ("speed_noise", "course_rate_noise", "turn_speed_noise", "turn_course_rate_noise")
    powers = dict.fromkeys(densities, 2) | dict.fromkeys(
        ("position_std", "error_std", "drift_std", "acceleration_std"), 1
    )
    return profile.model_copy(update={name: getattr(profile, name) * factor**k for name, k in powers.items()})


def best_model(fits, log: Evidence) -> Fit:
    """The fit of highest likelihood, less the cost of its parameters.

    Rejects two-mode fits whose turn rate decays faster than 0.9 1/s where there are others: wave motion.
    """
    sensible = [fit for fit in fits if not fit.profile.turn_time or fit.profile.turn_course_rate_decay < _WAVE_DECAY]
    return min(sensible or fits, key=lambda fit: log.cost(fit.profile) + _PARAMETER_COST * len(fit.search.names))


def motion(log: Evidence, starts, step=None) -> Fit:
    """Fit the motion, and white noise, from the best two of `starts`."""
    find = partial(fitted, log, step=step)
    best = sorted(starts, key=log.cost)[:2]
    one = min((find(each, MOTION) for each in best), key=lambda fit: fit.cost)
    accelerating = one.profile.model_copy(
        update={"speed_noise": one.profile.speed_noise / 30.0, "acceleration_std": 0.2}
    )
    fits = [one, find(accelerating, MOTION + ACCELERATION)]
    # With two modes the acceleration may be superfluous.
    bases = fits if best_model(fits, log) is fits[1] else fits[:1]
    for base in bases:
        near = sorted(two_mode_starts(base.profile), key=log.cost)[:2]
        fits = [*fits, *(find(each, base.search.names + TURNS) for each in near)]
    return best_model(fits, log)


def two_mode_starts(one: Profile) -> list[Profile]:
    """Profiles of two modes on either side of one mode, with several durations."""
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


def oscillation_starts(one: Profile) -> list[Profile]:
    """The same motion with wave-induced yaw of several periods."""
    return [
        one.model_copy(
            update={"yawing_period": period, "yawing_time": time, "course_rate_noise": one.course_rate_noise * share}
        )
        for period in _PERIODS
        for time in _HOLDING_TIMES
        for share in _STEADIER
    ]


def with_white_noise_at(motion: Profile, crowding: float) -> Profile:
    """White noise of equal information a second at a rate `crowding` times that of the fixes it was fitted to."""
    return motion.model_copy(update={"position_std": motion.position_std * math.sqrt(crowding)})


def receiver(log: Evidence, held: Profile, crowding: float, step=None, steps=40, slow_errors=2) -> Fit:
    """Fit the receiver's errors under a motion that was fitted at a rate of fixes `crowding` times less.

    At most so many slow errors; each is added to those before, from the best two of several sizes and times.
    """
    find = partial(fitted, log, step=step, steps=steps)
    white = find(held, ("position_std",))
    spread = with_white_noise_at(held, crowding)
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
    return best_model(fits, log)


def together(log: Evidence, moving: Fit, received: Fit, step=None) -> Fit:
    """Fit motion and receiver together; with the receiver known, two modes or wave-induced yaw are tried again."""
    names = tuple(dict.fromkeys((*moving.search.names, *received.search.names)))
    if received.profile.error_std:
        fits = [_best(log, [received.profile, _more_receiver_noise(received.profile)], names, step)]
    else:
        fits = [fitted(log, received.profile, names, step), fit_slow_error(log, received.profile, names, step)]
    best = best_model(fits, log)
    if not moving.profile.turn_time:
        further = [(two_mode_starts, TURNS)]
        if not best.profile.error_std:  # which is like wave-induced yaw
            further.append((oscillation_starts, OSCILLATION))
        for starts, more in further:
            start = min(starts(best.profile), key=log.cost)
            fits.append(fitted(log, start, (*best.search.names, *more), step))
    return best_model(fits, log)


def fit_slow_error(log: Evidence, white: Profile, names, step=None, steps=40) -> Fit:
    """Fit a slow error of the receiver, and less noise of motion to start with.

    From a motion that was fitted to the slow error too, no search finds it.
    """
    size, time = _SLOW_START
    start = white.model_copy(update={"error_std": size * white.position_std, "error_time": time})
    return fitted(log, _more_receiver_noise(start), (*names, *SLOW_ERROR), step, steps)


def _best(log, starts, names, step) -> Fit:
    """The fit from the start with the least cost after a few steps."""
    begun = [fitted(log, each, names, step, steps=_FIRST_STEPS) for each in starts]
    return fitted(log, min(begun, key=lambda fit: fit.cost).profile, names, step)


def _more_receiver_noise(profile: Profile) -> Profile:
    """More noise of the receiver, and less of the motion."""
    shares = {name: 0.03 for name in type(profile).model_fields if name.endswith(("speed_noise", "course_rate_noise"))}
    shares |= {"error_std": 2.0, "error_time": 4.0}
    return profile.model_copy(update={name: share * getattr(profile, name) for name, share in shares.items()})
