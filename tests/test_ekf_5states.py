"""The labelled faithful filter against outputs of its author's public toolbox, and the errata of what is printed."""

import numpy as np
import pytest

from steerway_studies.testing import Ekf5States, ekf_5states
from tests.golden import assert_golden, columns, golden

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


def test_an_unknown_position_is_no_fix_and_spoils_nothing():
    time = 0.02 * np.arange(1000)
    north, east = 1.2 * time, 0.3 * time
    whole = ekf_5states(north, east, 0.02, 10, "NED", [0.5, 0.5], [0.4, 0.1])
    north[[0, 400]] = np.nan
    found = ekf_5states(north, east, 0.02, 10, "NED", [0.5, 0.5], [0.4, 0.1])
    assert np.isnan(found[0]).all() and np.isfinite(found[1:]).all()
    np.testing.assert_allclose(found[-1], whole[-1], atol=0.02)
    at_any_row = ekf_5states(
        np.where(np.arange(1000) % 10 == 1, 1.2 * time, np.nan), east, 0.02, None, "NED", [0.5, 0.5], [0.4, 0.1]
    )
    np.testing.assert_allclose(at_any_row[-1], whole[-1], atol=0.02)


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
