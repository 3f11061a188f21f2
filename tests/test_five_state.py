"""The five-state filter: what a step does, and that place does not matter; the printed one equals its author's."""

import copy
import math
import pickle

import numpy as np
import pytest

from steerway import FiveStateFilter, Fixes
from steerway.core import wrap
from steerway.core.testing import displaced
from steerway_studies.testing import Ekf5States, ekf_5states
from tests.five_state_by_matrices import PROFILE, dense, winding
from tests.golden import assert_golden, columns, golden

_, _, SPEED, COURSE, RATE = range(5)


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


def tracked(north, east, time):
    """Rows of the estimate (n, 9) in the plane of the fixes, and their NIS."""
    estimator, rows, found = FiveStateFilter(PROFILE), [], []
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


def test_every_course_is_found_from_nothing():
    time = 0.2 * np.arange(150)
    way = 1.3 * time
    for course_deg in range(-180, 180, 15):
        course = math.radians(course_deg)
        noise = 0.1 * np.random.default_rng(course_deg + 180).standard_normal((2, len(time)))
        output, _ = tracked(way * math.cos(course) + noise[0], way * math.sin(course) + noise[1], time)
        assert abs(wrap(output[-1, COURSE] - course)) < math.radians(5.0), course_deg
        assert abs(output[-1, SPEED] - 1.3) < 0.1, course_deg


SHIP = {"h": 0.1, "z": 1, "alpha_1": 1e-5}
TUNINGS_NED = {
    "a": ("ekf5_ned", "meas", np.diag([0.1, 0.1]), np.diag([0.09, 0.09]), {}),
    "b": ("ekf5_ned", "meas", np.diag([0.5, 0.05]), np.eye(2), {}),
    "s1": ("ekf5_ned_ship", "meas", 1e-5 * np.eye(2), 0.1 * np.eye(2), SHIP | {"alpha_2": 0.2}),
    "s1init": ("ekf5_ned_ship", "meas", 1e-5 * np.eye(2), 0.1 * np.eye(2), SHIP | {"alpha_2": 0.2}),
    "mss": ("ekf5_ned_ship", "meas3", 10.0 * np.eye(2), 1000.0 * np.eye(2), SHIP | {"alpha_2": 1e-5}),
}


@pytest.mark.parametrize("label", TUNINGS_NED)
def test_north_east_frame_equals_the_toolbox(shared_data, label):
    name, measured, q_d, r_d, options = TUNINGS_NED[label]
    table = golden(shared_data, name)
    options = {"h": 0.02, "z": 10} | options
    if label in ("s1init", "mss"):
        first = table[0]
        options["x_init"] = [first[f"{measured}_x"], first[f"{measured}_y"], first["U_true"], first["chi_true"], 0.0]
    pos1, pos2 = table[f"{measured}_x"], table[f"{measured}_y"]
    states, covariances = ekf_5states(pos1, pos2, frame="NED", q_d=q_d, r_d=r_d, return_covariance=True, **options)
    assert_golden(states, columns(table, *(f"{label}_{s}" for s in ("x", "y", "U", "chi", "omega"))))
    if label == "a":
        assert_upper_triangle(covariances, golden(shared_data, "ekf5_ned_P_a"))


def test_latitude_longitude_frame_and_covariance_equal_the_toolbox(shared_data):
    table = golden(shared_data, "ekf5_ll_otter")
    noise = 5e5 * np.eye(2), 1e-8 * np.eye(2)
    found = ekf_5states(table["meas_mu"], table["meas_l"], 0.02, 10, "LL", *noise, return_covariance=True)
    assert_golden(found[0], columns(table, "mu", "l", "U", "chi", "omega"))
    assert_upper_triangle(found[1], golden(shared_data, "ekf5_ll_otter_P"))


def assert_upper_triangle(covariances, table):
    rows, i, j = table["k"].astype(int), *np.triu_indices(5)
    expected = columns(table, *(f"P{a + 1}{b + 1}" for a, b in zip(i, j, strict=True)))
    assert_golden(covariances[rows][:, i, j], expected)


def test_step_by_step_is_the_whole_record():
    draws = np.random.default_rng(4)
    north, east = 0.05 * np.arange(300) + 0.1 * draws.standard_normal((2, 300))
    whole = ekf_5states(north, east, 0.02, 10, "NED", [0.5, 0.5], [0.09, 0.09])
    ekf = Ekf5States(0.02, 10, "NED", [0.5, 0.5], [0.09, 0.09])
    unasked = Ekf5States(0.02, None, "NED", [0.5, 0.5], [0.09, 0.09])
    for k in range(300):
        np.testing.assert_array_equal(ekf.step(north[k], east[k]), whole[k])
        given = (north[k], east[k]) if k % 10 == 0 else ()
        np.testing.assert_array_equal(unasked.step(*given), whole[k])
