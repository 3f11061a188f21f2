"""The smoother of the inference's modes against what is known in closed form, and from either side."""

import math

import numpy as np
import pytest

from steerway.estimation.testing import (
    AIDS,
    COG,
    COG_STD,
    QUICK_SPEED,
    QUICK_SPEED_TIME,
    RATE,
    SOG,
    SOG_STD,
    Rows,
    Structure,
    estimated,
    medians_of,
    model_of,
    reversal_of,
)
from steerway.estimation.testing import RATE as RATE_STATE

NOISE = 0.3
STEERAGEWAY = 0.3
_NONE = np.empty(0)


def structure(parts=(), **numbers):
    parts = ("base", "wander", *parts)
    return Structure(weight=1.0, parts=parts, values=medians_of(parts) | {"fix_std": NOISE} | numbers)


def record(north, east, dt=0.2, aids=None):
    aids = np.empty((0, len(AIDS))) if aids is None else aids
    return Rows(np.arange(len(north)) * dt, north, east, _NONE, aids, np.empty(0, np.int64))


def filtered(fixes, structures):
    """Rows of the causal estimate."""
    return estimated(fixes, structures, STEERAGEWAY).causal


def smoothed(fixes, structures):
    """Rows of the estimate that knows the whole record."""
    return estimated(fixes, structures, STEERAGEWAY, smooth=True).smoothed


def on_a_line(n, std=NOISE, seed=0):
    """Fixes of a vessel at 2 m/s on course 0.5, 5 Hz."""
    way = 0.4 * np.arange(n)
    noise = np.random.default_rng(seed).normal(0.0, std, (2, n))
    return way * math.cos(0.5) + noise[0], way * math.sin(0.5) + noise[1]


HELD = {"speed_walk": 1e-6, "speed_std": 1e-6, "wander_std": 1e-6, "surge_every": 1e9, "yaw_every": 1e9}
HELD |= {"emergency_every": 1e12, "poor_rate": 1e-9, "outlier_rate": 1e-12, "turn_walk": 1e-7, "yaw_slip": 1e-6}


def test_behind_the_last_fix_nothing_is_known_beyond_the_filter():
    fixes, one = record(*on_a_line(10)), [structure()]
    causal, whole = filtered(fixes, one), smoothed(fixes, one)
    np.testing.assert_allclose(whole[-1], causal[-1], rtol=1e-9)
    assert whole[0, SOG_STD] < 0.5 * causal[2, SOG_STD]


def test_a_held_speed_is_that_of_the_straight_line():
    std = 0.03
    north, east = on_a_line(200, std)
    estimate = smoothed(record(north, east), [structure(**HELD | {"fix_std": std})])
    time = np.arange(200) * 0.2
    slopes = np.polyfit(time, np.column_stack([north, east]), 1)[0]
    std /= math.sqrt(((time - time.mean()) ** 2).sum())
    middle = estimate[40:160]
    np.testing.assert_allclose(middle[:, SOG], math.hypot(*slopes), atol=0.1 * std)
    np.testing.assert_allclose(middle[:, COG], math.atan2(slopes[1], slopes[0]), atol=std)


def gybe():
    """Fixes at 1 Hz of a planing craft that turns by 180° in 4 s and slows down from 9 to 3 m/s; speed and course."""
    time = np.arange(0.0, 60.0, 0.01)
    speed = np.interp(time, [28.0, 33.0], [9.0, 3.0])
    course = np.cumsum(np.where((time > 28.0) & (time < 32.0), math.pi / 4.0, 0.0)) * 0.01
    place = np.cumsum([speed * np.cos(course), speed * np.sin(course)], axis=1) * 0.01
    return place[:, ::100] + np.random.default_rng(0).normal(0.0, 0.02, (2, 60)), speed[::100], course[::100]


def test_a_gybe_at_speed_keeps_its_speed_and_course():
    (north, east), speed, course = gybe()
    fixes, numbers = record(north, east, 1.0), [structure(fix_std=0.02, speed_walk=0.2)]
    causal, whole = filtered(fixes, numbers)[10:], smoothed(fixes, numbers)[10:]
    for estimate, worst, worst_course in ((causal, 1.5, 0.8), (whole, 0.8, 0.2)):
        assert np.isfinite(estimate[:, COG]).all()
        assert np.abs(estimate[:, SOG] - speed[10:]).max() < worst
        assert np.abs(np.angle(np.exp(1j * (estimate[:, COG] - course[10:])))).max() < worst_course


def test_a_gyro_is_read_backwards_with_its_bias():
    n, dt, bias = 600, 0.2, 0.02
    rate = np.where(np.arange(n) % 300 < 100, 0.1, 0.0)
    course = np.cumsum(rate) * dt
    random = np.random.default_rng(2)
    aids = np.full((n, len(AIDS)), np.nan)
    aids[:, AIDS.index("yaw_rate")] = rate + bias + random.normal(0.0, 0.003, n)
    aids[:, AIDS.index("heading")] = course + random.normal(0.0, 0.02, n)
    noise = random.normal(0.0, NOISE, (2, n))
    north, east = np.cumsum(1.5 * np.cos(course)) * dt + noise[0], np.cumsum(1.5 * np.sin(course)) * dt + noise[1]
    estimate = smoothed(record(north, east, aids=aids), [structure(("yaw_rate", "heading"))])
    alone = smoothed(record(north, east), [structure()])
    inner = slice(50, -50)
    for column, truth in ((COG, course), (RATE, rate)):
        error, unaided = (np.sin(each[:, column] - truth)[inner] for each in (estimate, alone))
        assert np.sqrt(np.mean(error**2)) < 0.5 * np.sqrt(np.mean(unaided**2))


@pytest.mark.parametrize("returns", [True, False], ids=["and returns", "for good"])
def test_a_step_of_the_receiver_moves_no_smoothed_velocity(returns):
    north, east = on_a_line(400)
    north[200 : 230 if returns else None] += 15.0
    estimate = smoothed(record(north, east), [structure()])
    np.testing.assert_allclose(estimate[20:-20, SOG], 2.0, atol=0.4)
    np.testing.assert_allclose(estimate[20:-20, COG], 0.5, atol=0.2)


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
    one = structure(parts)
    model = model_of(one.parts, one.values)
    reversal = reversal_of(model)
    np.testing.assert_allclose(reversal.share.sum(), 1.0)
    np.testing.assert_allclose(reversal.share @ model.generator, 0.0, atol=1e-12)
    np.testing.assert_allclose(reversal.model.generator.sum(axis=1), 0.0, atol=1e-9)
    flow = reversal.share[:, None] * model.generator
    np.testing.assert_allclose(reversal.share[:, None] * reversal.model.generator, flow.T, atol=1e-15)
    assert (reversal.variance[:, RATE_STATE:] > 0.0).all() and np.isinf(reversal.variance[:, :RATE_STATE]).all()
    np.testing.assert_array_equal(reversal.sign, BODY + signs)
    again = reversal_of(reversal.model)
    np.testing.assert_allclose(again.model.generator, model.generator, atol=1e-9)
    np.testing.assert_array_equal(again.sign, reversal.sign)


def test_a_causal_speed_holds_what_fixes_far_apart_do_not_resolve():
    apart, held = 20.0, structure(**HELD)
    north, east = np.random.default_rng(0).normal(0.0, NOISE, (2, 150))
    estimate = filtered(record(north + apart * np.arange(150), east, apart), [held])
    a = apart / QUICK_SPEED_TIME
    unresolved = 1.0 - 2.0 * (a - 1.0 + math.exp(-a)) / a**2
    assert estimate[-1, SOG] == pytest.approx(1.0, abs=0.01)
    assert QUICK_SPEED * estimate[-1, SOG] * math.sqrt(unresolved) < estimate[-1, SOG_STD] < 0.02


def test_what_a_turn_leaves_behind_does_not_bend_the_leg_before_it():
    course = np.radians(np.r_[np.zeros(300), np.linspace(0.0, 40.0, 20), np.full(300, 40.0)])
    noise = np.random.default_rng(0).normal(0.0, NOISE, (2, len(course)))
    north, east = np.cumsum(0.4 * np.array([np.cos(course), np.sin(course)]), axis=1) + noise
    estimate = smoothed(record(north, east), [structure(wander_std=1e-4)])
    legs = np.r_[30:280, 340:590]
    assert np.sqrt(np.mean((estimate[legs, COG] - course[legs]) ** 2)) < math.radians(0.3)  # 0.35 if it does
    assert estimate[legs, COG_STD].mean() < math.radians(0.4)
