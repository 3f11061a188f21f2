"""Who is judged on a log: the product as it comes, tuned, smoothed; a plain EKF."""

from dataclasses import dataclass

import numpy as np

import steerway
from steerway.estimation import choose_profile
from steerway_studies.unseen_logs import plain_ekf
from steerway_studies.unseen_logs.recordings import JudgedLog

DEFAULT, TUNED, SMOOTHED, TUNED_SMOOTHED = "default", "tuned", "smoothed", "tuned_smoothed"
EKF = "plain_ekf"
WORDS = {
    DEFAULT: "default, causal",
    SMOOTHED: "default, smoothed",
    TUNED: "tuned, causal",
    TUNED_SMOOTHED: "tuned, smoothed",
    EKF: "plain EKF, fitted",
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
    return found


def of_motion(time, motion: steerway.Motion) -> Reported:
    """A Motion at the times of the fixes (n,)."""
    row = np.searchsorted(motion.time, time - 1e-4).clip(0, len(motion) - 1)
    refused = motion.to_frame()["status"].to_numpy() == "rejected"
    stds = motion.sog_std, motion.cog_std, motion.course_rate_std
    return Reported(*(each[row] for each in (motion.sog, motion.cog, motion.course_rate, *stds, refused)))
