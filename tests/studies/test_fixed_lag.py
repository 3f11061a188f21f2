"""What a delay is worth: course and speed against the truth, on the simulated Otter's mission."""

import pytest

from steerway.estimation import Profile
from tests.golden import missed, no_worse
from tests.studies.test_unknown_noise import sailed
from tests.test_fixed_lag import errors

SEEDS = 91, 92, 93
WORTH = {0.5: 0.95, 1.0: 0.85, 2.0: 0.65}
"""Lag in s, and the most that is left of the course's error without one."""


@pytest.mark.parametrize("std", [0.1, 0.5])
@pytest.mark.parametrize("told", [True, False])
def test_a_delay_betters_course_and_speed(told, std):
    profile = Profile.named("otter").model_copy(update={"position_std": std}) if told else None
    scene = sailed("otter-mission", 5.0, 300.0)
    cog, sog, at_once = errors(scene, profile, std, 1e-3, SEEDS)
    for lag, most in WORTH.items():
        delayed_cog, delayed_sog, within = errors(scene, profile, std, lag, SEEDS)
        print(f"{lag:g} s: COG {delayed_cog / cog:.2f}, SOG {delayed_sog / sog:.2f}, {within:.3f} within 2 sigma")
        assert delayed_cog < most * cog and delayed_sog < sog and within > at_once - 0.02


@missed("without a profile 86 to 88 % are within 2σ, late or not")
@pytest.mark.parametrize("std", [0.1, 0.5])
def test_courses_without_a_profile_are_within_two_sigma(std):
    scene = sailed("otter-mission", 5.0, 300.0)
    within = errors(scene, None, std, 1e-3, SEEDS)[2]
    no_worse(within > 0.85, within)
    assert within > 0.9
