"""Aids in the inference: what is fitted with them, and which are used without being asked for."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import steerway
from steerway.core import Fixes
from steerway.estimation import choose_profile, estimate
from steerway.estimation.testing import LogEstimator, velocity_of
from steerway.sensors import Gnss, Instrument
from steerway_studies.testing import SLOW
from steerway_studies.testing import limits_judged as judged
from steerway_studies.testing import scenarios_sail as sail
from tests import scenes
from tests.golden import missed, no_worse
from tests.scenes import angle_error

VELOCITY_STD = 0.05
GYRO_STD, GYRO_BIAS = math.radians(0.1), math.radians(0.3)


def aided_fixes(voyage, seed):
    """Fixes of 0.5 m with the receiver's own velocity and a gyro's rate beside them."""
    gnss = Gnss(rate=SLOW.rate, white=0.5, velocity_std=VELOCITY_STD)
    velocity = {"north_velocity": voyage.sog * np.cos(voyage.cog), "east_velocity": voyage.sog * np.sin(voyage.cog)}
    fixes = gnss.fixes(voyage.time, voyage.north, voyage.east, seed, **velocity)
    gyro = Instrument(rate=SLOW.rate, white=GYRO_STD, bias=GYRO_BIAS)
    _, rate = gyro.measured(voyage.time, voyage.course_rate, [seed, 3])
    return Fixes(fixes.time, fixes.latitude, fixes.longitude, sog=fixes.sog, cog=fixes.cog, yaw_rate=rate)


def likeliest(fixes, aid):
    return max(choose_profile(fixes, aid=aid).structures, key=lambda each: each.weight)


@pytest.mark.study
def test_a_gyro_shows_the_few_turns_of_a_short_log():
    """Five minutes of whose turns the positions alone say too little: half of them goes straight."""
    voyage = sail(SLOW, 6)
    fixes = aided_fixes(voyage, 6)
    profile = choose_profile(fixes, aid=("yaw_rate",))
    found = sum(each.weight * each.values["yaw_rate_std"] for each in profile.structures)
    assert found == pytest.approx(GYRO_STD, rel=0.15)
    sums = judged(estimate(fixes, profile, aid=("yaw_rate",), causal=True), voyage, SLOW)
    straight, turn = np.degrees(np.sqrt(sums[:, 1] / sums[:, 3]))
    assert straight < 0.6
    assert turn < 1.05


@pytest.mark.study
@missed("0.063 of 0.1°/s: quick wander is as probable as a gyro's noise, 1 row a second")
def test_aids_between_the_fixes_are_used():
    voyage = sail(SLOW, 0)
    fixes = aided_fixes(voyage, 0)
    silent = np.where(np.arange(len(fixes)) % 5 > 0, np.nan, 0.0)  # all but every fifth position
    fixes = replace(fixes, latitude=fixes.latitude + silent, longitude=fixes.longitude + silent)
    values = likeliest(fixes, ("yaw_rate",)).values
    no_worse(values["yaw_rate_std"] > 0.62 * GYRO_STD, values)
    assert values["yaw_rate_std"] == pytest.approx(GYRO_STD, rel=0.15)
    assert values["fix_std"] == pytest.approx(0.5, rel=0.1)


def with_velocity(north, east):
    """The fixes with this velocity (m/s) as SOG and COG."""
    return replace(scenes.small_craft()[1], sog=np.hypot(north, east), cog=np.arctan2(east, north))


@cache
def doppler():
    scene = scenes.small_craft()[0]
    noise = np.random.default_rng(3).normal(0.0, 0.05, (2, len(scene.time)))
    return with_velocity(scene.sog * np.cos(scene.cog) + noise[0], scene.sog * np.sin(scene.cog) + noise[1])


def differences(span):
    """Velocity from the fix so many rows before."""
    fixes = scenes.small_craft()[1]
    radius = 6.37e6 * np.array([[1.0], [math.cos(fixes.latitude[0])]])
    place = radius * np.array([fixes.latitude, fixes.longitude])
    return with_velocity(*np.pad(place[:, span:] - place[:, :-span], ((0, 0), (span, 0))) / (0.2 * span))


def rms(errors):
    return math.sqrt(np.nanmean(errors[100:] ** 2))


def test_a_doppler_velocity_is_used():
    scene, fixes, alone = scenes.small_craft()
    first = slice(300)
    estimator = LogEstimator(doppler().rows(first), aid=("auto",))
    assert estimator.aid == ("sog", "cog")
    plain, aided = alone.motion(fixes.rows(first)), estimator.motion(doppler().rows(first))
    assert rms(angle_error(aided.cog, scene.cog[first])) < 0.6 * rms(angle_error(plain.cog, scene.cog[first]))
    covered = angle_error(aided.cog, scene.cog[first])[100:] < 1.96 * aided.cog_std[100:]
    assert covered.mean() > 0.9


def test_differences_of_the_same_positions_are_not():
    structures = scenes.small_craft()[2].profile.structures
    assert velocity_of(doppler(), structures)
    assert not any(velocity_of(differences(span), structures) for span in (1, 15))


def test_without_a_velocity_and_with_a_profile_nothing_changes():
    _, fixes, alone = scenes.small_craft()
    assert not velocity_of(fixes, alone.profile.structures)
    np.testing.assert_array_equal(
        steerway.estimate(doppler(), "small-usv", aid=("auto",)).sog, steerway.estimate(fixes, "small-usv").sog
    )
