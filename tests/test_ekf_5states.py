"""The labelled faithful filter against outputs of its author's public toolbox."""

import numpy as np
import polars as pl
import pytest

import steerway
from steerway_studies.testing import ekf_5states

SHIP = {"h": 0.1, "z": 1, "alpha_1": 1e-5}
TUNINGS_NED = {
    "a": ("ekf5_ned.csv", "meas", np.diag([0.1, 0.1]), np.diag([0.09, 0.09]), {}),
    "b": ("ekf5_ned.csv", "meas", np.diag([0.5, 0.05]), np.eye(2), {}),
    "s1": ("ekf5_ned_ship.csv", "meas", 1e-5 * np.eye(2), 0.1 * np.eye(2), SHIP | {"alpha_2": 0.2}),
    "s1init": ("ekf5_ned_ship.csv", "meas", 1e-5 * np.eye(2), 0.1 * np.eye(2), SHIP | {"alpha_2": 0.2}),
    "mss": ("ekf5_ned_ship.csv", "meas3", 10.0 * np.eye(2), 1000.0 * np.eye(2), SHIP | {"alpha_2": 1e-5}),
}


def assert_golden(ours, golden):
    np.testing.assert_allclose(ours, golden, rtol=1e-9, atol=1e-10)


@pytest.fixture(scope="module")
def mss(shared_data):
    return lambda name: pl.read_csv(shared_data / "reference" / "mss" / name)


@pytest.mark.parametrize("label", TUNINGS_NED)
def test_north_east_frame_equals_the_toolbox(mss, label):
    name, measured, q_d, r_d, options = TUNINGS_NED[label]
    table = mss(name)
    pos1, pos2 = table[f"{measured}_x"].to_numpy(), table[f"{measured}_y"].to_numpy()
    options = {"h": 0.02, "z": 10} | options
    if label in ("s1init", "mss"):
        options["x_init"] = [pos1[0], pos2[0], table["U_true"][0], table["chi_true"][0], 0.0]
    states = ekf_5states(pos1, pos2, frame="NED", q_d=q_d, r_d=r_d, **options)
    assert_golden(states, table.select(f"{label}_{s}" for s in ("x", "y", "U", "chi", "omega")).to_numpy())


def test_latitude_longitude_frame_and_covariance_equal_the_toolbox(mss):
    table, golden_p = mss("ekf5_ll_otter.csv"), mss("ekf5_ll_otter_P.csv")
    latitude, longitude = table["meas_mu"].to_numpy(), table["meas_l"].to_numpy()
    q_d, r_d = 5e5 * np.eye(2), 1e-8 * np.eye(2)
    states, covariances = ekf_5states(latitude, longitude, 0.02, 10, "LL", q_d, r_d, return_covariance=True)
    assert_golden(states, table.select("mu", "l", "U", "chi", "omega").to_numpy())
    assert_upper_triangle(covariances, golden_p)


def test_covariance_equals_the_toolbox(mss):
    table, golden_p = mss("ekf5_ned.csv"), mss("ekf5_ned_P_a.csv")
    _, covariances = ekf_5states(
        table["meas_x"], table["meas_y"], 0.02, 10, "NED", [0.1, 0.1], [0.09, 0.09], return_covariance=True
    )
    assert_upper_triangle(covariances, golden_p)


def assert_upper_triangle(covariances, golden):
    for row in golden.iter_rows(named=True):
        for i in range(5):
            for j in range(i, 5):
                assert_golden(covariances[row["k"], i, j], row[f"P{i + 1}{j + 1}"])


def test_another_frame_is_refused():
    with pytest.raises(steerway.InputError, match="frame is 'ENU'"):
        ekf_5states([0.0], [0.0], 0.1, 1, "ENU", [1, 1], [1, 1])


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
