"""`estimate`: the main job in one call, with a profile found from the log where none is given."""

from pathlib import Path

from steerway.core.records import Fixes, Motion
from steerway.estimation.course.filter import FiveStateFilter
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
        fixes: measurements of receivers and instruments.
        profile: a Profile, the name of a built-in one or a .toml file; None takes the built-in one, and the noise of
            fixes, of highest likelihood.
        aid: what to use beside positions, of "sog", "cog", "heading", "water_speed", "yaw_rate".
        rate: rows a second in the result (Hz); None gives a row a fix.
        smooth: use the whole record for every row (fixed-interval smoothing).

    Raises InputError for an unknown profile, aid or rate.
    """
    chosen = choose_profile(fixes, profile, aid)
    estimator = FiveStateFilter(chosen, aid)
    return estimator.smooth(fixes, rate) if smooth else estimator.filter(fixes, rate)


def choose_profile(fixes: Fixes, profile: Profile | str | Path | None = None, aid: tuple[str, ...] = ()) -> Profile:
    """The profile meant by `profile`; for None the built-in one, and the noise of the receiver, that fit best.

    The noise of the aids in use is fitted with it.
    """
    if isinstance(profile, Profile):
        return profile
    if profile is not None:
        return Profile.load(profile) if str(profile).endswith(".toml") else Profile.named(str(profile))
    return select_profile(fixes, tuple(aid))
