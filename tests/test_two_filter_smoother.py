"""The smoother of the inference's modes against what is known in closed form, and from either side."""

import math
from dataclasses import replace

import numpy as np
import pytest

import steerway
from steerway.core import displacement
from steerway.estimation.testing import QUICK_SPEED, QUICK_SPEED_TIME, RATE, SPEED, model_of_profile, reversal_of
from tests.scenes import angle_error, sailed, straight, thinned, usual_profile

NOISE = 0.3
HELD = {"speed_walk": 1e-6, "speed_std": 1e-6, "wander_std": 1e-6, "surge_every": 1e9, "yaw_every": 1e9}
HELD |= {"emergency_every": 1e12, "poor_rate": 1e-9, "outlier_rate": 1e-12, "turn_walk": 1e-7, "yaw_slip": 1e-6}


def profile(*parts, **numbers):
    return usual_profile("base", "wander", *parts, **{"fix_std": NOISE} | numbers)


def smoothed(fixes, *parts, **numbers):
    return steerway.estimate(fixes, profile(*parts, **numbers), aid=parts, smooth=True)


def causal(fixes, **numbers):
    return steerway.estimate(fixes, profile(**numbers), causal=True)


def test_behind_the_last_fix_nothing_is_known_beyond_the_filter():
    fixes = straight(2.0, 0.5, 1.8).fixes(NOISE, 0)
    filtered, whole = causal(fixes), smoothed(fixes)
    known = ("sog", "cog", "course_rate", "latitude", "longitude")
    for name in (*known, "sog_std", "cog_std", "course_rate_std", "position_std"):
        np.testing.assert_allclose(getattr(whole, name)[-1], getattr(filtered, name)[-1], rtol=1e-9, err_msg=name)
    assert whole.sog_std[0] < 0.5 * filtered.sog_std[2]


def test_a_held_speed_is_that_of_the_straight_line():
    std = 0.03
    fixes = straight(2.0, 0.5, 39.8).fixes(std, 0)
    estimate, time = smoothed(fixes, **HELD | {"fix_std": std}).rows(slice(40, 160)), fixes.time - fixes.time.mean()
    places = list(zip(fixes.latitude, fixes.longitude, strict=True))
    slopes = np.polyfit(time, [displacement(*each, *places[100]) for each in places], 1)[0]
    std /= math.sqrt((time**2).sum())
    np.testing.assert_allclose(estimate.sog, math.hypot(*slopes), atol=0.1 * std)
    np.testing.assert_allclose(estimate.cog, math.atan2(slopes[1], slopes[0]), atol=std)


def test_a_gybe_at_speed_keeps_its_speed_and_course():
    """At 1 Hz, a planing craft that turns by 180° in 4 s and slows down from 9 to 3 m/s."""
    time = np.arange(0.0, 60.0, 0.01)
    turn = np.where((time > 28.0) & (time < 32.0), math.pi / 4.0, 0.0)
    scene = thinned(sailed(np.interp(time, [28.0, 33.0], [9.0, 3.0]), np.cumsum(turn) * 0.01, 100.0), 100)
    fixes, numbers = scene.fixes(0.02, 0), {"fix_std": 0.02, "speed_walk": 0.2}
    for estimate, worst, worst_course in ((causal(fixes, **numbers), 1.5, 0.8), (smoothed(fixes, **numbers), 0.8, 0.2)):
        assert np.abs(estimate.sog - scene.sog)[10:].max() < worst
        assert angle_error(estimate.cog, scene.cog)[10:].max() < worst_course


def test_a_gyro_is_read_backwards_with_its_bias():
    rate = np.where(np.arange(600) % 300 < 100, 0.1, 0.0)
    scene, chance = sailed(1.5, np.cumsum(rate) * 0.2), np.random.default_rng(2)
    fixes = scene.fixes(NOISE, 2)
    gyro, compass = rate + 0.02 + chance.normal(0.0, 0.003, 600), scene.cog + chance.normal(0.0, 0.02, 600)
    aided = smoothed(replace(fixes, yaw_rate=gyro, heading=compass), "yaw_rate", "heading")
    alone, inner = smoothed(fixes), slice(50, -50)
    for name, truth in (("cog", scene.cog), ("course_rate", rate)):
        error, unaided = (angle_error(getattr(each, name), truth)[inner] for each in (aided, alone))
        assert np.sqrt(np.mean(error**2)) < 0.5 * np.sqrt(np.mean(unaided**2))


@pytest.mark.parametrize("end", [46.0, math.inf], ids=["and returns", "for good"])
def test_a_step_of_the_receiver_moves_no_smoothed_velocity(end):
    fixes = straight(2.0, 0.5, 79.8).fixes(NOISE, 0, lambda t: (15.0 * ((t >= 40.0) & (t < end)), 0.0 * t))
    estimate = smoothed(fixes).rows(slice(20, -20))
    np.testing.assert_allclose(estimate.sog, 2.0, atol=0.4)
    np.testing.assert_allclose(estimate.cog, 0.5, atol=0.2)


BODY = [1.0, 1.0, 1.0, 1.0, -1.0, 1.0, -1.0]
"""Signs backwards: a rate and its wander change theirs, a place, a speed and its wander do not."""


@pytest.mark.parametrize(
    ("parts", "signs"),
    [
        ((), []),
        (("waves", "antenna", "error"), [1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, 1.0]),
        (("yaw_rate",), [-1.0]),
    ],
    ids=["plain", "many", "aided"],
)
def test_a_structure_backwards(parts, signs):
    """Its modes change as often as forwards, and what oscillates or lies to starboard does so the other way round."""
    model = profile(*parts).structures[0].model
    reversal = reversal_of(model)
    np.testing.assert_allclose(reversal.share.sum(), 1.0)
    np.testing.assert_allclose(reversal.share @ model.generator, 0.0, atol=1e-12)
    np.testing.assert_allclose(reversal.model.generator.sum(axis=1), 0.0, atol=1e-9)
    flow = reversal.share[:, None] * model.generator
    np.testing.assert_allclose(reversal.share[:, None] * reversal.model.generator, flow.T, atol=1e-15)
    assert (reversal.variance[:, RATE:] > 0.0).all() and np.isinf(reversal.variance[:, :RATE]).all()
    np.testing.assert_array_equal(reversal.sign, BODY + signs)
    again = reversal_of(reversal.model)
    np.testing.assert_allclose(again.model.generator, model.generator, atol=1e-9)
    np.testing.assert_array_equal(again.sign, reversal.sign)


def test_a_speed_that_decays_is_as_uncertain_backwards_as_ever():
    profile = steerway.Profile(speed_noise=0.02, speed_decay=0.05, course_rate_noise=1e-3, position_std=NOISE)
    assert reversal_of(model_of_profile(profile)).variance[0, SPEED] == pytest.approx(0.5 * 0.02 / 0.05)


def test_a_causal_speed_holds_what_fixes_far_apart_do_not_resolve():
    apart = 20.0
    estimate = causal(straight(1.0, 0.0, 149 * apart, 1.0 / apart).fixes(NOISE, 0), **HELD)
    a = apart / QUICK_SPEED_TIME
    unresolved = 1.0 - 2.0 * (a - 1.0 + math.exp(-a)) / a**2
    assert estimate.sog[-1] == pytest.approx(1.0, abs=0.01)
    assert QUICK_SPEED * estimate.sog[-1] * math.sqrt(unresolved) < estimate.sog_std[-1] < 0.02


def test_what_a_turn_leaves_behind_does_not_bend_the_leg_before_it():
    course = np.radians(np.r_[np.zeros(300), np.linspace(0.0, 40.0, 20), np.full(300, 40.0)])
    estimate = smoothed(sailed(2.0, course).fixes(NOISE, 0), wander_std=1e-4)
    legs = np.r_[30:280, 340:590]
    assert np.sqrt(np.mean((estimate.cog[legs] - course[legs]) ** 2)) < math.radians(0.3)  # 0.35 if it does
    assert estimate.cog_std[legs].mean() < math.radians(0.4)
