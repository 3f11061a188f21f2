"""Noise levels of AIS reports by class of vessel: manoeuvring, and steady motion at rest or under way.

A manoeuvring vessel has the built-in profile of its class, but with white speed noise instead of persistent
acceleration. Both have the same diffusion of speed over minutes, and the filter keeps its five states. The steady
levels depend on the interval between reports. Among values with a mean NIS of 2, they have the highest likelihood on
half of the vessels in 145,000 recorded reports (the Solent, the United States, San Francisco, a stream from many
stations).
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from steerway.archive.filters import Filters, filters_of
from steerway.archive.tracks import LEVELS, MANOEUVRING, STEADY
from steerway.estimation.log.course import least_course_speed
from steerway.estimation.vessel.flat import WeighedModel, model_of_profile
from steerway.estimation.vessel.profile import BUILT_IN, Profile
from steerway.estimation.vessel.structures import model_of

PROFILES = ("ais", "ais-class-a", "ais-class-b")
"""Built-in profile of each entry of `formats.ais_tables.MOBILES`: unknown, class A, class B."""

_CHANGE_STD = 2.0
"""1σ (m/s per axis) of the change of velocity that a manoeuvre may have made since the last report."""
_RESTING = range(STEADY, LEVELS, 2)
"""Levels of a vessel at rest: speed_noise acts in all directions, at any speed."""
_TURNING_AT_REST = 1e-5
"""Factor on the course-rate noise at rest. Zero would be no more accurate, and the smoother could not use it."""
_AT_REST = ("speed_noise", "position_std")
_UNDER_WAY = ("speed_noise", "course_rate_noise", "position_std", "time_std")
_STEADY = {
    "ais": (
        ((1.0e-9, 0.24), (0.037, 2.3e-4, 0.32, 0.6)),
        ((2.9e-8, 1.1), (6.1e-5, 4.2e-6, 1, 0.68)),
        ((1.4e-6, 0.086), (1.1e-4, 2.2e-6, 7.8, 0.042)),
    ),
    "ais-class-a": (
        ((1.6e-6, 0.25), (0.0015, 8.8e-6, 0.38, 0.48)),
        ((2.6e-8, 1), (2.4e-4, 6.7e-6, 0.78, 0.43)),
        ((3.4e-7, 1), (1.4e-4, 3.6e-6, 0.3, 0.54)),
    ),
    "ais-class-b": (
        ((1.0e-9, 0.1), (3.3, 1.5e-5, 7.6, 0.37)),
        ((1.9e-7, 1.5), (5.3e-4, 1.6e-5, 4, 0.048)),
        ((2.8e-7, 0.6), (2.0e-5, 1.1e-5, 0.31, 0.96)),
    ),
}
"""Values of `_AT_REST` and `_UNDER_WAY` for each class of intervals (`tracks.INTERVALS`)."""


def levels(profile: Profile | None) -> list[list[Profile]]:
    """Profiles by class (PROFILES) and level (LEVELS); a given profile alone, which is used for all of them."""
    if profile is not None:
        return [[profile]]
    return [_levels_of(BUILT_IN[name]) for name in PROFILES]


def _levels_of(profile: Profile) -> list[Profile]:
    noise = profile.speed_noise + 2.0 * profile.acceleration_std**2 * profile.acceleration_time
    manoeuvring = profile.model_copy(update={"speed_noise": noise, "acceleration_std": 0.0})
    found = [manoeuvring] * STEADY
    for each in _STEADY[profile.name]:
        for names, values in zip((_AT_REST, _UNDER_WAY), each, strict=True):
            found.append(manoeuvring.model_copy(update=dict(zip(names, values, strict=True))))
    return found


def filters(profiles: Sequence[Sequence[dict[str, Any]]], aid: tuple[str, ...], smooth: bool = False) -> Filters:
    """The filters of the kernels, by class and level. For smoothing, two modes are averaged into one."""
    found: list[WeighedModel] = []
    change, steerageway = [], []
    for some in profiles:
        levelled = some[-1] != some[0]
        for level, each in enumerate(some):
            profile = Profile(**each)
            structures = _alike(profile.on_average if smooth else profile, aid)
            for _, model in structures:
                if levelled and level in _RESTING:
                    model.modes["drift_speed"] = math.inf
                    model.modes["rate_noise"] *= _TURNING_AT_REST
                elif levelled and level < STEADY:
                    model.modes["manoeuvres"] = 1  # else the large noise would look like speed of a vessel at rest
            found += structures
            change.append(_CHANGE_STD**2 if levelled and level == MANOEUVRING else 0.0)
            steerageway.append(least_course_speed(structures, profile.steerageway))
    weights = np.array([each.weight for each in structures])
    by_level = np.arange(0, len(found), len(weights)), np.array(change), np.array(steerageway)
    first, changes, speeds = (np.resize(each, len(PROFILES) * LEVELS) for each in by_level)
    return filters_of([each.model for each in found], first, weights, changes, speeds)


def _alike(profile: Profile, aid: tuple[str, ...]) -> list[WeighedModel]:
    """The models of a profile, all of one size. The last digits of fixes are those of the inputs."""
    structures = profile.structures
    if not structures:
        return [WeighedModel(1.0, model_of_profile(profile, aid))]
    parts = tuple({name: 0 for each in structures for name in each.parts})
    return [WeighedModel(each.weight, model_of(each.parts, each.values, beside=parts)) for each in structures]


def profile_names(manifest: dict[str, Any]) -> str:
    """Names of the profiles of an archive's classes."""
    return "/".join(each[0]["name"] for each in manifest["profiles"])
