"""Levels of noise of AIS reports, by class: of vessels that manoeuvre, and of those that go on as they do.

The profile of its class is that of a vessel that manoeuvres. The others depend on the time from report to report: the
most probable ones over half of the vessels of 145,000 recorded reports (the Solent, the United States, San Francisco,
a stream from many stations) among those with a mean NIS of 2.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from steerway.archive.association import LEVELS, MANOEUVRING, STEADY
from steerway.estimation.course.motion.layout import VELOCITY_CHANGE
from steerway.estimation.profiles import BUILT_IN, Profile

PROFILES = ("ais", "ais-class-a", "ais-class-b")
"""Built-in profiles of `formats.ais_tables.MOBILES`: unknown, class A, class B."""

_CHANGE_STD = 2.0
"""m/s along either axis by which a manoeuvre has changed the velocity since the last report."""
_AT_REST = ("speed_noise", "position_std")
_UNDER_WAY = ("speed_noise", "course_rate_noise", "acceleration_std", "position_std", "time_std")
_STEADY = {
    "ais": (
        ((2.1e-9, 0.10), (8.3e-3, 1.4e-4, 0.087, 1.9, 0.43)),
        ((5.1e-8, 1.0), (1.4e-5, 5.4e-6, 0.0014, 0.59, 0.54)),
        ((7.2e-9, 1.1), (1.3e-5, 3.6e-6, 0.0013, 1.6, 0.36)),
    ),
    "ais-class-a": (
        ((1.6e-6, 0.25), (1.9e-3, 1.1e-5, 0.00095, 0.43, 0.54)),
        ((2.9e-8, 1.1), (2.6e-6, 6.5e-6, 0.0028, 0.77, 0.42)),
        ((3.3e-7, 0.99), (7.0e-5, 3.8e-6, 0.0016, 0.31, 0.55)),
    ),
    "ais-class-b": (
        ((1.0e-9, 0.11), (7.3e-6, 7.8e-5, 0.26, 2.9, 2.9)),
        ((1.0e-5, 3.8), (3.4e-7, 1.9e-5, 0.0042, 4.7, 0.25)),
        ((1.1e-7, 0.76), (2.1e-5, 4.6e-6, 0.0035, 0.31, 0.67)),
    ),
}
"""At rest and under way, for each class of `association.INTERVALS`."""
_NO_STEERAGEWAY = 1e-4  # m/s: at rest all process noise is speed_noise then, see `motion.low_speed`


def levels(profile: Profile | None) -> list[list[Profile]]:
    """Profiles by class and level (LEVELS); all alike where one is given."""
    if profile is not None:
        return [[profile] * LEVELS] * len(PROFILES)
    return [_levels_of(BUILT_IN[name]) for name in PROFILES]


def _levels_of(profile) -> list[Profile]:
    found = [profile] * STEADY
    for at_rest, under_way in _STEADY[profile.name]:
        still = dict(zip(_AT_REST, at_rest, strict=True)) | {"steerageway": _NO_STEERAGEWAY}
        found.append(profile.model_copy(update=still))
        found.append(profile.model_copy(update=dict(zip(_UNDER_WAY, under_way, strict=True))))
    return found


def parameters(profiles: Sequence[Sequence[dict[str, Any]]], aid: tuple[str, ...]) -> np.ndarray:
    """(classes, LEVELS, 1, k) parameters of the kernels."""
    found = np.stack([[Profile(**each).parameters(aid) for each in some] for some in profiles])
    for of_class, some in zip(found, profiles, strict=True):
        if some[STEADY] != some[MANOEUVRING]:
            of_class[MANOEUVRING, 0, VELOCITY_CHANGE] = _CHANGE_STD**2
    return found


def profile_names(manifest: dict[str, Any]) -> str:
    """Of the profiles of an archive's classes."""
    return "/".join(each[0]["name"] for each in manifest["profiles"])
