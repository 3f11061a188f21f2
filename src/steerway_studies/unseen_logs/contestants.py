"""Who is judged on a log: the product as it comes, tuned, smoothed; a plain EKF, differences, the receiver."""

from dataclasses import dataclass, replace

import numpy as np

import steerway
from steerway.estimation import choose_profile
from steerway_studies.unseen_logs import plain_ekf
from steerway_studies.unseen_logs.recordings import JudgedLog

DEFAULT, TUNED, SMOOTHED, TUNED_SMOOTHED = "default", "tuned", "smoothed", "tuned_smoothed"
EKF, RECEIVER = "plain_ekf", "receiver"
DIFFERENCES = {"difference_1s": 1.0, "difference_2s": 2.0}
WORDS = {
    DEFAULT: "default, causal",
    SMOOTHED: "default, smoothed",
    TUNED: "tuned, causal",
    TUNED_SMOOTHED: "tuned, smoothed",
    EKF: "plain EKF, fitted",
    "difference_1s": "positions, 1 s",
    "difference_2s": "positions, 2 s",
    RECEIVER: "receiver's own",
}


@dataclass(frozen=True, eq=False)
class Reported:
    """What a contestant says at every fix: (n,) each, NaN where nothing. `refused` are the fixes it did not believe."""

    sog: np.ndarray
    cog: np.ndarray
    rate: np.ndarray
    sog_std: np.ndarray
    cog_std: np.ndarray
    rate_std: np.ndarray
    refused: np.ndarray


def contestants(recording: JudgedLog) -> dict[str, Reported]:
    """All of them by name. `tuned` is missing where the log has too little motion to tune by."""
    fixes, places = recording.fixes, recording.places
    found = {}
    try:
        tuned = steerway.tune(fixes)
        profiles = {DEFAULT: tuned.default, TUNED: tuned.profile}
    except steerway.InputError:
        profiles = {DEFAULT: choose_profile(fixes)}
    for name, profile in profiles.items():
        for smooth in (False, True):
            label = {False: name, True: SMOOTHED if name == DEFAULT else TUNED_SMOOTHED}[smooth]
            found[label] = of_motion(fixes.time, steerway.estimate(fixes, profile, smooth=smooth))
    said = plain_ekf.fitted(fixes.time, places).T
    found[EKF] = Reported(said[0], said[1], said[2], said[3], said[4], said[5], np.zeros(len(fixes), dtype=bool))
    found |= {name: difference(fixes.time, places, span) for name, span in DIFFERENCES.items()}
    own = receivers_own(recording)
    return found | ({RECEIVER: own} if own else {})


def receivers_own(recording: JudgedLog) -> Reported | None:
    """The receiver's velocity when it says it, its lag left in; None where the log does not hold it."""
    fixes, reference = recording.fixes, recording.reference
    sog, cog = fixes.sog, fixes.cog
    if reference.own:
        sog, cog, _ = replace(reference, lag=0.0, course_lag=0.0).at(fixes.time)
    unknown = np.full(len(fixes), np.nan)
    own = Reported(sog, cog, unknown, unknown, unknown, unknown, np.zeros(len(fixes), dtype=bool))
    return own if np.isfinite(sog).any() else None


def of_motion(time, motion: steerway.Motion) -> Reported:
    """A Motion at the times of the fixes (n,)."""
    row = np.searchsorted(motion.time, time - 1e-4).clip(0, len(motion) - 1)
    refused = motion.to_frame()["status"].to_numpy() == "rejected"
    stds = motion.sog_std, motion.cog_std, motion.course_rate_std
    return Reported(*(each[row] for each in (motion.sog, motion.cog, motion.course_rate, *stds, refused)))


def difference(time, places, span) -> Reported:
    """Velocity from a fix at least `span` s before; NaN where the one there is, is older than twice that."""
    longest = 2.0 * max(span, float(np.median(np.diff(time))))
    before = np.searchsorted(time, time - span + 1e-3, side="right") - 1
    before = np.minimum(before, np.arange(len(time)) - 1)
    elapsed = np.where(before >= 0, time - time[before], np.nan)
    elapsed = np.where((elapsed > 0.0) & (elapsed <= longest), elapsed, np.nan)
    moved = (places - places[before]) / elapsed[:, None]
    unknown = np.full(len(time), np.nan)
    course = np.arctan2(moved[:, 1], moved[:, 0])
    return Reported(np.hypot(*moved.T), course, unknown, unknown, unknown, unknown, np.zeros(len(time), dtype=bool))
