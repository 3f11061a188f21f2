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
from steerway.estimation.course.packing import pack
from steerway.estimation.vessel.profile import BUILT_IN, Profile

PROFILES = ("ais", "ais-class-a", "ais-class-b")
"""Built-in profiles of `formats.ais_tables.MOBILES`: unknown, class A, class B."""

_CHANGE_STD = 2.0
"""m/s along either axis by which a manoeuvre has changed the velocity since the last report."""
_AT_REST = ("speed_noise", "position_std")
_UNDER_WAY = ("speed_noise", "course_rate_noise", "acceleration_std", "position_std", "time_std")
_STEADY = {
    "ais": (
        ((1.0e-9, 0.24), (4.5e-7, 2.3e-4, 0.035, 0.32, 0.60)),
        ((2.9e-8, 1.1), (4.3e-5, 4.2e-6, 0.00078, 1.0, 0.68)),
        ((1.4e-6, 0.086), (1.8e-6, 2.2e-6, 0.0019, 7.8, 0.042)),
    ),
    "ais-class-a": (
        ((1.6e-6, 0.25), (1.5e-3, 8.8e-6, 0.00085, 0.38, 0.48)),
        ((2.6e-8, 1.0), (2.7e-6, 6.7e-6, 0.0028, 0.78, 0.43)),
        ((3.4e-7, 1.0), (6.7e-5, 3.6e-6, 0.0016, 0.30, 0.54)),
    ),
    "ais-class-b": (
        ((1.0e-9, 0.10), (1.5e-2, 1.5e-5, 0.33, 7.6, 0.37)),
        ((1.9e-7, 1.5), (1.2e-7, 1.6e-5, 0.0042, 4.0, 0.048)),
        ((2.8e-7, 0.60), (6.9e-7, 1.1e-5, 0.0008, 0.31, 0.96)),
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
    found = np.stack([[pack(Profile(**each), aid) for each in some] for some in profiles])
    for of_class, some in zip(found, profiles, strict=True):
        if some[STEADY] != some[MANOEUVRING]:
            of_class[MANOEUVRING, 0, VELOCITY_CHANGE] = _CHANGE_STD**2
    return found


def profile_names(manifest: dict[str, Any]) -> str:
    """Of the profiles of an archive's classes."""
    return "/".join(each[0]["name"] for each in manifest["profiles"])
