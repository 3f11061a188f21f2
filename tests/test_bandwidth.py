"""What a course estimate carries, against the filter it comes from."""

import math

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from steerway.control import carried_bandwidth
from steerway.control.testing import advice
from steerway.core import InputError


@pytest.mark.parametrize("case", [(1.3, 7.8e-3, 0.5, 0.2), (7.7, 4.4e-6, 2.5, 1.0)])
def test_it_is_the_natural_frequency_of_the_steady_kalman_filter(case):
    """All three poles of the Kalman filter of cross-track, course and course rate have this magnitude."""
    speed, density, std, interval = case
    dynamics = np.array([[0.0, speed, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    seen = np.array([[1.0, 0.0, 0.0]])
    noise = np.diag([0.0, 0.0, density])
    covariance = solve_continuous_are(dynamics.T, seen.T, noise, np.array([[std**2 * interval]]))
    poles = np.linalg.eigvals(dynamics - covariance @ seen.T @ seen / (std**2 * interval))
    np.testing.assert_allclose(np.abs(poles), carried_bandwidth(*case), rtol=1e-6)


def test_the_papers_otter_autopilot_is_too_quick_for_half_a_metre():
    fits, sentence = advice(1.5, 1.3, 7.8e-3, 0.5, 0.2)
    assert not fits
    assert sentence == (
        "An autopilot of 1.5 rad/s will hunt: the course estimate carries 0.8 rad/s at 1.3 m/s with fixes of 0.5 m "
        "every 0.2 s, so lower the bandwidth to that, sail faster or use better fixes."
    )
    fits, sentence = advice(0.5, 1.3, 7.8e-3, 0.5, 0.2)
    assert fits and sentence.startswith("An autopilot of 0.5 rad/s fits")


def test_the_edges():
    assert carried_bandwidth(0.0, 1e-3, 0.5, 0.2) == 0.0
    for place, case in (
        ("position_std", (1.0, 1e-3, 0.0, 0.2)),
        ("fix_interval", (1.0, 1e-3, 0.5, math.nan)),
        ("course_rate_density", (1.0, 0.0, 0.5, 0.2)),
        ("speed", (-1.0, 1e-3, 0.5, 0.2)),
    ):
        with pytest.raises(InputError, match=place):
            carried_bandwidth(*case)
