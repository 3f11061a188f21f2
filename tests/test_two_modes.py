"""A vessel that holds her course and turns by turns."""

import math

import numpy as np

import steerway
from steerway.core import REJECTED, wrap_array
from steerway.estimation import Profile
from steerway_studies.testing import CELLS
from tests.scenes import angle_error, straight

STEADY = {"speed_noise": 1e-4, "course_rate_noise": 1e-5, "course_rate_decay": 1.0, "position_std": 0.5}
TURNING = {"turn_speed_noise": 1e-4, "turn_course_rate_noise": 7.8e-3, "turn_course_rate_decay": 0.2}
BOTH = Profile(**STEADY, **TURNING, turn_time=10.0, straight_time=40.0)


def test_on_a_held_course_it_is_better_than_a_filter_for_turns_and_consistent():
    turner = Profile(speed_noise=1e-4, course_rate_noise=7.8e-3, course_rate_decay=0.2, position_std=0.5)
    errors, scores = {"both": [], "turner": []}, []
    for seed in range(10):
        scene = straight(1.3, 0.3 * seed, 120.0)
        fixes = scene.fixes(0.5, seed)
        for name, profile in (("both", BOTH), ("turner", turner)):
            motion = steerway.estimate(fixes, profile, causal=True)
            errors[name].append(np.mean(angle_error(motion.cog, scene.cog)[150:] ** 2))
            if name == "both":
                scores.append(np.nanmean(motion.nis))
    assert np.sqrt(np.mean(errors["both"])) < 0.5 * np.sqrt(np.mean(errors["turner"]))
    assert 1.85 < np.mean(scores) < 2.15


def test_a_fix_that_a_turn_would_explain_is_believed_however_unlikely_the_turn():
    """Ship of scenario M, a fix every 10 s: at the beginning of a turn she is not where a held course would lead."""
    cell, squares, refused = CELLS["m05"], [], 0
    for seed in range(10):
        voyage, fixes = cell.sailed(seed)
        seldom = np.arange(0, len(fixes), 50)
        motion = steerway.estimate(fixes.rows(seldom), cell.profile, causal=True)
        squares.append(wrap_array(motion.cog - voyage.cog[seldom])[5:] ** 2)
        refused += np.sum(motion.status == REJECTED)
    assert refused < 20
    assert math.degrees(np.sqrt(np.nanmean(squares))) < 1.6
