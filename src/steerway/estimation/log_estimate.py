"""`estimate`: the main job in one call, with the vessel and her receiver inferred from the log itself."""

from pathlib import Path

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.estimation.course.filter import FiveStateFilter
from steerway.estimation.inference.selection import Inference
from steerway.estimation.inference.whole_log import infer_log, motion_of
from steerway.estimation.profiles import Profile
from steerway.estimation.selection.select_profile import select_profile


def estimate(
    fixes: Fixes,
    profile: Profile | str | Path | None = None,
    aid: tuple[str, ...] = (),
    rate: float | None = None,
    smooth: bool = False,
) -> Motion:
    """SOG, COG and course rate of every vessel in `fixes`.

    Args:
        fixes: measurements of receivers and instruments. Accuracy that a receiver reports (`position_std`) scales the
            noise of a fix relative to what it usually reports.
        profile: a Profile, the name of a built-in one or a .toml file. None infers vessel and receiver from the log:
            several structures are fitted, and the estimate is their mean, weighted by their evidence. Reports of many
            vessels (with `mmsi`) are filtered by the built-in profile "ais" then, and sparse fixes by the built-in
            profile that fits best.
        aid: what to use beside positions, of "sog", "cog", "heading", "water_speed", "yaw_rate". Their noise is
            inferred too where no profile is given.
        rate: rows a second in the result (Hz); None gives a row a fix.
        smooth: use the whole record for every row (fixed-interval smoothing).

    Raises InputError for an unknown profile, aid or rate, and for a log of one vessel with fewer than two positions.
    """
    return LogEstimator(fixes, profile, aid).motion(fixes, rate, smooth)


class LogEstimator:
    """The estimator of a log: by a profile, or by what is inferred from the log; arguments as `estimate`.

    `name` is that of the profile or "inferred", `inference` None or what was inferred.
    """

    name: str
    inference: Inference | None

    def __init__(self, fixes: Fixes, profile: Profile | str | Path | None = None, aid: tuple[str, ...] = ()):
        self.aid = tuple(aid)
        _refuse_single(fixes)
        if profile is None and fixes.mmsi is None and not _sparse(fixes):
            self.name, self.inference = "inferred", infer_log(fixes, self.aid)
        else:
            chosen = choose_profile(fixes, profile, self.aid)
            self.name, self.inference = chosen.name, None
            self._filter = FiveStateFilter(chosen, self.aid)

    def motion(self, fixes: Fixes, rate: float | None = None, smooth: bool = False) -> Motion:
        """The estimate of the log or a part of it. Raises InputError for an impossible rate."""
        if self.inference is not None:
            return motion_of(fixes, self.inference, self.aid, rate, smooth)
        return self._filter.smooth(fixes, rate) if smooth else self._filter.filter(fixes, rate)

    def smooth(self, fixes: Fixes) -> Motion:
        """The smoothed estimate of the log or a part of it."""
        return self.motion(fixes, smooth=True)


def _refuse_single(fixes: Fixes) -> None:
    """InputError for the log of one vessel without two positions at different times."""
    times = fixes.time[fixes.has_position]
    if fixes.mmsi is None and not (len(times) and times.max() > times.min()):
        found = f"{len(times)} positions at one time" if len(times) > 1 else f"{len(times)} position"
        raise InputError(f"the log has {found}, expected at least two at different times")


SPARSE = 60.0
"""s between fixes; at longer intervals manoeuvres begin and end unseen, and modes cannot be distinguished."""


def _sparse(fixes: Fixes) -> bool:
    times = fixes.time[fixes.has_position]
    return len(times) > 1 and float(np.median(np.diff(times))) > SPARSE


def choose_profile(fixes: Fixes, profile: Profile | str | Path | None = None, aid: tuple[str, ...] = ()) -> Profile:
    """The profile meant by `profile`; for None the built-in one, and the noise of the receiver, that fit best.

    The noise of the aids in use is fitted with it.
    """
    if isinstance(profile, Profile):
        return profile
    if profile is not None:
        return Profile.load(profile) if str(profile).endswith(".toml") else Profile.named(str(profile))
    return select_profile(fixes, tuple(aid))
