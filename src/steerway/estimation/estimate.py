"""`estimate`: the main job in one call, with a profile found from the log where none is given."""

from pathlib import Path

from steerway.estimation.filter import FiveStateFilter
from steerway.estimation.likelihood import cost
from steerway.estimation.profiles import BUILT_IN, Profile
from steerway.records import Fixes, Motion

_SAMPLE = 5000
_RECEIVERS = (
    *((white, 0.0, 60.0) for white in (0.02, 0.05, 0.15, 0.5, 1.5, 5.0, 15.0)),
    *((0.05, slow, time) for slow, time in ((0.15, 4.0), (0.5, 20.0), (1.5, 100.0))),
)
"""Receivers to choose from: white noise of a fix, slow error and its correlation time (m, m, s)."""


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
    reported = fixes.mmsi is not None
    vessels = [each for each in BUILT_IN.values() if (each.name == "ais") == reported]
    candidates = [_with_receiver(vessel, receiver) for vessel in vessels for receiver in _RECEIVERS]
    return min(candidates, key=lambda each: cost(each, sample))


def _with_receiver(vessel: Profile, receiver: tuple[float, float, float]) -> Profile:
    white, slow, time = receiver
    wander = f" and {slow:g} m over {time:g} s" if slow else ""
    name = f"{vessel.name}, fixes with {white:g} m{wander} of noise"
    update = {"name": name, "position_std": white, "error_std": slow, "error_time": time}
    return vessel.model_copy(update=update)
