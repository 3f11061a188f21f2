"""`estimate`: the main job in one call, with a profile found from the log where none is given."""

from pathlib import Path

from steerway.estimation.filter import FiveStateFilter
from steerway.estimation.likelihood import cost
from steerway.estimation.profiles import BUILT_IN, Profile
from steerway.records import Fixes, Motion

_SAMPLE = 5000
_NOISE_FACTORS = (1.0, 3.0, 10.0, 30.0)


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
        profile: a Profile, the name of a built-in one or a .toml file; None takes the built-in one, and the noise of
            fixes, under which these are most likely.
        aid: what to take beside positions, of "sog", "cog", "heading", "water_speed", "yaw_rate".
        rate: rows a second in the result (Hz); None gives a row a fix.
        smooth: let every row know the whole record (Rauch–Tung–Striebel).

    Raises InputError for an unknown profile, aid or rate.
    """
    chosen = choose_profile(fixes, profile)
    estimator = FiveStateFilter(chosen, aid)
    return estimator.smooth(fixes, rate) if smooth else estimator.filter(fixes, rate)


def choose_profile(fixes: Fixes, profile: Profile | str | Path | None = None) -> Profile:
    """The profile meant by `profile`; for None the built-in one, and the noise of the receiver, that fit best."""
    if isinstance(profile, Profile):
        return profile
    if profile is not None:
        return Profile.load(profile) if str(profile).endswith(".toml") else Profile.named(str(profile))
    sample = fixes.rows(fixes.has_position).in_order().rows(slice(0, _SAMPLE))
    vessels = (BUILT_IN["ais"],) if fixes.mmsi is not None else BUILT_IN.values()
    candidates = [_noisier(each, factor) for each in vessels for factor in _NOISE_FACTORS]
    return min(candidates, key=lambda each: cost(each, sample))


def _noisier(profile: Profile, factor: float) -> Profile:
    if factor == 1.0:
        return profile
    update = {"name": f"{profile.name}, fixes {factor:g} times noisier", "position_std": factor * profile.position_std}
    return profile.model_copy(update=update)
