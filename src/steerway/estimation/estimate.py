"""`estimate`: the main job in one call, with a profile found from the log where none is given."""

from pathlib import Path

import numpy as np

from steerway.estimation.filter import FiveStateFilter
from steerway.estimation.profiles import BUILT_IN, Profile
from steerway.estimation.replay import run_positions
from steerway.records import Fixes, Motion

_SAMPLE = 5000


def estimate(
    fixes: Fixes,
    profile: Profile | str | Path | None = None,
    aid: tuple[str, ...] = (),
    rate: float | None = None,
    smooth: bool = False,
) -> Motion:
    """SOG, COG and course rate of every vessel in `fixes`.

    Args:
        fixes: what receivers said.
        profile: a Profile, the name of a built-in one or a .toml file; None takes the built-in one under which the
            fixes are most likely.
        aid: what to take beside positions, of "sog", "cog", "heading", "water_speed", "yaw_rate".
        rate: rows a second in the result (Hz); None gives a row a fix.
        smooth: let every row know the whole record (Rauch–Tung–Striebel).

    Raises InputError for an unknown profile, aid or rate.
    """
    chosen = choose_profile(fixes, profile)
    estimator = FiveStateFilter(chosen, aid)
    return estimator.smooth(fixes, rate) if smooth else estimator.filter(fixes, rate)


def choose_profile(fixes: Fixes, profile: Profile | str | Path | None = None) -> Profile:
    """The profile meant by `profile`, or for None the built-in one that makes the longest track most likely."""
    if isinstance(profile, Profile):
        return profile
    if profile is not None:
        return Profile.load(profile) if str(profile).endswith(".toml") else Profile.named(str(profile))
    if fixes.mmsi is not None:
        return BUILT_IN["ais"]
    sample = fixes.rows(fixes.has_position).in_order().rows(slice(0, _SAMPLE))
    return max(BUILT_IN.values(), key=lambda each: _log_likelihood(each, sample))


def _log_likelihood(profile: Profile, fixes: Fixes) -> float:
    run = run_positions(profile.model(), fixes.time, fixes.latitude, fixes.longitude)
    known = np.isfinite(run.nis)
    # Cauchy tails: a profile is not to be chosen for the outliers it would reject.
    return -float(np.sum(0.5 * run.log_determinant[known] + 1.5 * np.log1p(run.nis[known])))
