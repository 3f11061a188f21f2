"""Whether tuning predicts a part of the log that it has not seen better or worse than the default does.

Both look at the first four fifths; over the last fifth each says from every fix, causally, where the next one will be.
Judged is the mean distance between the displacement predicted and the one that came: public names alone tell it, and
a mean of distances is not ruled by wrong fixes as a mean of squares is.
"""

import math

import numpy as np

import steerway
from steerway.estimation import choose_profile
from steerway_studies.unseen_logs.contestants import of_motion
from steerway_studies.unseen_logs.recordings import Recording

SEEN = 0.8
AHEAD = 2.0  # s
_WORSE = 1.01


def held_back(recording: Recording) -> tuple[float, float]:
    """Mean error (m) of the displacement predicted for two seconds, or the next fix: (default, tuned)."""
    fixes = recording.fixes
    begin = fixes.time[0] + SEEN * (fixes.time[-1] - fixes.time[0])
    seen = fixes.between(None, begin)
    try:
        profiles = choose_profile(seen), steerway.tune(seen).profile
    except steerway.InputError:
        return math.nan, math.nan
    errors = [prediction_error(recording, steerway.estimate(fixes, profile)) for profile in profiles]
    rows = (fixes.time >= begin) & np.isfinite(errors[0]) & np.isfinite(errors[1])
    return tuple(float(error[rows].mean()) if rows.any() else math.nan for error in errors)


def prediction_error(recording: Recording, motion: steerway.Motion) -> np.ndarray:
    """(n,) m between where a fix two seconds on (or the next) is seen from this one, and where the motion leads."""
    time, places = recording.fixes.time, recording.places
    said = of_motion(time, motion)
    later = np.maximum(np.searchsorted(time, time + AHEAD - 1e-3), np.arange(len(time)) + 1)
    there = later < len(time)
    later = later.clip(0, len(time) - 1)
    elapsed = time[later] - time
    there &= elapsed <= 2.0 * max(AHEAD, float(np.median(np.diff(time))))
    turn = np.where(np.isfinite(said.rate), said.rate, 0.0) * elapsed
    with np.errstate(invalid="ignore"):
        chord = said.sog * elapsed * np.sinc(0.5 * turn / np.pi)
    course = np.where(np.isfinite(said.cog), said.cog, 0.0) + 0.5 * turn
    # Without a course it is at rest or below steerageway: it is predicted to stay.
    chord = np.where(np.isfinite(said.cog), chord, 0.0)
    moved = places[later] - places
    error = np.hypot(moved[:, 0] - chord * np.cos(course), moved[:, 1] - chord * np.sin(course))
    return np.where(there & np.isfinite(said.sog), error, np.nan)


def worse(default: float, tuned: float) -> bool:
    """Whether tuning lost: more than a hundredth further off."""
    return tuned > _WORSE * default
