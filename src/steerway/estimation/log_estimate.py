"""`estimate`: the main job in one call, with the vessel and its receiver inferred from the log itself."""

from pathlib import Path

from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.estimation.fit.auto_aids import AUTO, VELOCITY, velocity_of, velocity_parts
from steerway.estimation.fit.selection import Inference
from steerway.estimation.log.run import infer_log, motion_of
from steerway.estimation.vessel.profile import Profile, profile_of

AnyProfile = Profile | str | Path | None
_ONE_TIME = 1e-3  # s: times of a log that differ by no more are one time that was rounded


def estimate(
    fixes: Fixes,
    profile: AnyProfile = None,
    *,
    aid: tuple[str, ...] = (),
    rate: float | None = None,
    causal: bool = False,
    smooth: bool | None = None,
) -> Motion:
    """SOG, COG and course rate of every vessel in `fixes`, smoothed: every row uses the whole record.

    Args:
        fixes: measurements. The reported accuracy (`position_std`) relative to its usual value scales the noise.
        profile: a profile, the name of a built-in one or a .toml file. None infers vessel and receiver from the log:
            several structures are fitted, and the estimate is their mean, weighted by their evidence. Without a
            profile, reports of many vessels (with `mmsi`) are filtered by the built-in profile "ais".
        aid: measurements to use beside positions, of "sog", "cog", "heading", "water_speed", "yaw_rate". Without a
            profile, their noise is inferred too. "auto" uses the receiver's SOG and COG where they predict the fixes
            better; with a profile, where its structures have parts for them.
        rate: rows per second of the result (Hz); None gives one row for every fix.
        causal: use only earlier measurements for every row, as on board and in `steerway live`.
        smooth: False is the same as `causal=True`, True is the default.

    Raises InputError for an unknown profile, aid or rate, where `causal` and `smooth` are both true, and for a log of
    one vessel with fewer than two positions.
    """
    if causal and smooth:
        raise InputError("causal and smooth are both true, expected one of them at most")
    return LogEstimator(fixes, profile, aid).motion(fixes, rate, not causal and smooth is not False)


class LogEstimator:
    """The estimator of a log, by a given profile or one inferred from the log; arguments as for `estimate`.

    `inference` contains the fits of all structures that were compared; None with a given profile.
    """

    profile: Profile
    inference: Inference | None = None

    def __init__(self, fixes: Fixes, profile: AnyProfile = None, aid: tuple[str, ...] = ()):
        _refuse(fixes)
        self.aid = tuple(each for each in aid if each != AUTO)
        if profile is None and fixes.mmsi is None:
            self.inference = infer_log(fixes, self.aid)
            if AUTO in aid and velocity_of(fixes, self.inference.structures):
                self.aid = tuple(dict.fromkeys((*self.aid, *VELOCITY)))
                self.inference = infer_log(fixes, self.aid)
            self.profile = Profile.of(self.inference.structures)
        else:
            self.profile = choose_profile(fixes, profile, self.aid)
            if AUTO in aid:
                self.aid = tuple(dict.fromkeys((*self.aid, *velocity_parts(self.profile))))

    def motion(self, fixes: Fixes, rate: float | None = None, smooth: bool = False) -> Motion:
        """The estimate of the log or a part of it. Raises InputError for a rate out of range."""
        return motion_of(fixes, self.profile, self.aid, rate, smooth)


def _refuse(fixes: Fixes) -> None:
    """Raise InputError for other types than Fixes, and for a log of one vessel with less than two positions in time."""
    if not isinstance(fixes, Fixes):
        raise InputError(
            f"fixes are given as {type(fixes).__name__}, expected Fixes, as steerway.read(path) returns them"
        )
    times = fixes.time[fixes.has_position]
    if fixes.mmsi is None and not (len(times) and times.max() - times.min() > _ONE_TIME):
        found = f"{len(times)} positions at one time" if len(times) > 1 else f"{len(times)} position"
        raise InputError(f"the log has {found}, expected at least two at different times")


def choose_profile(fixes: Fixes, profile: AnyProfile = None, aid: tuple[str, ...] = ()) -> Profile:
    """The profile named by `profile`, or for None the one that `estimate` uses: inferred from the log with these aids.

    For reports of many vessels that is the built-in profile "ais". Raises InputError as `estimate` does.
    """
    if profile is not None:
        return profile_of(profile)
    if fixes.mmsi is not None:
        return Profile.named("ais")
    return Profile.of(infer_log(fixes, aid).structures)
