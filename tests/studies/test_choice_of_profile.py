"""The choice of a profile: where a course ends, and what is found of a receiver and of a boat."""

import math

import numpy as np
import pytest

import steerway
from steerway.estimation import choose_profile
from steerway.sensors import low_cost
from tests.scenes import angle_error, straight, turning


def with_a_course(speed):
    """Share of rows with a course after a minute, and the RMS error of those (°), by a low-cost receiver."""
    scene = turning(speed, 1.0, 300.0, decay=0.2, density=3e-5)
    home = math.radians(1.0), math.radians(10.0)
    motion = steerway.estimate(low_cost().fixes(scene.time, scene.north, scene.east, 1, origin=home), causal=True)
    error = angle_error(motion.cog, scene.cog)[motion.time >= scene.time[0] + 60.0]
    known = np.isfinite(error)
    return known.mean(), math.degrees(np.sqrt(np.mean(error[known] ** 2))) if known.any() else math.nan


def test_at_rest_there_is_no_course_and_its_error_falls_with_speed():
    (rest, _), (slow, slow_error), (fast, fast_error) = (with_a_course(each) for each in (0.0, 0.7, 3.0))
    assert rest < 0.05 and slow > 0.9 and fast == 1.0
    assert fast_error < 4.0 and fast_error < slow_error < 20.0


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
