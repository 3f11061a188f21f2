"""Generic claims of the five-state filter: what a step does, that Q is sound, that order and place do not matter."""

import copy
import itertools
import math
import pickle

import numpy as np
import pytest

from steerway import FiveStateFilter, Fixes
from steerway.core import wrap
from steerway.core.testing import displaced
from tests.five_state_by_matrices import PROFILE, dense, winding

STEPS = (0.02, 0.2, 1.0, 7.0)
_, _, SPEED, COURSE, RATE = range(5)


def test_the_jacobian_is_the_slope_of_the_motion():
    for seed, dt in itertools.product(range(5), STEPS):
        model, rng = dense(PROFILE, dt), np.random.default_rng(seed)
        x = np.array([3.0, -2.0, rng.uniform(0.5, 8.0), rng.uniform(-math.pi, math.pi), rng.uniform(-0.3, 0.3)])
        f = model.step(x)[1]
        h = 1e-6
        slopes = [(model.step(x + h * e)[0] - model.step(x - h * e)[0]) / (2.0 * h) for e in np.eye(5)]
        np.testing.assert_allclose(f, np.transpose(slopes), rtol=1e-7, atol=1e-7)


def test_a_step_follows_the_arc():
    """The step against fine Euler steps of P0 (11)–(15) with the corrected predictor of Table 1."""
    profile = PROFILE.model_copy(update={"speed_decay": 0.05})
    start = np.array([10.0, 20.0, 3.0, 2.5, -0.15])
    n, dt = 100_000, 0.5
    x = start.copy()
    for _ in range(n):
        rates = [x[2] * math.cos(x[3]), x[2] * math.sin(x[3]), -0.05 * x[2], x[4], -profile.course_rate_decay * x[4]]
        x += dt / n * np.array(rates)
    after = dense(profile, dt).step(start)[0]  # as the kernels, by `test_table_one`
    np.testing.assert_allclose(after, x, atol=2e-4)  # the chord takes the rate as constant: 1e-4 m here


def tracked(north, east, time, profile=PROFILE):
    """Rows of the estimate (n, 9) in the plane of the fixes, and their NIS."""
    estimator, rows, found = FiveStateFilter(profile), [], []
    for k in range(len(time)):
        estimator.predict(time[k] - time[k - 1] if k else 0.0)
        found.append(estimator.update_north_east(north[k], east[k]))
        rows.append(estimator.output())
    return np.array(rows), np.array(found)


def assert_turned(scene, original, turn, sign=1.0):
    """The scene's SOG, course and rate are the original's, turned by `turn` after a change of sign (a mirror)."""
    known = np.isfinite(original[:, COURSE])
    assert known.sum() > 1000
    np.testing.assert_array_equal(known, np.isfinite(scene[:, COURSE]))
    for column in (SPEED, 5, 6, 7, 8):
        np.testing.assert_allclose(scene[known, column], original[known, column], rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(scene[known, RATE], sign * original[known, RATE], atol=1e-8)
    gap = [wrap(each) for each in scene[known, COURSE] - sign * original[known, COURSE] - turn]
    np.testing.assert_allclose(gap, 0.0, atol=1e-8)


def test_a_turned_mirrored_and_moved_scene_give_the_same_estimate_there():
    time, north, east = winding()
    original, nis = tracked(north, east, time)
    for turn in np.radians([37.0, 90.0, 180.0, 300.0]):
        c, s = math.cos(turn), math.sin(turn)
        scene, scene_nis = tracked(c * north - s * east, s * north + c * east, time)
        assert_turned(scene, original, turn)
        np.testing.assert_allclose(scene_nis, nis, rtol=1e-6, atol=1e-8)
    assert_turned(tracked(north, -east, time)[0], original, 0.0, sign=-1.0)
    scene, _ = tracked(north + 4096.0, east - 8192.0, time + 1024.0)
    assert_turned(scene, original, 0.0)
    np.testing.assert_allclose(scene[:, :2] - original[:, :2], [[4096.0, -8192.0]] * len(time), atol=1e-7)


def on_earth(latitude_deg, longitude_deg):
    """The winding boat around a place, through latitude and longitude: its motion."""
    time, north, east = winding()
    origin = math.radians(latitude_deg), math.radians(longitude_deg)
    # Metre by metre along the track, so that the scene is the same on the ground wherever it lies.
    places = [origin]
    for k in range(1, len(time)):
        places.append(displaced(*places[-1], north[k] - north[k - 1], east[k] - east[k - 1]))
    latitude, longitude = np.array(places).T
    return FiveStateFilter(PROFILE).filter(Fixes(time, latitude, longitude))


def test_a_place_changes_nothing():
    """The antimeridian is crossed, the meridians meet at 80°: the motion is that of the plane."""
    time, north, east = winding()
    plane, _ = tracked(north, east, time)
    for place in ((0.0, 179.999), (-45.0, -179.9999), (63.4, 10.4), (80.0, 179.99), (-80.0, 0.0)):
        motion = on_earth(*place)
        assert np.all((motion.longitude >= -math.pi) & (motion.longitude < math.pi)), place
        late = slice(50, None)
        np.testing.assert_allclose(motion.sog[late], plane[late, SPEED], atol=2e-3)
        gap = [wrap(each) for each in motion.cog[late] - plane[late, COURSE]]
        assert np.abs(gap).max() < math.radians(0.1), place


def test_a_turn_to_starboard_is_positive():
    """From north over east: course and rate grow. Exchanged axes or a wrong sign of the turn are found here.

    Without decay of the rate the filter follows a steady turn without bias.
    """
    time = 0.2 * np.arange(600)
    rate = 0.02
    north, east = 3.0 / rate * np.sin(rate * time), 3.0 / rate * (1.0 - np.cos(rate * time))
    output, _ = tracked(north, east, time, PROFILE.model_copy(update={"course_rate_decay": 0.0}))
    assert output[-1, RATE] == pytest.approx(rate, rel=0.02)
    assert wrap(output[-1, COURSE] - rate * time[-1]) == pytest.approx(0.0, abs=math.radians(1.0))
    assert output[-1, SPEED] == pytest.approx(3.0, rel=0.01)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
def test_a_copy_goes_on_by_itself(copied):
    def sail(estimator, first, last):
        for k in range(first, last):
            estimator.predict(1.0)
            estimator.update_north_east(2.0 * k, 1.0 * k)

    whole_way, first_half = FiveStateFilter(PROFILE), FiveStateFilter(PROFILE)
    sail(whole_way, 0, 40)
    sail(first_half, 0, 20)
    before = first_half.state.copy()
    second_half = copied(first_half)
    sail(second_half, 20, 40)
    np.testing.assert_array_equal(second_half.state, whole_way.state)
    np.testing.assert_array_equal(second_half.covariance, whole_way.covariance)
    np.testing.assert_array_equal(first_half.state, before)


def test_a_position_has_one_unit():
    estimator = FiveStateFilter("otter")
    estimator.update(1.0, 0.2)
    assert estimator.position == pytest.approx((1.0, 0.2), rel=1e-15) and np.isnan(estimator.position_north_east).all()
    estimator = FiveStateFilter("otter")
    estimator.update_north_east(30.0, 40.0)
    assert estimator.position_north_east == (30.0, 40.0) and np.isnan(estimator.position).all()


def test_every_course_is_found_from_nothing():
    time = 0.2 * np.arange(150)
    way = 1.3 * time
    for course_deg in range(-180, 180, 15):
        course = math.radians(course_deg)
        noise = 0.1 * np.random.default_rng(course_deg + 180).standard_normal((2, len(time)))
        output, _ = tracked(way * math.cos(course) + noise[0], way * math.sin(course) + noise[1], time)
        assert abs(wrap(output[-1, COURSE] - course)) < math.radians(5.0), course_deg
        assert abs(output[-1, SPEED] - 1.3) < 0.1, course_deg
