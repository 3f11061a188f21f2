"""When a course is defined: never by the noise of a boat at rest, soon once it moves."""

import numpy as np
import pytest

import steerway
from steerway.archive.testing import levels, tracks
from steerway.core import Fixes
from steerway.core.testing import displaced_all
from steerway.estimation import FiveStateFilter, Profile


def filtered(seed, rate, speed):
    """Motion of a boat that goes north from the first fix on, with white errors of 0.5 m, for a minute."""
    profile = Profile(speed_noise=1e-3, course_rate_noise=2e-3, course_rate_decay=0.3, position_std=0.5)
    time = np.arange(0.0, 60.0, 1.0 / rate)
    north, east = 0.5 * np.random.default_rng(seed).standard_normal((2, len(time)))
    return FiveStateFilter(profile).filter(Fixes(time, *displaced_all(0.9, 0.2, north + speed * time, east)))


@pytest.mark.xfail(
    strict=True,
    raises=AssertionError,
    reason="a course is stated at 1.7 of its deviations: seconds after a start noise has one",
)
def test_noise_alone_gives_no_course():
    """Of a boat at rest in the first minute."""
    found = np.array([np.isfinite(filtered(seed, 5.0, 0.0).cog) for seed in range(80)])
    if found.mean() >= 0.02 or found[:, 50:].any():
        pytest.fail("longer than it had one")
    assert not found.any()


@pytest.mark.parametrize("rate", [1.0, 5.0])
def test_a_moving_boat_has_a_course_soon(rate):
    """1.5 m/s is 3 of the fixes' deviations a second: most starts take less than 4 s."""
    delays = []
    for seed in range(25):
        motion = filtered(seed, rate, 1.5)
        delays.append(motion.time[np.isfinite(motion.cog)][0])
    assert np.median(delays) <= 4.0 and max(delays) <= 8.0


@pytest.mark.parametrize("smooth", [False, True])
def test_a_slow_drift_has_a_course_where_the_receiver_is_good_enough(smooth):
    """Two minutes at 0.1 m/s: fixes of 1 cm tell the course, those of 30 cm may not."""
    time = np.arange(0.0, 120.0, 0.2)
    noise = np.random.default_rng(1).standard_normal((2, len(time)))
    for std, defined in ((0.01, True), (0.3, False)):
        profile = Profile(speed_noise=1e-6, course_rate_noise=1e-5, course_rate_decay=0.3, position_std=std)
        north, east = std * noise + 0.1 * time * np.array([[0.6], [0.8]])
        motion = steerway.estimate(Fixes(time, *displaced_all(0.9, 0.2, north, east)), profile, smooth=smooth)
        settled = motion.rows(motion.time > 30.0)
        assert np.isfinite(settled.cog).all() if defined else np.isnan(settled.cog).all()
        if defined:
            error = np.abs(settled.cog - np.arctan2(0.8, 0.6)) / settled.cog_std
            assert np.mean(error < 1.96) > 0.9 and np.median(settled.cog_std) < 0.2


def test_the_archive_has_the_limit_of_the_record():
    profile = Profile(speed_noise=1e-6, course_rate_noise=1e-5, course_rate_decay=0.3, position_std=0.01)
    filters = levels.filters([[profile.model_dump()] * tracks.LEVELS], ())
    assert filters.steerageway == pytest.approx(0.03)
