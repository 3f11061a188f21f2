"""Thrust allocation to any number of thrusters."""

import numpy as np
import pytest

from steerway import InputError
from steerway.control import Thrusters, thruster_matrix

PLACES = [(-1.0, -0.5, 0.0), (-1.0, 0.5, 0.0), (1.2, 0.0, 0.5 * np.pi), (-1.2, 0.0, 0.5 * np.pi)]
MATRIX = thruster_matrix(PLACES)


def thrusters(low=-50.0, high=50.0):
    return Thrusters(MATRIX, np.full(4, low), np.full(4, high))


def test_a_thruster_turns_about_the_origin_by_its_arm():
    # Thrust ahead at the port stern turns to starboard; so does thrust to starboard at the bow.
    np.testing.assert_allclose(MATRIX[:, 0], [1.0, 0.0, 0.5])
    np.testing.assert_allclose(MATRIX[:, 2], [0.0, 1.0, 1.2], atol=1e-12)


@pytest.mark.parametrize("force", [(10.0, 0.0, 0.0), (0.0, 20.0, -3.0), (-30.0, 5.0, 12.0)])
def test_what_the_limits_allow_is_given_with_the_least_thrust(force):
    thrusts, given = thrusters().allocate(force)
    np.testing.assert_allclose(given, force, atol=1e-9)
    null = np.linalg.svd(MATRIX)[2][3]
    assert abs(thrusts @ null) < 1e-9  # no thrust in the null space of B


def test_a_thruster_at_its_limit_is_relieved_by_the_others():
    # A moment of 70 N·m alone needs more than 20 N from the stern pair and from the bow and stern thrusters.
    wanted = (0.0, 0.0, 45.0)
    free = np.linalg.pinv(MATRIX) @ wanted
    limited = Thrusters(MATRIX, [-50.0, -50.0, -50.0, -50.0], [50.0, 50.0, 0.9 * free.max(), 50.0])
    thrusts, given = limited.allocate(wanted)
    assert thrusts[2] == pytest.approx(0.9 * free.max())
    np.testing.assert_allclose(given, wanted, atol=1e-9)


def test_more_than_all_can_give_stays_within_the_limits():
    thrusts, given = thrusters().allocate((1e6, 0.0, 0.0))
    assert (np.abs(thrusts) <= 50.0).all() and given[0] == pytest.approx(100.0) and abs(given[2]) < 1e-9


def test_a_pilot_is_told_what_its_force_and_moment_came_to():
    *thrusts, force, moment = thrusters().step(20.0, 5.0)
    assert len(thrusts) == 4 and (force, moment) == pytest.approx((20.0, 5.0))


@pytest.mark.parametrize(
    "arguments, words",
    [
        ((np.eye(2), [-1, -1], [1, 1]), r"thrusters\.matrix has shape \(2, 2\)"),
        ((np.eye(3), [-1, -1], [1, 1, 1]), r"thrusters\.low has shape \(2,\), expected \(3,\)"),
        ((np.eye(3), [-1] * 3, [1, 1]), r"thrusters\.high has shape \(2,\), expected \(3,\)"),
        ((np.eye(3), [0, 0, 0], [1, 1, 0]), "expected low at most 0, high above 0"),
        ((np.ones((3, 4)), [-1] * 4, [1] * 4), "three independent ones"),
    ],
)
def test_thrusters_that_cannot_be_are_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        Thrusters(*arguments)
