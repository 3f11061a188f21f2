"""The choice of a profile: where a course ends, and what is found of a receiver and of a boat."""

import math

import numpy as np
import pytest

import steerway
from steerway.estimation import choose_profile
from tests.scenes import angle_error, straight, turning


def expected(profile, *names):
    """Root of the sum of squares of these numbers, weighted mean over structures; 0 where a structure has none."""
    return sum(each.weight * math.hypot(*(each.values.get(n, 0.0) for n in names)) for each in profile.structures)


@pytest.mark.parametrize(("std", "rate"), [(0.02, 5.0), (0.5, 5.0), (0.5, 1.0), (3.0, 1.0)])
def test_the_receiver_is_found(std, rate):
    scene = turning(4.0, 1.0, 600.0, rate=rate, density=1e-3, decay=0.2)
    found = choose_profile(scene.fixes(std, 3))
    total = expected(found, "fix_std", "error_std")
    assert 0.6 * std < total < 1.7 * std


def test_the_choice_comes_near_the_truth_about_the_boat():
    """Estimated by the profile found, COG errs little more than by the very numbers that made the sortie."""
    made = steerway.Profile(speed_noise=1e-5, course_rate_noise=2e-3, course_rate_decay=0.3, position_std=0.5)
    errors = []
    for seed in range(4):
        scene = turning(1.3, 0.4 * seed, 300.0, seed=seed)
        fixes = scene.fixes(0.5, seed)
        errors.append(
            [
                np.nanmean(angle_error(steerway.estimate(fixes, p, causal=True).cog, scene.cog)[100:] ** 2)
                for p in (None, made)
            ]
        )
    found, known = np.sqrt(np.mean(errors, axis=0))
    assert found < 1.15 * known


def test_stretches_from_all_over_a_long_record_are_looked_at():
    """An hour moored, then a sortie: the profile is that of the sortie."""
    rest, sortie = straight(0.0, 0.0, 5000.0, rate=1.0).fixes(0.5, 1), turning(4.0, 1.0, 4000.0, rate=1.0).fixes(0.5, 2)
    columns = {name: np.r_[getattr(rest, name), getattr(sortie, name)] for name in ("latitude", "longitude")}
    both = steerway.Fixes(np.r_[rest.time, sortie.time + 5001.0], **columns)
    found, alone = choose_profile(both), choose_profile(sortie)
    assert 0.5 < expected(found, "fix_std") / expected(alone, "fix_std") < 2.0
    assert 0.2 < expected(found, "yaw_size") / expected(alone, "yaw_size") < 5.0
